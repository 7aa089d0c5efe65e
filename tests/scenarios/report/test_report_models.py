"""The report's section on the paper's models, from a small run whose suspension and joint models are known."""

import json
import re
import shutil
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import mjcf
from calibration import Estimate, Evaluation, load, load_estimate, save_estimate
from calibration.evaluation.ladder import TrialErrors, ladder
from calibration.evaluation.pose_errors import PoseErrors
from calibration.inference.parameters import Combination, Model, Parameter
from calibration.prediction import predict
from calibration.recording.clock import Clock
from calibration.stages.joints.correction import input_model
from calibration.stages.joints.repetitions import Regime as CalibratedRegime
from calibration.stages.joints.stage import joints_model
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.model import Suspension
from calibration.verdict import Verdict
from scenarios.report import write
from scenarios.report.results import suspension
from scenarios.report.results.formatting import error, fixed
from scenarios.report.results.result_files import Regime
from scenarios.report.results.run_results import read
from scenarios.report.sections import base_motion
from scenarios.report.sections import joints as loops
from scenarios.report.sections import payload as loads
from tests.calibration.stages.suspension.test_suspension_fit import C, K, record
from tests.doubles import joint_data, rigid_robot
from tests.doubles.moving_base import WHEELS
from tests.doubles.rigid_robot import with_values

MOVES = np.array([False, False, True, True, True, False])
CLOCKS = tuple(Clock(i, 0.0, 0.0, np.zeros((2, 2)), 0.0, 1e-4) for i in ("robot", "plate"))
JOINT, PLAIN = "arm_2_joint", "arm_3_joint"
REFUSED = "printed form refused: it drifts"
REGIMES = [
    {"joint": j, "regime": r, "discrepancy_before_mrad": 2.0, "discrepancy_after_mrad": 2.0 * (1 - c / 100)}
    | {"cut_percent": c, "r2": 0.5, "n": 10, "outside_percent": 3.2}
    for j, r, c in (
        (JOINT, "repetition", 85.0),
        (JOINT, "unseen_motion", 40.0),
        (JOINT, "static", -12.0),
        (PLAIN, "repetition", 91.0),
        (PLAIN, "static", 0.0),
    )
]


def known_joint() -> list:
    """One joint with a model, one without a correction, as the estimate has them."""
    model = joint_data.truth(JOINT, "total", 1, 50.0, 3)
    none = replace(model, joint=PLAIN, degree=None, powers=(), A=np.zeros(0), B=np.zeros(0))
    return [model, none]


def known_suspension() -> Suspension:
    motion = np.tile([4.0, 4.0, 4.0, 9.0, 9.0, 9.0], (3, 1)) * 1e-6
    held_out = HeldOut(np.where(MOVES, 0.05, 1.1) * motion, motion, 1e-12 + 0.0 * motion, np.full(3, 900.0))
    zero = np.zeros((6, 6))
    return Suspension("compliance", K, C, zero, zero, (("plate", held_out),), (), ())


def known_estimate(**changes) -> Estimate:
    found = known_suspension()
    elements = tuple(
        Parameter(f"suspension.K.{i + 1}{i + 1}", "N/m", 0.0, K[i, i], 0.01 * K[i, i], s)
        for i, s in ((3, "estimated"), (5, "not_identifiable"))
    )
    combined = Combination("suspension.wheel_left.kz", np.array([1.0, 0.5]), 1.5e5, 2e3)
    model_1 = Model("model_1", elements, (combined,), np.diag([1.0, 1.0]))
    geometry = Model("model_2", ())
    models = (model_1, geometry, joints_model(geometry, tuple(known_joint())))
    said = (Verdict("suspension", "warning", REFUSED), Verdict("suspension", "ok", "from plate, left-out trials: R2"))
    whole = Estimate("calibrated", said, CLOCKS, models, "model_2", mjcf.urdf(), None, found, tuple(known_joint()))
    return replace(whole, **({"link_zero": tuple(joint_data.ZERO)} | changes))


def linked(trial):
    """The trial with link readings that the known joint models make of its motor readings."""
    inputs = input_model(joint_data.LAB, with_values(joint_data.hand(), offset=np.zeros(8)))
    asked, y = inputs.inputs(trial.t_robot, trial.q_motor), np.zeros_like(trial.q_motor)
    j, model = rigid_robot.JOINTS.index(JOINT), known_joint()[0]
    y[:, j] = model.discrepancy(asked.theta[:, j], asked.tau[:, j], asked.velocity[:, j])
    y[:, j + 1] = 1e-3
    return replace(trial, q_link=trial.q_motor - joint_data.ZERO - y)


def small_errors(n=50):
    rng = np.random.default_rng(0)
    return PoseErrors(1e-3 * rng.normal(size=(n, 3)), 1e-3 * rng.normal(size=(n, 3)))


def write_dataset(folder, trials, **changes):
    both = [{"name": j, "encoders": ["motor", "link"], "rate": 100.0} for j in rigid_robot.JOINTS]
    changes = {"joints": both} | changes
    rigid_robot.write(folder, trials, wheels=[w.model_dump() for w in WHEELS], **changes)


def write_predictions(run):
    shutil.rmtree(run / "predictions", ignore_errors=True)
    (run / "predictions").mkdir()
    for trial in predict(load_estimate(run / "estimate"), load(run / "dataset")):
        trial.save(run / "predictions")


@pytest.fixture(scope="module")
def recording():
    trial, x = record("xyz", [2, 3], np.random.default_rng(5))
    return linked(trial), x


@pytest.fixture(scope="module")
def whole(tmp_path_factory, recording):
    run = tmp_path_factory.mktemp("run") / "small"
    write_dataset(run / "dataset", [("xyz", "validation", "swing", recording[0])])
    save_estimate(known_estimate(), run / "estimate")
    write_predictions(run)
    rows = [
        TrialErrors("model_2", b, "motor", "xyz", "swing", np.arange(50.0), *2 * [small_errors()])
        for b in ("fixed", "plate")
    ]
    Evaluation(tuple(ladder(rows, "mocap")), tuple(rows)).save(run)
    change(run, regimes=REGIMES)
    (run / "truth").mkdir()
    (run / "truth/truth.json").write_text(json.dumps({"derived": {"K": (0.8 * K).tolist()}, "parameters": []}))
    write(run)
    return run


@pytest.fixture
def run(whole, tmp_path, undrawn):
    return shutil.copytree(whole, tmp_path / "run")


def change(run, **fields):
    content = json.loads((run / "evaluation.json").read_text())
    (run / "evaluation.json").write_text(json.dumps(content | fields))


def text_of(run):
    page = re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", (run / "report.html").read_text(), flags=re.DOTALL)
    return re.sub(r"\s+", " ", page)


def row_of(run, table, head):
    """Cells of the row that begins with `head` in the table whose caption holds `table`."""
    tables = (run / "report.html").read_text().split("<table>")[1:]
    body = next(t for t in tables if table in re.sub(r"<[^>]+>", "", t.split("</caption>")[0])).split("<tbody>")[1]
    for row in body.split("</tr>"):
        cells = [plain(cell) for cell in re.findall(r"<t[hd].*?</t[hd]>", row, re.DOTALL)]
        if cells[:1] == [head]:
            return cells[1:]
    raise AssertionError(f"no row {head!r}")


def plain(html):
    return re.sub(r"[ \n]+", " ", re.sub(r"<[^>]+>", "", html)).strip()


def test_the_base_s_measured_motion_is_its_motion(whole, recording):
    found, why = base_motion.trial_motion(read(whole))
    assert (why, found.trial, len(found.predicted)) == ("", "xyz", 1)
    t = np.arange(len(recording[1])) / 100.0
    x = 1e3 * np.stack([np.interp(found.t, t, column) for column in recording[1].T], axis=1)
    error = np.sqrt(((found.measured - x) ** 2).mean(axis=0))
    assert (error < 0.1 * np.sqrt((x**2).mean(axis=0)) + 2e-3).all(), "apart from what is faster than 10 Hz"


def test_the_true_springs_predict_the_axes_that_are_moved(whole):
    found, _ = base_motion.trial_motion(read(whole))
    p = found.predicted[0]
    rows = (found.t > 1.0) & np.isfinite(found.measured).all(axis=1)
    error, motion = ((a[rows] ** 2).sum(axis=0) for a in (found.measured - p.x, found.measured))
    np.testing.assert_allclose(p.r2, 1.0 - error / motion)
    middle = rows & (found.t > 0.25 * found.t[-1]) & (found.t < 0.75 * found.t[-1])
    error, motion = ((a[middle] ** 2).sum(axis=0) for a in (found.measured - p.x, found.measured))
    np.testing.assert_allclose(p.r2_middle, 1.0 - error / motion)
    assert p.r2[3:5].min() > 0.98
    np.testing.assert_allclose(p.r2[~MOVES], 0.0, atol=1e-9)
    roll = row_of(whole, "The same trial in figures", "roll [mrad]")
    assert roll[2] == fixed(np.nanstd(found.measured[found.t <= 1.0, 3]), 2), "noise, by the first second"
    assert roll[3:5] == [fixed(p.r2[3], 2), fixed(p.r2_middle[3], 2)]
    assert row_of(whole, "The same trial in figures", "yaw [mrad]")[3] == "not predicted"
    assert row_of(whole, "The same trial in figures", "yaw [mrad]")[0] == fixed(np.ptp(found.measured[rows, 5]), 2)


def test_the_base_is_judged_by_the_truth_where_there_is_one(run):
    rows = json.loads((run / "evaluation.json").read_text())["rows"]
    base = [
        {"source": s, "n": 900, "roll_r2": r, "pitch_r2": 0.9821} for s, r in (("plate", 0.9996), ("dynamics", 0.9))
    ]
    (run / "score.json").write_text(json.dumps({"schema": 1, "rows": rows, "base": base}))
    write(run)
    said = "noise: from plate R2 of roll 1.000, of pitch 0.982; from dynamics R2 of roll 0.900, of pitch 0.982."
    assert said in text_of(run)


@pytest.mark.parametrize(("rho", "shown"), [(50.0, "50.0"), (2.0, "≤ 2.00"), (1000.0, "≥ 1000")])
def test_a_rho_at_its_limit_is_reported_as_a_limit(run, rho, shown):
    model, none = known_joint()
    shutil.rmtree(run / "estimate")
    save_estimate(known_estimate(joint_models=(replace(model, rho=rho), none)), run / "estimate")
    write(run)
    assert row_of(run, "The published joint model", JOINT)[1].replace("\u202f", "") == shown
    assert row_of(run, "The published joint model", PLAIN)[1] == "–"


def test_yaw_is_reported_with_what_stays(whole):
    found, _ = base_motion.trial_motion(read(whole))
    left = np.sqrt(((found.measured - found.predicted[0].x)[found.scored, 5] ** 2).mean())
    assert f"it is not predicted here, residual {fixed(left, 1)} mrad rms" in text_of(whole)
    assert "cross-validated over the calibration trials its R2 is −0.10" in text_of(whole)


def test_stiffness_stands_beside_the_truth(whole):
    cells = row_of(whole, "Stiffness K of the base, identified and true", "roll, roll")
    assert cells == [
        "N.m/rad",
        fixed(K[3, 3], 0),
        fixed(0.01 * K[3, 3], 0),
        fixed(0.8 * K[3, 3], 0),
        "25 %",
        "estimated",
    ]
    assert row_of(whole, "Stiffness K", "yaw, yaw")[-1] == "not identifiable"
    assert row_of(whole, "Stiffness K", "yaw, yaw")[-2] == "–", "how far off a number is that is of no spring"
    found = {e.axes: e for e in suspension.elements(read(whole), "K")}
    assert found["z, z"].unit == "N/m"
    assert "x, z" not in found, "zero in both"


def test_damping_stands_beside_the_truth_even_where_nothing_gives(run):
    true = {
        letter: [[None if i == j == 2 else float(v) for j, v in enumerate(row)] for i, row in enumerate(matrix)]
        for letter, matrix in (("K", 0.8 * K), ("C", 0.5 * C))
    }
    (run / "truth/truth.json").write_text(json.dumps({"derived": true, "parameters": []}))
    write(run)
    table = "Damping C of the base, identified and true"
    assert row_of(run, table, "roll, roll")[:4] == ["N.m.s/rad", fixed(C[3, 3], 0), "–", fixed(0.5 * C[3, 3], 0)]
    assert [row_of(run, of, "z, z")[3] for of in (table, "Stiffness K")] == ["–", "–"]


def test_wheels_are_reported_as_combinations_with_the_rank_of_one_wrench(whole):
    text = text_of(whole)
    assert "36 stiffnesses leave 14 combinations" in text
    assert "36 stiffnesses leave 11 combinations" in text
    assert row_of(whole, "Identifiable combinations of the wheels", "suspension.wheel_left.kz + 1") == [
        "150\u202f000",
        "2\u202f000",
    ]
    assert REFUSED in text


def test_loops_hold_what_the_encoders_said_and_the_model_says(whole, recording):
    found, why = loops.loops(read(whole))
    first, second = (next(x for x in found if x.joint == j) for j in (JOINT, PLAIN))
    assert why == ""
    assert len(found) == 2
    np.testing.assert_allclose(first.model, first.measured, atol=2e-2)
    assert first.before > 1.0
    assert np.abs(first.velocity).min() > 0.02
    forth, back = first.flanks
    assert len(forth.position) + len(back.position) == len(first.theta)
    assert forth.measured.mean() > back.measured.mean(), "forth is the upper flank of this model"
    assert not second.corrected
    assert second.flanks[0].model is None
    np.testing.assert_allclose(second.measured, 1.0, atol=1e-3)
    assert f"arm_2: {error(first.before)} → {error(first.after)} mrad" in (whole / "figures/loops.svg").read_text()
    assert "arm_3: 1.00 mrad, not corrected" in (whole / "figures/loops.svg").read_text()


def test_regimes_are_reported_joint_by_joint_and_in_sentences(whole):
    assert row_of(whole, "regime by regime", JOINT) == ["2.00", "0.30", "85", "0.50", "10", "3"]
    assert row_of(whole, "regime by regime", PLAIN) == ["2.00", "0.18", "91", "0.50", "10", "3"]
    text = text_of(whole)
    assert "other repetitions: the rms falls by 10 % or more in 2 of 2 joints (by 85 to 91 %)." in text
    assert "Other motions, held out: the rms falls by 10 % or more in 1 of 1 joints (by 40 %)." in text
    assert "held out: the rms falls by 10 % or more in 0 of 2 joints, grows in arm_2, is unchanged in arm_3." in text
    assert 'class="missed">−12<' in (whole / "report.html").read_text()


def test_regimes_have_our_order_and_unknown_ones_come_last():
    found = loops.by_regime(tuple(Regime(**REGIMES[0] | {"regime": r}) for r in ("other", *reversed(loops.REGIMES))))
    assert [r.meaning for r in found] == [*loops.REGIMES.values(), "other"]
    assert {r for r in get_args(CalibratedRegime)} == set(loops.REGIMES)


def test_trials_are_apart_where_payload_or_push_differ(run, recording):
    shutil.rmtree(run / "dataset")
    names = ("xyz", "xyz_2kg", "push")
    payload = {"link": "arm_7_link", "mass": 0.437, "com": (0.0, 0.0, 0.1), "tolerance": 0.02}
    write_dataset(run / "dataset", [(n, "validation", "swing", recording[0]) for n in names], payload=payload)
    content = json.loads((run / "dataset/dataset.json").read_text())
    content["trials"][1]["payload"] = 2.0
    (run / "dataset/dataset.json").write_text(json.dumps(content))
    write_predictions(run)
    errors = [
        {"trial": n, "model": "model_2", "base": b, "encoder": "motor", "n": 5}
        | {"position_rmse_component_mm": mm, "orientation_rmse_deg": 0.5}
        for n, b, mm in (
            ("xyz", "plate", 1.25),
            ("xyz_2kg", "plate", 2.5),
            ("push", "plate", 3.75),
            ("xyz", "fixed", 4.0),
        )
    ]
    change(run, trials=errors)
    write(run)
    trials = loads.loaded_trials(read(run))
    assert [(t.payload, t.pushed) for t in trials] == [(0.437, False), (2.0, False), (0.437, True)]
    one, _ = loops.loops(read(run))
    assert np.diff(one[0].t).min() > 0.0, "only the trial of the campaign's own load is drawn"
    assert row_of(run, "Trial by trial", "model_2, plate")[::2] == ["1.25", "2.50", "3.75"]
    assert row_of(run, "Trial by trial", "model_2, fixed")[::2] == ["4.00", "–", "–"]
    assert "2.00 kg" in text_of(run)
    assert "0.437 kg, pushed" in text_of(run)


def test_trials_of_one_load_need_no_table(whole):
    assert "Payload and push" not in text_of(whole)


def test_diagrams_and_figures_can_be_read_without_seeing(whole):
    page = (whole / "report.html").read_text()
    for name in ("wheels", "trial_motion", "joint", "loops"):
        label = page.split(f'<g id="{name}-figure_1">')[0].rpartition('<div role="img" aria-label="')[2]
        assert len(label.split('"')[0]) > 60, name
        assert (whole / f"figures/{name}.svg").is_file()


@pytest.mark.parametrize("gone", ["dataset", "estimate"])
def test_without_dataset_or_estimate_the_page_says_so(run, gone):
    shutil.rmtree(run / gone)
    write(run)
    text = text_of(run)
    base, joints = {
        "dataset": 2 * ("the dataset is not in the run folder",),
        "estimate": ("no suspension was identified", "no joint model was identified"),
    }[gone]
    assert f"The base's motion is not drawn: {base}." in text
    assert f"The joints' hysteresis is not drawn: {joints}." in text
    assert not (run / "figures/trial_motion.svg").exists()
    assert not (run / "figures/loops.svg").exists()


def test_without_plate_or_link_encoders_the_page_says_so(run, recording):
    shutil.rmtree(run / "dataset")
    joints = [{"name": j, "encoders": ["motor"], "rate": 100.0} for j in rigid_robot.JOINTS]
    trial = rigid_robot.without_plate(recording[0])
    write_dataset(run / "dataset", [("xyz", "validation", "swing", trial)], joints=joints, plates=[])
    write_predictions(run)
    write(run)
    assert "The joints' hysteresis is not drawn: no joint has a link-side encoder." in text_of(run)
    assert (
        "The base's motion is not drawn: trial xyz has no wrench of a source the suspension was tried with."
        in text_of(run)
    )


def test_without_a_truth_nothing_is_called_true(run):
    shutil.rmtree(run / "truth")
    write(run)
    assert row_of(run, "Stiffness K of the base, identified", "roll, roll")[-1] == "estimated"
    assert "identified and true" not in text_of(run)
