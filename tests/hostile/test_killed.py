"""A command killed while it writes: complete, resumable, or as before; nothing is read that is half old, half new."""

import errno
import os
import random
import resource
import signal
import time
from pathlib import Path

import pytest

from scenarios.files.errors import ScenarioError
from scenarios.files.output_folder import EVALUATION, RUN, replacing, settle, updating
from tests.hostile.rows.child import forked

RESULTS = ("evaluation.json", "score.json", "evaluation.nc")


def _write(out: Path, stamp: str, whole: bool) -> None:
    """A run, or its evaluation alone."""
    with replacing(out, RUN) if whole else updating(out, EVALUATION, "evaluation.json") as new:
        if whole:
            (new / "scenario.yaml").write_text(stamp)
            for name in ("dataset", "estimate"):
                (new / name).mkdir()
                (new / name / f"{name}.json").write_text(stamp)
        for name in RESULTS[: 3 if whole or stamp == "new" else 2]:
            (new / name).write_text(stamp)


def _stamps(out: Path) -> set[str]:
    return {p.read_text() for p in out.rglob("*") if p.is_file() and ".partial" not in str(p)}


def _dying(out: Path, whole: bool, at: int) -> None:
    """Write, and end as by SIGKILL at the n-th rename, or the n-th minus a half."""
    calls, rename = [0], os.rename

    def counted(source, target, **options):
        calls[0] += 1
        if calls[0] > at:
            os.kill(os.getpid(), signal.SIGKILL)
        return rename(source, target, **options)

    os.rename = counted
    _write(out, "new", whole)


@pytest.mark.parametrize("whole", [True, False])
def test_killed_at_every_rename_a_run_is_old_or_new_and_never_believed_between(tmp_path, whole):
    seen = set()
    for at in range(40):
        out = tmp_path / str(at)
        _write(out, "old", True)
        found = forked(lambda at=at, out=out: _dying(out, whole, at))
        believed = (out / "evaluation.json").is_file()
        results = {(out / n).read_text() for n in RESULTS if (out / n).is_file()}
        assert not believed or len(results) == 1, "results of two evaluations beside each other"
        assert not (whole and believed) or len(_stamps(out)) == 1
        settle(out)
        after = {(out / n).read_text() for n in RESULTS}
        assert len(after) == 1 and (not whole or len(_stamps(out)) == 1)
        assert not list(tmp_path.rglob("*.partial"))
        seen |= after
        if found.code == 0:
            break
        assert found.code == -signal.SIGKILL
    assert at > 5 and seen == {"new"}, "what was complete goes on"


@pytest.mark.slow
def test_killed_at_random_moments_a_run_is_old_or_new(tmp_path):
    rng, out = random.Random(0), tmp_path / "run"
    _write(out, "0", True)
    for k in range(1, 101):
        child = os.fork()
        if child == 0:
            for _ in range(1000):
                _write(out, str(k), True)
            os._exit(0)
        time.sleep(rng.uniform(0.0, 0.03))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        settle(out)
        assert len(_stamps(out)) == 1 and (out / "evaluation.json").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_the_second_of_two_commands_is_reported(tmp_path):
    for out in (tmp_path / "there", tmp_path / "new"):
        if out.name == "there":
            out.mkdir()
        with replacing(out, RUN) as new:
            (new / "scenario.yaml").write_text("first")
            with pytest.raises(ScenarioError, match="another command is writing it"), replacing(out, RUN):
                pytest.fail("must be reported")
        assert (out / "scenario.yaml").read_text() == "first"


def test_what_a_user_puts_there_meanwhile_stays(tmp_path):
    out = tmp_path / "run"
    _write(out, "old", True)
    (out / "figures").mkdir()
    for name in ("dataset/notes.txt", "figures/mine.svg"):
        (out / name).write_text("mine")
    with replacing(out, RUN) as new:
        for folder in ("dataset", "figures"):
            (new / folder).mkdir()
        (new / "scenario.yaml").write_text("new")
        (out / "thesis.tex").write_text("mine")
        (out / "plots").mkdir()
    mine = [p for p in ("dataset/notes.txt", "figures/mine.svg", "thesis.tex") if (out / p).read_text() == "mine"]
    assert len(mine) == 3 and (out / "plots").is_dir() and not (out / "estimate").exists()


def test_a_full_disk_is_one_line_and_leaves_what_was_there(tmp_path):
    from scenarios.commands import main
    from tests.doubles import run_folder

    run_folder.write_dataset(tmp_path / "data")
    before = sorted(tmp_path.rglob("*"))

    def work() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
        main.main(["export", "csv", str(tmp_path / "data"), "--out", str(tmp_path / "out")])

    found = forked(work)
    assert found.code == 1 and os.strerror(errno.EFBIG) in found.output and "Traceback" not in found.output
    assert sorted(tmp_path.rglob("*")) == before
