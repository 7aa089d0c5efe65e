"""Output folders: whole or not at all, and nothing of the user's is ever lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scenarios.files import output_folder
from scenarios.files.errors import ScenarioError
from scenarios.files.output_folder import RUN, check_replaceable, replacing, updating


def tree(top: Path) -> dict[str, str]:
    """Every file below `top` with its text, folders as ''."""
    return {str(p.relative_to(top)): p.read_text() if p.is_file() else "" for p in sorted(top.rglob("*"))}


def a_run(out: Path, text: str = "old") -> Path:
    with replacing(out, RUN) as new:
        (new / "scenario.yaml").write_text(text)
        (new / "dataset").mkdir()
        (new / "dataset" / "dataset.json").write_text(text)
    return out


def test_a_new_folder_appears_with_its_parents_when_the_block_ends(tmp_path):
    out = tmp_path / "a" / "b" / "run"
    with replacing(out, RUN) as new:
        (new / "scenario.yaml").write_text("x")
        assert not out.exists()
    assert tree(tmp_path / "a" / "b") == {"run": "", "run/scenario.yaml": "x"}


def test_an_earlier_run_is_replaced_as_a_whole(tmp_path):
    a_run(tmp_path / "run")
    with replacing(tmp_path / "run", RUN) as new:
        (new / "scenario.yaml").write_text("new")
    assert tree(tmp_path) == {"run": "", "run/scenario.yaml": "new"}


def test_an_empty_folder_is_taken(tmp_path):
    (tmp_path / "run").mkdir()
    a_run(tmp_path / "run", "x")
    assert (tmp_path / "run" / "scenario.yaml").read_text() == "x"


def test_a_new_folder_has_the_usual_permissions(tmp_path):
    (tmp_path / "usual").mkdir()
    assert a_run(tmp_path / "run").stat().st_mode == (tmp_path / "usual").stat().st_mode


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_the_old_folder_and_nothing_else(tmp_path, error):
    a_run(tmp_path / "run")
    before = tree(tmp_path)
    with pytest.raises(error), replacing(tmp_path / "run", RUN) as new:
        (new / "scenario.yaml").write_text("half")
        raise error
    assert tree(tmp_path) == before


def test_a_failure_leaves_no_new_parents(tmp_path):
    with pytest.raises(ValueError), replacing(tmp_path / "a" / "b" / "run", RUN):
        raise ValueError
    assert tree(tmp_path) == {}


FILES = ("evaluation.json", "score.json")


@pytest.mark.parametrize("present", [(), FILES[:1], FILES[1:], FILES])
@pytest.mark.parametrize("written", [FILES[:1], FILES[1:], FILES])
def test_an_interrupt_while_moving_brings_the_old_files_back(tmp_path, monkeypatch, present, written):
    a_run(tmp_path / "run")
    for name in present:
        (tmp_path / "run" / name).write_text("old")
    before = tree(tmp_path)
    rename = Path.rename
    for interrupted in range(len(present) + len(written)):
        calls: list[Path] = []

        def interrupt(self: Path, target: Path, calls: list[Path] = calls, at: int = interrupted) -> Path:
            calls.append(target)
            if len(calls) == at + 1:
                raise KeyboardInterrupt
            return rename(self, target)

        monkeypatch.setattr(Path, "rename", interrupt)
        with pytest.raises(KeyboardInterrupt), updating(tmp_path / "run", output_folder.EVALUATION) as new:
            for name in written:
                (new / name).write_text("new")
        assert tree(tmp_path) == before


@pytest.mark.parametrize(
    ("foreign", "words"),
    [
        (["notes.txt"], "holds notes.txt"),
        (["scenario.yaml", "thesis.tex"], "holds thesis.tex"),
        (["figures"], "holds no scenario.yaml"),
    ],
)
def test_a_folder_that_is_not_ours_is_refused_and_kept(tmp_path, foreign, words):
    (tmp_path / "mine").mkdir()
    for name in foreign:
        (tmp_path / "mine" / name).write_text("mine")
    before = tree(tmp_path)
    with pytest.raises(ScenarioError, match=words), replacing(tmp_path / "mine", RUN):
        pytest.fail("must be refused before any work")
    assert tree(tmp_path) == before


def test_a_file_and_the_current_folder_are_refused(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "here" / "below").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here" / "below")
    for out, words in ((tmp_path / "file", "is a file"), (Path(), "you are in"), (Path(".."), "you are in")):
        with pytest.raises(ScenarioError, match=words), replacing(out, RUN):
            pytest.fail("must be refused before any work")
    with pytest.raises(ScenarioError, match="is a file"), updating(tmp_path / "file", ()):
        pytest.fail("must be refused before any work")


def test_a_place_below_a_file_is_reported(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ScenarioError, match="cannot be written"), replacing(tmp_path / "file" / "run", RUN):
        pytest.fail("must be refused before any work")


def test_updating_replaces_its_own_entries_and_keeps_the_rest(tmp_path):
    a_run(tmp_path / "run")
    (tmp_path / "run" / "score.json").write_text("stale")
    (tmp_path / "run" / "notes.txt").write_text("mine")
    with updating(tmp_path / "run", output_folder.EVALUATION) as new:
        (new / "evaluation.json").write_text("new")
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        "scenario.yaml",
        "dataset",
        "notes.txt",
        "evaluation.json",
    }
    with updating(tmp_path / "elsewhere", output_folder.EVALUATION) as new:
        (new / "evaluation.json").write_text("new")
    assert tree(tmp_path / "elsewhere") == {"evaluation.json": "new"}


def test_ctrl_c_in_a_real_process_leaves_nothing(tmp_path):
    script = (
        "import sys, time\nfrom scenarios.folder import RUN, replacing\n"
        "with replacing(sys.argv[1], RUN) as new:\n"
        "    (new / 'scenario.yaml').write_text('half')\n    print('ready', flush=True)\n    time.sleep(30)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path / "run")], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(0.05)
    os.kill(process.pid, signal.SIGINT)
    process.communicate(timeout=10)
    assert process.returncode != 0
    assert tree(tmp_path) == {}


def test_what_a_killed_process_left_is_no_file_of_the_users(tmp_path):
    (tmp_path / "run").mkdir()
    for name in ("scenario.yaml", ".report.html.1a2b3c4d.part"):
        (tmp_path / "run" / name).write_text("")
    check_replaceable(tmp_path / "run", RUN)
    (tmp_path / "run" / "notes.part").write_text("")
    with pytest.raises(ScenarioError, match=r"holds notes\.part"):
        check_replaceable(tmp_path / "run", RUN)
