"""Frozen tasks: what is frozen stays, blind folders show no hand, entries are scored; a sample of what is slow."""

import json
from dataclasses import replace

import numpy as np
import pytest

import calibration
import twin
from calibration.evaluation import write_submission
from scenarios import load
from scenarios.benchmarks import frozen, scoring
from scenarios.benchmarks.blind import write_blind
from scenarios.benchmarks.make import make, runs
from scenarios.benchmarks.tasks import TASKS
from scenarios.datasets.index import Row
from scenarios.datasets.reader import Run
from scenarios.datasets.run_spec import seed_of
from scenarios.datasets.workers import Workers
from scenarios.files.errors import ScenarioError
from twin.truth import Parameter, read_parameters, read_trial

BY_NAME = {task.name: task for task in TASKS}
SMALL = (
    "carried=true",
    "confirmation=true",
    "calibration_postures=12",
    "validation_postures=3",
    "validation_swing=5.0",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign without physics that has trials of every role."""
    out = tmp_path_factory.mktemp("robot")
    only = "twin.campaign.only=[postures, xyz, postures_validation]"
    scenario = load("short", [*(f"twin.campaign.{value}" for value in SMALL), only])
    twin.record(scenario.twin, 3, out)
    return out


@pytest.fixture(scope="module")
def run(folder):
    return Run(Row(0, "ok"), folder)


def test_robots_and_scenarios_are_the_frozen_ones():
    assert frozen.scenario_digests() == frozen.frozen_digests()
    robots = frozen.robots("full")
    assert [robot.id for robot in robots] == list(range(20))
    assert sum("unmodelled" in robot.scenario for robot in robots) == 5
    assert {"dead_zone", "friction_held"} <= {robot.scenario for robot in frozen.robots("quick")}
    assert [len(robot.marks) for robot in robots] == 4 * [20] + 16 * [1]


@pytest.mark.parametrize("part", [slice(4), pytest.param(slice(4, 20), marks=pytest.mark.slow)])
def test_truths_are_the_frozen_ones(part):
    assert [r.id for r in frozen.robots("full")[part] if frozen.truth_digest(r) != r.truth] == []


def test_a_changed_truth_is_seen_and_rounding_is_not():
    one = [Parameter("gear.arm_1_joint.offset", "rad", 0.004), Parameter("floor.rx", "rad", -0.0)]
    same = [Parameter("floor.rx", "rad", 0.0), Parameter("gear.arm_1_joint.offset", "rad", 0.004 * (1.0 + 1e-12))]
    other = [one[1], Parameter("gear.arm_1_joint.offset", "rad", 0.004001)]
    assert frozen.digest(one) == frozen.digest(same) != frozen.digest(other)


def test_recordings_beyond_the_tolerance_are_named(run):
    robot = frozen.Robot(0, "dead_zone", "", frozen.marks(run.dataset))
    assert list(frozen.differences(robot, run.dataset)) == []
    x, *rest = robot.marks["xyz"]
    moved = replace(robot, marks=robot.marks | {"xyz": (x + 2.0 * frozen.TOLERANCE, *rest)})
    assert ["robot_00, xyz: marks differ" in line for line in frozen.differences(moved, run.dataset)] == [True]
    more = replace(robot, marks=robot.marks | {"around_y": (x, *rest)})
    assert ["robot_00: no trials around_y" in line for line in frozen.differences(more, run.dataset)] == [True]


def test_a_recording_made_here_is_the_frozen_one(tmp_path):
    """Two trials of robot 0 on whatever machine this is: without the others before them, they differ by 5e-6."""
    robot = frozen.robots("quick")[0]
    series = robot.series()
    alone = replace(series.twin.campaign, only=("around_x", "around_z"), confirmation=False)
    twin.record(replace(series.twin, campaign=alone), seed_of(series.seed, robot.id), tmp_path)
    two = replace(robot, marks={trial: robot.marks[trial] for trial in alone.only})
    assert list(frozen.differences(two, calibration.load(tmp_path / "dataset"))) == []


@pytest.mark.parametrize("name", ["drive", "all"])
def test_a_blind_dataset_shows_no_hand_and_no_truth_in_held_out_trials(run, tmp_path, name):
    task = BY_NAME[name]
    write_blind(run.dataset, task, tmp_path / "blind")
    found = calibration.load(tmp_path / "blind")
    hidden, shown = found.trial("xyz"), found.trial("postures")
    base = hidden.markers_of("base")
    later = hidden.t_mocap > hidden.t_mocap[0] + 1.0
    seen = np.isfinite(hidden.marker_position).all(axis=2)
    assert not np.delete(seen, base, axis=1).any()
    assert seen[~later][:, base].any() and seen[later][:, base].any() == task.base
    assert np.isnan(hidden.q_link).all() and np.isfinite(hidden.q_motor).all()
    np.testing.assert_array_equal(shown.marker_position, run.trial("postures").marker_position)
    names = {e.id for e in found.description.trials}
    assert ("registration_confirmation" in names) == task.sessions
    if task.sessions:
        assert np.isfinite(found.trial("registration_confirmation").marker_position).any()
    written = {p.relative_to(tmp_path / "blind").parts[0] for p in (tmp_path / "blind").rglob("*") if p.is_file()}
    assert written == {"dataset.json", "nominal.urdf", "trials"}
    assert "seed" not in (tmp_path / "blind" / "dataset.json").read_text()


def entry(folder, poses, **about):
    """An entry with poses of robot 0 in each task."""
    for task in TASKS:
        (folder / task.name).mkdir(parents=True)
        write_submission(folder / task.name / "robot_00.nc", poses(task))
    (folder / "entry.json").write_text(json.dumps({"name": "mine", "truth_not_used": True} | about))
    return folder


def true_poses(run, task, shift=0.0):
    """True poses of the hand in every held-out trial, moved along x [m]."""
    found = {}
    for held in task.of(run.dataset).description.trials:
        if held.role == "validation" or (held.role == "confirmation" and held.motion != "registration"):
            true = read_trial(run.folder / "truth" / held.file)
            T = true.hand_pose.copy()
            T[:, 0, 3] += shift
            found[held.id] = true.t_mocap, T
    return found


def test_entries_are_scored_against_the_truth_and_tabulated(run, tmp_path, monkeypatch):
    robot = frozen.Robot(0, "dead_zone", "", {})
    monkeypatch.setattr(scoring, "runs", lambda tier, bench: [(robot, run)])
    monkeypatch.setattr(scoring, "TASKS", (BY_NAME["geometry"], BY_NAME["drive"], BY_NAME["all"]))
    mine = entry(tmp_path / "mine", lambda task: true_poses(run, task, 6e-3))
    (mine / "drive" / "robot_00.nc").unlink()
    warnings = scoring.score([mine], tmp_path, tmp_path / "out", "quick", lambda *at: None)
    missing, *doubts = sorted(warnings, reverse=True)
    assert missing == "mine: nothing for drive, robot_00"
    assert len(doubts) == 2 and all("a constant offset (6.0, 0.0, 0.0) mm in the axes of the lab" in d for d in doubts)
    figures = json.loads((tmp_path / "out" / "scores.json").read_text())["figures"]
    found = {(f["task"], f["model"]): f["mm"] for f in figures}
    assert [found["all", ""], found["geometry", ""]] == pytest.approx(2 * [6.0 / np.sqrt(3.0)], rel=1e-6)
    assert found["all", "nominal"] > 6.0
    again = [f["again_mm"] for f in figures if f["entry"] == "mine" and f["task"] == "all"]
    assert again == [pytest.approx(6.0 / np.sqrt(3.0), rel=0.2)], "the second session counts, against the markers"
    text = (tmp_path / "out" / "scores.md").read_text()
    assert "| mine | 3.46 | - | 3.46 |" in text
    assert text.index("| nominal |") < text.index("| mine |"), "the best of `all` is last"


def test_a_urdf_with_zeros_is_scored_against_the_truth(run, tmp_path, monkeypatch):
    """It has no covariance and no marker frames: no interval, frames registered."""
    robot = frozen.Robot(0, "dead_zone", "", {})
    monkeypatch.setattr(scoring, "runs", lambda tier, bench: [(robot, run)])
    monkeypatch.setattr(scoring, "TASKS", (BY_NAME["geometry"], BY_NAME["all"]))
    mine = entry(tmp_path / "mine", lambda task: true_poses(run, task))
    for task in ("geometry", "all"):
        (mine / task / "robot_00.nc").unlink()
    (mine / "geometry" / "robot_00.urdf").write_text(run.dataset.urdf)
    zeros = {p.name: p.value for p in read_parameters(run.folder / "truth" / "truth.json")}
    lines = [f"arm_{k}_joint,{zeros[f'encoder.arm_{k}_joint.motor.offset']!r}" for k in range(1, 8)]
    (mine / "geometry" / "robot_00.zeros.csv").write_text("\n".join(["joint,offset", *lines, ""]))
    assert scoring.score([mine], tmp_path, tmp_path / "out", "quick", lambda *at: None) == (
        "mine: nothing for all, robot_00",
    )
    figures = json.loads((tmp_path / "out" / "scores.json").read_text())["figures"]
    found = {f["entry"]: f for f in figures if f["model"] in ("", "nominal")}
    assert (found["mine"]["zeros_mrad"], found["mine"]["covered"]) == (pytest.approx(0.0, abs=1e-9), None)
    assert 0.0 < found["mine"]["mm"] < 0.7 * found[""]["mm"]


def test_a_rejected_file_costs_its_robot_only_and_is_named(run, tmp_path, monkeypatch):
    robot = frozen.Robot(0, "dead_zone", "", {})
    monkeypatch.setattr(scoring, "runs", lambda tier, bench: [(robot, run)])
    monkeypatch.setattr(scoring, "TASKS", TASKS[:1])
    mine = entry(tmp_path / "mine", lambda task: true_poses(run, task))
    (mine / "geometry" / "robot_00.nc").write_bytes(b"no netCDF")
    warnings = scoring.score([mine], tmp_path, tmp_path / "out", "quick", lambda *at: None)
    assert len(warnings) == 1 and "mine, geometry, robot_00: rejected" in warnings[0]


@pytest.mark.parametrize("about", [{"truth_not_used": False}, {"name": ""}])
def test_an_entry_must_declare_its_name_and_that_it_did_not_use_the_truth(tmp_path, about):
    (tmp_path / "entry.json").write_text(json.dumps({"name": "mine", "truth_not_used": True} | about))
    with pytest.raises(ScenarioError, match="truth_not_used"):
        scoring.open_entry(tmp_path)


@pytest.mark.slow
def test_a_robot_made_here_is_the_frozen_one(tmp_path, monkeypatch):
    monkeypatch.setitem(frozen.TIERS, "quick", 1)
    assert make("quick", tmp_path, Workers(), lambda at, share: None) == ()
    assert [robot.id for robot, _ in runs("quick", tmp_path)] == [0]
    assert len(list((tmp_path / "data").glob("*/robot_00/dataset.json"))) == len(TASKS)
    assert not any("truth" in path.name for path in (tmp_path / "data").rglob("*"))
