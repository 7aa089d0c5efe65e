"""A session recorded later, from the estimate and its files alone: an arm of six axes, markers put on anew or not."""

import csv
import json

import numpy as np
import pytest

from calibration import Compensator
from calibration.numerics.lie import exp6
from scenarios.commands import main
from scenarios.steps import import_export
from scenarios.steps.process import process
from tests.doubles.six_axis_arm import ARM, SHAPE, MeasuredPostures, measured, write_markers

FIRST, LATER = 40, 16
REMOUNTED = exp6(np.array([[3e-3, -2e-3, 1e-3, 4e-3, -6e-3, 5e-3], [-2e-3, 2e-3, 3e-3, 9e-3, 5e-3, -8e-3]]))


def rows(found, some, base=None, hand=None):
    """Some postures, the measuring frame and the hand's marker body moved by (4, 4)."""
    T = (np.eye(4) if base is None else base) @ found.T[some] @ (np.eye(4) if hand is None else hand)
    noise = found.p[some] - (np.einsum("nij,mj->nmi", found.T[some][:, :3, :3], SHAPE) + found.T[some][:, None, :3, 3])
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], SHAPE) + T[:, None, :3, 3] + noise
    return MeasuredPostures(found.q[some], T, p)


@pytest.fixture(scope="module")
def days(tmp_path_factory):
    """The first day processed, and files of two other days."""
    folder, found = tmp_path_factory.mktemp("days"), measured(4, FIRST + LATER)
    write_markers(folder / "first.csv", rows(found, slice(FIRST)))
    write_markers(folder / "same.csv", rows(found, slice(FIRST, None)))
    write_markers(folder / "remounted.csv", rows(found, slice(FIRST, None), *REMOUNTED))
    import_export.init_mapping([folder / "first.csv"], folder / "lab.yaml", ARM)
    process(folder / "lab.yaml", folder / "lab")
    return folder


def predicted(days, day, *options):
    """Error [mm] of `full`, and exit code, of a later day's file by the first day's mapping and estimate."""
    out = days / f"out_{day}_{len(options)}"
    words = ["predict", days / "lab/estimate", days / f"{day}.csv", "--map", days / "lab.yaml", "--out", out, *options]
    with pytest.raises(SystemExit) as exit:
        main.main(list(map(str, words)))
    found = json.loads((out / "evaluation.json").read_text())["rows"] if exit.value.code in (0, None) else []
    return {r["model"]: r["position_rmse_norm_mm"] for r in found}.get("full"), exit.value.code, out


def test_a_later_day_is_predicted_from_the_estimate_alone(days, undrawn):
    error, _, out = predicted(days, "same")
    assert error < 0.25 and (out / "report.html").is_file()
    with (out / "predicted.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == LATER and {row["trial"] for row in table} == {"same"}
    norm = sum(float(table[0][name]) ** 2 for name in ("qw", "qx", "qy", "qz"))
    assert norm == pytest.approx(1.0) and 0.0 < float(table[0]["sigma_position"]) < 1e-3


def test_a_fit_without_a_trial_kept_aside_has_a_report(days):
    page = (days / "lab/report.html").read_text()
    assert "hand error at left-out postures" in page and ">calibrated<" in page
    with pytest.raises(SystemExit) as exit:
        main.main(["report", str(days / "lab/estimate")])
    assert exit.value.code in (0, None) and (days / "lab/estimate/report.html").is_file()


def test_markers_put_back_are_registered_with_a_few_postures(days, undrawn, capsys):
    assert predicted(days, "remounted")[0] > 2.0
    capsys.readouterr()
    error, _, out = predicted(days, "remounted", "--register", "6")
    assert error < 0.4
    shown = capsys.readouterr().out
    assert "from where the first day has them, 0% in its band" in shown and "do not register" not in shown
    again, before = (Compensator.load(f / "estimate") for f in (out, days / "lab"))
    np.testing.assert_array_equal(again.hand.chain.xi, before.hand.chain.xi)
    assert np.abs(again.hand.base - before.hand.base).max() > 1e-3


def test_markers_that_stayed_need_no_registration(days, undrawn, capsys):
    predicted(days, "same", "--register", "6")
    assert "if they were not touched, do not register them" in capsys.readouterr().out


def test_more_postures_than_there_are_and_another_robot_are_refused(days, capsys):
    assert predicted(days, "same", "--register", str(LATER))[1] == 1
    assert f"{LATER} are there" in capsys.readouterr().err
    text = (days / "lab.yaml").read_text()
    (days / "other.yaml").write_text(text.replace("joint_5, joint_6]", "joint_6, joint_5]", 1))
    with pytest.raises(SystemExit) as exit:
        words = ["predict", days / "lab/estimate", days / "same.csv", "--map", days / "other.yaml", "--out", days / "x"]
        main.main(list(map(str, words)))
    assert exit.value.code == 2 and "setup.joint_names" in capsys.readouterr().err
