"""What inverse dynamics cannot know and a plate can: slow, run by `make slow`.

Row `full`, seed 4, the short campaign. With 2 kg both back casters are off the floor at the start, and how far a drive
slides depends on a few newtons of its load: by the plate that is judged on several robots, in
`test_payload_series.py`, as whole campaigns are.
"""

import json

import pytest

from scenarios import load, run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return run(load("payload"), tmp_path_factory.mktemp("run") / "payload", quick=True).folder


@pytest.fixture(scope="module")
def trials(folder):
    found = json.loads((folder / "evaluation.json").read_text())["trials"]
    return {(t["trial"], t["model"], t["base"], t["encoder"]): t["position_rmse_component_mm"] for t in found}


def test_a_push_is_seen_by_the_plate_and_not_by_the_dynamics(trials):
    plate, dynamics = (trials["push", "model_2", base, "motor"] for base in ("plate", "dynamics"))
    assert plate < 0.7 * dynamics


def test_a_declared_payload_is_known_to_both(trials):
    for trial in ("xyz_0kg", "xyz_2kg"):
        plate, dynamics = (trials[trial, "model_2", base, "motor"] for base in ("plate", "dynamics"))
        assert dynamics < 1.25 * plate


@pytest.mark.parametrize(
    ("trial", "base"),
    [("xyz_0kg", "measured"), ("xyz_0kg", "plate"), ("xyz_2kg", "measured"), ("push", "measured"), ("push", "plate")],
)
def test_row_full_knows_what_loads_it(trials, trial, base):
    errors = {name: trials[name, "full", base, "motor"] for name in ("xyz", trial)}
    print(trial, base, errors)
    assert errors[trial] < 1.3 * errors["xyz"]


def test_a_push_is_in_the_joints_loads(trials):
    assert trials["push", "full", "measured", "motor"] < 0.3 * trials["push", "model_2", "measured", "motor"]


@pytest.mark.parametrize(("axis", "within"), [("x", 3e-4), ("y", 3e-4), ("rz", 1e-3)])
def test_spins_place_the_base_s_markers(folder, axis, within):
    """Without them by millimetres and milliradians less exactly, and only together with the first joint's placement."""
    found = {p["name"]: p for p in json.loads((folder / "score.json").read_text())["parameters"]}
    frame = found[f"frame.base.base.{axis}"]
    assert frame["status"] == "estimated" and abs(frame["estimate"] - frame["truth"]) < within
