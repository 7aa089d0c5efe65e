"""What holds for robots of the series and not for one: slow, run by `make slow`."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import calibration
import mjcf
import twin
from calibration.evaluation.comparison import comparisons
from calibration.evaluation.ladder import scored_errors
from calibration.evaluation.pose_errors import pose_errors
from calibration.prediction.predictor import Predictor
from calibration.recording.clock import Clock
from calibration.recording.schema import TrialEntry
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.nominal_frames import nominal_frames
from scenarios import load
from scenarios.score.score import score
from twin.campaign import describe_dataset, laboratory, measure
from twin.motions import schedule
from twin.simulation import simulate

pytestmark = pytest.mark.slow
SEEDS = range(1000, 1010)
PAPER_MM, PAPER_DEG = 13.3, 8.57


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folder and estimate of ten robots nobody has looked at."""
    scenario, found = load("humanoids2024"), []
    for seed in SEEDS:
        folder = tmp_path_factory.mktemp(f"seed{seed}")
        twin.record(scenario.twin, seed, folder)
        found.append((folder, calibration.calibrate(calibration.load(folder / "dataset"))))
    return found


@pytest.fixture(scope="module")
def evaluations(runs):
    return [calibration.evaluate(estimate, calibration.load(folder / "dataset")) for folder, estimate in runs]


@pytest.fixture(scope="module")
def ladders(runs, evaluations):
    """Their dynamic rows against the truth, by model, base and encoder."""
    found = []
    for seed, (folder, estimate), evaluation in zip(SEEDS, runs, evaluations, strict=True):
        judged = score(estimate, evaluation, folder / "truth")
        rows = {(r.model, r.base, r.encoder): r.metrics for r in judged.rows if r.trials == "dynamic"}
        found.append(rows)
        print(seed, *(f"{'/'.join(k)} {x.position_rmse_component_mm:.2f}" for k, x in rows.items()))
    return found


def mm(rows, model, base="plate", encoder="motor") -> float:
    return rows[model, base, encoder].position_rmse_component_mm


def holds(ladders, condition) -> int:
    return sum(bool(condition(rows)) for rows in ladders)


def test_registration_is_better_than_nominal(ladders):
    assert holds(ladders, lambda r: mm(r, "registration", "fixed") < mm(r, "nominal", "fixed")) >= 9


def test_geometry_reaches_its_figures_with_the_base_measured(ladders):
    def reached(rows):
        m = rows["model_2", "measured", "motor"]
        return m.position_rmse_component_mm <= 2.5 and m.position_rmse_norm_mm <= 4.3 and m.orientation_rmse_deg <= 1.2

    assert holds(ladders, reached) >= 9


@pytest.mark.parametrize("base", ["plate", "dynamics"])
def test_the_papers_models_keep_their_order(ladders, base):
    def kept(rows):
        model_3 = rows["model_3", base, "motor"]
        return (
            mm(rows, "model_1", base) <= mm(rows, "nominal", "fixed")
            and mm(rows, "model_2", base) < min(mm(rows, "model_1", base), mm(rows, "registration", base))
            and mm(rows, "model_3", base) <= 1.10 * mm(rows, "model_2", base)
            and model_3.position_rmse_component_mm <= 5.7
            and model_3.orientation_rmse_deg <= 2.71
        )

    assert holds(ladders, kept) >= 9


@pytest.mark.parametrize("base", ["plate", "dynamics"])
def test_model_1_is_not_worse_than_nominal_or_it_is_said_why(evaluations, base):
    found = [next(c for c in comparisons(e.traces) if c.b == ("model_1", base)) for e in evaluations]
    print(base, *(f"{c.difference_mm:+.2f} ({c.finding})" for c in found))
    assert all(c.finding != "worse" or c.reason for c in found)
    assert sum(c.finding != "worse" for c in found) >= 9


@pytest.mark.parametrize("source", ["plate", "dynamics"])
def test_roll_and_pitch_of_the_base_are_predicted(runs, base_r2, source):
    found = [base_r2(folder, estimate, source) for folder, estimate in runs]
    print(source, *(f"{roll:.3f} {pitch:.3f}" for roll, pitch in found))
    assert sum(r2.min() >= 0.95 for r2 in found) >= 9


def test_link_encoders_beat_motor_encoders_with_the_base_measured(ladders):
    assert holds(ladders, lambda r: mm(r, "model_3", "measured", "link") < mm(r, "model_2", "measured")) >= 9


BELOW = {  # docs/limits.md
    "arm_1_joint": "no load holds arm_1's link on a side: on six robots of ten the printed model explains too little",
    "arm_5_joint": "on one robot of ten the printed model explains two thousandths less of arm_5 than is asked",
}


@pytest.mark.parametrize(
    "joint",
    [f"arm_{k}_joint" for k in (2, 3, 4, 6, 7)]
    + [pytest.param(joint, marks=pytest.mark.xfail(reason=why, strict=True)) for joint, why in BELOW.items()],
)
def test_the_printed_joint_model_explains_a_settled_repetition(evaluations, joint):
    found = [next(x for x in e.regimes if (x.joint, x.regime) == (joint, "repetition")) for e in evaluations]
    print(joint, *(f"{x.cut:.2f} {x.r2:.3f}" for x in found))
    assert all(x.cut >= 0.60 and x.r2 >= 0.85 for x in found)


def test_the_papers_nominal_error_is_one_of_the_series(capsys):
    """Placements, clusters and masses redrawn, gears and wheels within 20 %; validation swings only."""
    scenario = load("humanoids2024")
    config = replace(scenario.twin, widths=replace(scenario.twin.widths, spread=0.2))
    config = replace(config, campaign=replace(config.campaign, validation_swing=20.0))
    with ThreadPoolExecutor(2) as pool:
        found = np.array(list(pool.map(lambda seed: nominal_error(config, seed), range(1000, 1100))))
    low, high = np.percentile(found, [5.0, 95.0], axis=0)
    with capsys.disabled():
        print(f"\nnominal, 5-95 %: {low[0]:.1f}-{high[0]:.1f} mm per component, {low[1]:.2f}-{high[1]:.2f} deg")
    assert low[0] <= PAPER_MM <= high[0]
    assert low[1] <= PAPER_DEG <= high[1]


def nominal_error(config, seed: int) -> tuple[float, float]:
    """RMSE per component [mm] and of the angle [deg] of the nominal prediction, base fixed, against the truth."""
    lab, description = laboratory(config, seed), describe_dataset(config, ())
    chain = chain_of(mjcf.urdf(), description)
    clock = Clock("robot", 3.9, 1.2e-5, np.eye(2), 0.0, 1.0)
    models = {"nominal": nominal_hand(chain, nominal_frames(chain, description))}
    predict = Predictor(models, mjcf.urdf(), description, clock)
    position, rotation = [], []
    for motion in schedule(config.campaign, mjcf.spec().compile(), seed):
        if motion.role == "validation" and motion.kind == "swing":
            trial, true = measure(lab, motion, simulate(lab.twin, motion, lab.T_lab_base), 100.0)
            about = {"id": motion.id, "role": motion.role, "kind": motion.kind}
            entry = TrialEntry(**about, motion="", file="trial.nc", sha256="0" * 64)
            p = next(p for p in predict(entry, trial).rows if p.base == "fixed")
            errors = scored_errors(p.t, pose_errors(p.T_lab_hand, true.hand_pose), np.zeros((0, 2)), False).complete
            position.append(errors.position)
            rotation.append(np.linalg.norm(errors.rotation, axis=1))
    return (
        1e3 * float(np.sqrt(np.mean(np.square(np.concatenate(position))))),
        float(np.degrees(np.sqrt(np.mean(np.square(np.concatenate(rotation)))))),
    )
