"""Recordings as arrays for other people's programs: the examples of docs/python.md, each scored by `evaluate`."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from calibration import evaluate, load
from calibration.errors import InputError
from calibration.evaluation import read_submission
from calibration.numerics.lie import inverse

EXAMPLES = Path(__file__).parents[3] / "examples" / "from_arrays"


@pytest.fixture(scope="module")
def recordings(folder):
    return load(folder)


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("name", "share"),
    [
        pytest.param("constant_offset", 0.95, marks=pytest.mark.slow),
        pytest.param("least_squares", 0.5, marks=pytest.mark.slow),
        ("residual_model", 0.95),
    ],
)
def test_an_example_predicts_better_than_the_datasheet(folder, recordings, tmp_path, name, share):
    if name == "residual_model":
        pytest.importorskip("sklearn")
    example(name).predict(folder, tmp_path / f"{name}.nc")
    found = evaluate(read_submission(tmp_path / f"{name}.nc"), recordings)
    mine, nominal = (
        found.row(model, "dynamic", base).metrics.position_rmse_norm_mm
        for model, base in ((name, "submitted"), ("nominal", "measured"))
    )
    assert mine < share * nominal


def test_an_example_has_about_twenty_lines():
    for path in EXAMPLES.glob("*.py"):
        lines = path.read_text().partition("def predict")[2].partition("if __name__")[0].splitlines()
        assert len([line for line in lines if line.strip()]) <= 24, path.name


def test_postures_are_readings_and_poses_that_the_true_robot_explains(recordings, truth, estimate):
    seen = recordings.postures()
    n = len(seen)
    assert (seen.q.shape, seen.T_base_hand.shape, seen.covariance.shape) == ((n, 8), (n, 4, 4), (n, 6, 6))
    nominal = recordings.nominal(seen.q)
    far = np.linalg.norm((inverse(nominal) @ seen.T_base_hand)[:, :3, 3], axis=1)
    assert 0.0 < far.max() < 0.15, "the datasheet's robot is within its tolerances"
    assert len(seen.label) == n


def test_an_aligned_trial_is_on_one_clock(recordings, estimate):
    entry = recordings.entries("validation")[0]
    trial = recordings.trial(entry.id)
    found, clock = trial.aligned(), estimate.clock("robot")
    k = len(found.t) // 2
    expected = [np.interp(clock.from_mocap(found.t[k]), trial.t_robot, column) for column in trial.q_motor.T]
    np.testing.assert_allclose(found.q_motor[k], expected, atol=1e-4)
    assert found.T_lab_hand.shape == (len(found.t), 4, 4)
    assert found.plate_wrench.shape[0] == len(found.t)
    with pytest.raises(InputError, match="no trial 'swing_9'; there are"):
        recordings.trial("swing_9")
