"""Public recordings of a real robot beside the checkout: one documented command each, then calibrate."""

from pathlib import Path

import pytest

from calibration import calibrate, load
from scenarios import exchange

ROOT = Path(__file__).parents[3]
REAL = ROOT.parent / "shared/data/real"


def imported(tmp_path, file: str, mapping: str) -> tuple[Path, tuple[str, ...]]:
    if not (REAL / file).is_file():
        pytest.skip(f"{file} is not beside the checkout")
    notes = exchange.import_files("csv", [REAL / file], ROOT / "docs/mappings" / mapping, tmp_path / "dataset")
    return tmp_path / "dataset", notes


def test_static_postures_are_calibrated_and_say_what_is_missing(tmp_path):
    folder, _ = imported(tmp_path, "qualisys_2021-11-30_postures.csv", "qualisys_postures.yaml")
    estimate = calibrate(load(folder))
    said = {v.stage: v for v in estimate.verdicts}
    assert estimate.calibrated and estimate.main == "full"
    assert "37 postures" in said["registration"].message
    assert (said["suspension"].verdict, said["joints"].verdict) == ("missing", "missing")


def test_base_and_plate_give_a_suspension_and_say_what_is_missing(tmp_path):
    folder, notes = imported(tmp_path, "vicon_forceplate_2023-09-20.csv", "vicon_forceplate.yaml")
    assert "action, lab axes, about the surface centre, moments in N.m, confirmed by its CoP" in notes[0]
    estimate = calibrate(load(folder))
    said = {(v.stage, v.verdict) for v in estimate.verdicts}
    assert {("registration", "missing"), ("geometry", "missing"), ("joints", "missing")} <= said
    assert estimate.calibrated and estimate.main == "model_1" and estimate.suspension is not None
    # the tilt of a TIAGo on its tyres, from the same log by other methods: 1.9e4 to 2.9e4 N.m/rad and above
    assert all(1e4 < estimate.suspension.K[i, i] < 1e5 for i in (3, 4))
    assert estimate.suspension.moves("plate")[3:5].all()
    assert not any(p.name.startswith("clock") for p in estimate.model("model_1").parameters)
