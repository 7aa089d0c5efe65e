import hashlib
import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import psutil
import pytest

from scenarios import load
from scenarios.datasets import open_collection, workers
from scenarios.datasets.collection import Plan, collect
from scenarios.datasets.index import read_index
from scenarios.datasets.run_content import recordings, recordings_and_truth
from scenarios.datasets.run_spec import Magnitude, seed_of
from scenarios.datasets.workers import Workers
from scenarios.files.errors import ScenarioError
from tests.scenarios.datasets import collection_script
from twin.errors import TwinError

SCRIPT = Path(__file__).parent / "collection_script.py"
N = 8


def tree(folder):
    """Name and sha256 of every file of a folder."""
    return {
        p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def numbers(scenario, out):
    (out / "dataset").mkdir()
    (out / "dataset" / "x.txt").write_text(str(np.random.default_rng(scenario.seed).normal(size=3)))
    return (Magnitude("seed_mod_7", float(scenario.seed % 7)),)


def made(folder, n=N, produce=numbers, scenario=None, workers=Workers()):  # noqa: B008  it is frozen
    plan = Plan(scenario or load("humanoids2024"), n, folder, produce)
    return collect(plan, workers, lambda at, share: None)


@dataclass
class Started:
    """The script as a process of its own, its words in files: workers that outlive it would keep a pipe open."""

    process: subprocess.Popen
    said: Path

    def ended(self):
        code = self.process.wait(timeout=300)
        return code, (self.said / "err").read_text()

    def kill(self):
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def script(out, n=N, workers=0, scheduler="", produce="numbers", **options):
    said = out.with_name(f"{out.name}.said")
    said.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(SCRIPT), str(out), str(n), str(workers), scheduler, produce]
    with (said / "out").open("w") as stdout, (said / "err").open("w") as stderr:
        process = subprocess.Popen(command, stdout=stdout, stderr=stderr, start_new_session=True, **options)
    return Started(process, said)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed") / "c"
    made(out, produce=collection_script.numbers)
    return tree(out)


@pytest.fixture(scope="module")
def scripted(tmp_path_factory):
    """The same by the script, whose functions have another name."""
    out = tmp_path_factory.mktemp("scripted") / "c"
    code, err = script(out).ended()
    assert code == 0, err
    return tree(out)


def test_seeds_are_numpys_spawned_ones_and_differ():
    assert seed_of(3, 5) == np.random.SeedSequence(3, spawn_key=(5,)).generate_state(1, np.uint64)[0]
    assert len({seed_of(root, i) for root in range(10) for i in range(1000)}) == 10_000


def test_a_run_is_the_same_in_a_larger_collection(tmp_path):
    made(tmp_path / "a", 3)
    made(tmp_path / "b", 12)
    a, b = tree(tmp_path / "a" / "runs"), tree(tmp_path / "b" / "runs")
    assert a == {name: b[name] for name in a}


def test_the_index_tells_each_run(tmp_path):
    rows = made(tmp_path / "c", 10)
    assert read_index(tmp_path / "c" / "index.csv") == rows
    assert [row.split for row in rows] == ["train"] * 8 + ["validation", "test"]
    root = load("humanoids2024").seed
    assert [row.magnitudes[0].value for row in rows] == [seed_of(root, i) % 7 for i in range(10)]
    assert all(row.bytes == (tmp_path / "c/runs" / f"{row.id:06d}" / "dataset/x.txt").stat().st_size for row in rows)


def test_what_is_right_stays_and_what_is_not_is_made_again(tmp_path):
    made(tmp_path / "c")
    before, runs = tree(tmp_path / "c"), tmp_path / "c" / "runs"
    kept = (runs / "000000/dataset/x.txt").stat().st_mtime_ns
    (runs / "000001/dataset/x.txt").write_text("changed")
    (runs / "000002/run.json").write_text('{"id": 2')
    (runs / "000003/dataset/more.txt").write_text("not of the run")
    (runs / "000004/dataset/x.txt").unlink()
    (runs / ".000005.abcd.partial").mkdir()
    (tmp_path / "c/index.csv").unlink()
    made(tmp_path / "c")
    assert tree(tmp_path / "c") == before
    assert (runs / "000000/dataset/x.txt").stat().st_mtime_ns == kept
    assert not list(runs.glob(".*"))


def test_the_first_run_that_is_made_says_how_long_the_others_take(tmp_path):
    made(tmp_path / "c", 3)
    said, at = [], []
    plan = Plan(load("humanoids2024"), 6, tmp_path / "c", numbers)
    collect(plan, Workers(), lambda text, share: at.append(text), announce=said.append)
    assert len(said) == 1 and said[0].endswith("left with 1 worker")
    assert [text.split(",")[0] for text in at] == ["timing the first run", "5 of 6 runs", "6 of 6 runs"]


def test_a_collection_can_grow_but_not_shrink_or_change(tmp_path):
    made(tmp_path / "c", 3)
    made(tmp_path / "c", 5)
    made(tmp_path / "whole", 5)
    assert tree(tmp_path / "c") == tree(tmp_path / "whole")
    with pytest.raises(ScenarioError, match="holds 5 runs"):
        made(tmp_path / "c", 4)
    other = load("humanoids2024", ["seed=9"])
    with pytest.raises(ScenarioError, match="another scenario, seed"):
        made(tmp_path / "c", 5, scenario=other)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("x")
    with pytest.raises(ScenarioError, match="left alone"):
        made(tmp_path / "mine", 5)


def test_a_run_without_a_result_is_a_row_with_its_reason(tmp_path):
    def produce(scenario, out):
        if scenario.seed == seed_of(4, 1):
            raise TwinError("trial xyz at 3.2 s:\n arm_4_joint diverged")
        return numbers(scenario, out)

    rows = made(tmp_path / "c", 3, produce, load("humanoids2024", ["seed=4"]))
    assert [row.status for row in rows] == ["ok", "failed", "ok"]
    assert rows[1].reason == "trial xyz at 3.2 s: arm_4_joint diverged"
    assert sorted(p.name for p in (tmp_path / "c/runs").iterdir()) == ["000000", "000002"]


def test_without_a_worker_it_stops_and_says_so(tmp_path, monkeypatch):
    class Never:
        def submit(self, *task):
            return Future()

    monkeypatch.setattr(workers, "_pool", lambda _: nullcontext(workers._Pool(Never(), 1, lambda: False)))
    monkeypatch.setattr(workers, "_LOOK", 0.01)
    with pytest.raises(workers.SchedulerLost, match="no worker has been there for 0 s; start one"):
        next(workers.compute([object()], Workers()))


@pytest.mark.slow
def test_a_mistake_and_a_killed_worker_end_as_rows_and_the_rest_completes(tmp_path):
    code, err = script(tmp_path / "c", workers=2, produce="worse").ended()
    assert code == 0, err
    rows = read_index(tmp_path / "c" / "index.csv")
    assert [row.status for row in rows] == ["ok", "ok", "failed", "ok", "killed", "ok", "ok", "ok"]
    assert rows[2].reason == "ValueError: no such thing"
    assert "took its worker down" in rows[4].reason


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
def test_killed_at_random_moments_it_resumes_to_the_same_bytes(tmp_path, scripted, workers):
    rng = random.Random(workers)
    out = tmp_path / "c"
    for _ in range(3):
        started = script(out, workers=workers)
        time.sleep(rng.uniform(1.5, 4.5))
        started.kill()
        if (out / "index.csv").is_file():
            assert all(row.status == "ok" for row in read_index(out / "index.csv"))
    code, err = script(out, workers=workers).ended()
    assert code == 0, err
    assert tree(out) == scripted


def test_ctrl_c_leaves_an_index_of_what_is_complete_and_workers_go_on_to_the_same_bytes(
    tmp_path, undisturbed, monkeypatch
):
    left = iter(range(10, -1, -1))

    def pause(_):
        if next(left) == 0:  # in the third run
            os.kill(os.getpid(), signal.SIGINT)

    out = tmp_path / "c"
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs are born without
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(collection_script.time, "sleep", pause)
        made(out, produce=collection_script.numbers)
    rows = read_index(out / "index.csv")
    assert len(rows) == 2
    assert not list((out / "runs").glob(".*"))
    made(out, produce=collection_script.numbers, workers=Workers(1))
    assert tree(out) == undisturbed


@pytest.mark.slow
def test_without_room_it_stops_and_goes_on_later(tmp_path, scripted):
    out = tmp_path / "c"
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))  # noqa: E731
    code, err = script(out, preexec_fn=limit).ended()
    assert code == 1
    assert re.search(r"NoRoom: .* make room", err)
    assert read_index(out / "index.csv") == ()
    assert not list((out / "runs").iterdir())
    assert script(out).ended()[0] == 0
    assert tree(out) == scripted


def test_two_commands_do_not_write_one_folder(tmp_path):
    def produce(scenario, out):
        with pytest.raises(ScenarioError, match="another command"):
            made(tmp_path / "c", 1, produce)
        return numbers(scenario, out)

    assert [row.status for row in made(tmp_path / "c", 1, produce)] == ["ok"]


@pytest.mark.slow
def test_a_scheduler_of_ours_and_its_workers_listen_on_loopback_alone():
    with workers._client(Workers(1)) as client:
        found = client.scheduler_info(n_workers=-1)
        here = psutil.Process()
        sockets = [c for p in (here, *here.children(recursive=True)) for c in p.net_connections()]
    listening = [c.laddr.ip for c in sockets if c.status == psutil.CONN_LISTEN]
    assert {urlsplit(address).hostname for address in (found["address"], *found["workers"])} == {"127.0.0.1"}
    assert len(listening) >= 3 and set(listening) == {"127.0.0.1"}


def test_a_scheduler_that_is_not_there_is_reported(tmp_path, monkeypatch):
    from scenarios.datasets import workers as engine

    monkeypatch.setattr(engine, "_PATIENCE", "1s")
    with pytest.raises(engine.SchedulerLost, match="no scheduler answers"):
        plan = Plan(load("humanoids2024"), 2, tmp_path / "c", numbers)
        collect(plan, Workers(scheduler="tcp://127.0.0.1:1"), lambda at, share: None)


@pytest.fixture
def scheduler(tmp_path):
    """Address of a scheduler with two workers, started as the documentation says."""
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path, "start_new_session": True}
    file = tmp_path / "scheduler.json"
    commands = (
        [*dask, "scheduler", "--port", "0", "--dashboard-address", ":0", "--scheduler-file", str(file)],
        [*dask, "worker", "--scheduler-file", str(file), "--nworkers", "2", "--nthreads", "1"],
    )
    started = [subprocess.Popen(command, **quiet) for command in commands]
    while not file.is_file() or not file.read_text():
        time.sleep(0.05)
    time.sleep(4.0)
    yield json.loads(file.read_text())["address"], started
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.mark.slow
def test_a_scheduler_of_ones_own_gives_the_same_bytes_and_may_die(tmp_path, scripted, scheduler):
    address, started = scheduler
    code, err = script(tmp_path / "c", scheduler=address).ended()
    assert code == 0, err
    assert tree(tmp_path / "c") == scripted
    process = script(tmp_path / "d", 200, scheduler=address)
    while not list((tmp_path / "d" / "runs").glob("00*")):
        time.sleep(0.05)
    os.killpg(started[0].pid, signal.SIGKILL)
    code, err = process.ended()
    assert (code, "SchedulerLost" in err) == (1, True), err
    assert script(tmp_path / "d", 200).ended()[0] == 0
    whole = tmp_path / "whole"
    assert script(whole, 200, workers=2).ended()[0] == 0
    assert tree(tmp_path / "d") == tree(whole)


@pytest.fixture(scope="module")
def short():
    scenario = load("swing20", ["twin.campaign.calibration_swing=2.0"])
    return scenario.model_copy(update={"twin": replace(scenario.twin)})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, short):
    out = tmp_path_factory.mktemp("recorded") / "c"
    made(out, 2, recordings_and_truth, short)
    return open_collection(out)


def test_a_blind_collection_has_the_same_recordings_and_nothing_else(tmp_path, short, recorded):
    collect(Plan(short, 2, tmp_path / "c", recordings, blind=True), Workers(), lambda at, share: None)
    names = {name: sha for name, sha in tree(recorded.folder / "runs").items() if "/dataset/" in name}
    assert {name: sha for name, sha in tree(tmp_path / "c" / "runs").items() if "run.json" not in name} == names
    texts = [p.read_text() for p in (tmp_path / "c").rglob("*") if p.suffix in (".json", ".csv", ".md", ".yaml")]
    secrets = [str(seed_of(short.seed, i)) for i in range(2)] + ["stiffness", "friction", "gap"]
    assert [word for word in secrets for text in texts if word in text] == []


def test_a_collection_is_read_lazily_with_numpy_and_xarray(recorded):
    pytest.importorskip("xarray")
    runs = list(recorded.runs())
    assert [run.row.id for run in runs] == [0, 1]
    trial, true = runs[1].trial("around_y"), runs[1].truth("around_y")
    assert np.abs(trial.marker_position - true.marker_position).max() < 1e-3
    for part in ("dataset", "truth"):
        with runs[1].xarray("around_y", part) as opened:
            assert opened.sizes["marker"] == len(trial.marker)
            for name, variable in opened.variables.items():
                assert {"units", "frame", "clock"} <= variable.attrs.keys(), name
    with pytest.raises(ScenarioError, match="around_y"):
        runs[0].trial("nothing")
    assert list(recorded.runs("test")) == []
    card = (recorded.folder / "datasheet.md").read_text()
    assert "Splits are by robot" in card and "splits: 2 train" in card and "| marker_position |" in card


def test_a_run_is_repeated_from_its_own_scenario(tmp_path, recorded):
    from scenarios.files import yaml_file
    from twin import record

    run = next(recorded.runs())
    scenario = load(run.folder / "scenario.yaml")
    yaml_file.write(tmp_path / "written.yaml", scenario)
    assert (run.folder / "scenario.yaml").read_bytes() == (tmp_path / "written.yaml").read_bytes()
    record(scenario.twin, scenario.seed, tmp_path / "again")
    assert tree(tmp_path / "again" / "dataset") == tree(run.folder / "dataset")
    assert tree(tmp_path / "again" / "truth") == tree(run.folder / "truth")
