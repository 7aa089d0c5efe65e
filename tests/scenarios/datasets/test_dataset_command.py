"""The command `dataset`: whole robots by default, and trials on one clock."""

import netCDF4
import numpy as np
import pytest
from typer.testing import CliRunner

from scenarios import load
from scenarios.commands.main import app
from scenarios.datasets.collection import Plan
from scenarios.datasets.run_content import PRODUCE
from twin.truth import read_trial


@pytest.fixture
def planned(monkeypatch):
    """Runs the command; returns what it would have made."""
    plans: list[Plan] = []
    monkeypatch.setattr("scenarios.datasets.collection.collect", lambda plan, *args, **more: plans.append(plan) or ())

    def run(*arguments):
        CliRunner().invoke(app, ["dataset", *arguments, "-n", "2", "--out", "unused"])
        return plans[-1]

    return run


def test_robots_are_sampled_whole_unless_the_spread_is_set(planned):
    assert planned("humanoids2024").scenario.twin.widths.spread == 0.5
    assert planned("humanoids2024", "--set", "twin.widths.spread=0").scenario.twin.widths.spread == 0.0
    assert planned("humanoids2024", "--set", "twin.widths.spread=0.2").scenario.twin.widths.spread == 0.2


@pytest.mark.parametrize("blind", [False, True])
@pytest.mark.parametrize("aligned", [False, True])
def test_what_makes_a_run_follows_the_options(planned, blind, aligned):
    options = [*(["--blind"] if blind else []), *(["--aligned"] if aligned else [])]
    assert planned("swing20", *options).produce is PRODUCE[blind, aligned]


def test_aligned_trials_are_on_the_clock_of_the_motion_capture(tmp_path):
    only = ["carried=true", "calibration_postures=12", "validation_swing=5.0", "only=[postures, xyz]"]
    scenario = load("short", [f"twin.campaign.{value}" for value in only])
    PRODUCE[False, True](scenario, tmp_path)
    true = read_trial(tmp_path / "truth" / "trials" / "xyz.nc")
    with netCDF4.Dataset(tmp_path / "aligned" / "xyz.nc") as file:
        t, q, T = (np.ma.filled(file[name][:], np.nan) for name in ("t", "q_motor", "T_lab_hand"))
    np.testing.assert_array_equal(t, true.t_mocap)
    at = slice(150, 450)
    late = np.abs(np.gradient(true.q_motor_true[at], t[at], axis=0)).max() * 2e-3
    zeros = np.nanmean(q[at] - true.q_motor_true[at], axis=0)
    assert np.nanmax(np.abs(q[at] - true.q_motor_true[at] - zeros)) < late + 1e-3
    assert np.nanmax(np.linalg.norm(T[:, :3, 3] - true.hand_pose[:, :3, 3], axis=1)) < 2e-3
