"""Samples that an instrument lost cost that time of that trial, and nothing else."""

from dataclasses import replace

import numpy as np

import mjcf
from calibration.checks.recordings import holes
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.signals import even
from calibration.recording.holes import without_holes
from calibration.robot.laboratory import Laboratory
from calibration.stages.clocks.stage import synchronise
from tests.doubles import geared_robot, rigid_robot


def test_lost_samples_leave_holes_and_a_whole_trial_is_itself(truth):
    trial = rigid_robot.record(truth, rigid_robot.sweep(3, seconds=2.0), 12.0, np.random.default_rng(0))
    assert without_holes(trial) is trial
    q, w, p = trial.q_motor.copy(), trial.plate_wrench.copy(), trial.marker_position.copy()
    q[20:50, 4], w[100:300, 0, 3], p[7, 2] = np.nan, np.inf, np.inf
    found = without_holes(replace(trial, q_motor=q, plate_wrench=w, marker_position=p))
    np.testing.assert_array_equal(found.t_robot, np.delete(trial.t_robot, np.r_[20:50]))
    np.testing.assert_array_equal(found.t_plate, np.delete(trial.t_plate, np.r_[100:300]))
    assert np.isfinite(found.q_motor).all() and np.isfinite(found.plate_wrench).all()
    assert np.isnan(found.marker_position[7, 2]).all() and np.isfinite(found.marker_position).sum() == p.size - 3


def test_a_joint_lost_where_its_link_is_read_costs_that_joint_alone(truth):
    trial = rigid_robot.record(truth, rigid_robot.sweep(3, seconds=6.0), 12.0, np.random.default_rng(0))
    trial = replace(trial, q_link=trial.q_motor - 0.1)
    q, j = trial.q_motor.copy(), 4
    q[200:400, j] = np.nan
    found = without_holes(replace(trial, q_motor=q))
    np.testing.assert_array_equal(found.t_robot, trial.t_robot)
    np.testing.assert_allclose(found.q_motor, trial.q_motor, atol=1e-12)
    lost = np.isnan(found.q_link) & np.isfinite(trial.q_link)
    np.testing.assert_array_equal(np.argwhere(lost), [(k, j) for k in range(200, 400)])
    lab = MeasuredTrial.of(Laboratory(mjcf.urdf(), rigid_robot.described()).description, found)
    (said,) = (v.message for v in holes([lab]))
    assert f"holes in the joint readings of {trial.joint[j]}, the longest 2.01 s" in said


def test_nothing_swings_across_a_hole():
    t = np.arange(0.0, 10.0, 0.01)
    x = np.sin(8.0 * t)[:, None]
    x[300:500] = np.nan
    found = even(t, x)
    assert np.abs(found.x).max() <= 1.0 + 1e-6 and 200 <= (~found.valid).sum() <= 202


def test_a_joint_lost_in_one_trial_does_not_move_the_clock(truth):
    rng = np.random.default_rng(0)
    drives = geared_robot.gears(rng)
    trials = [
        replace(geared_robot.record(truth, drives, geared_robot.sweep(j), 12.0 + 60.0 * j, rng), id=f"sweep{j}")
        for j in (2, 3, 4)
    ]
    lab = Laboratory(mjcf.urdf(), rigid_robot.described())
    whole = synchronise(lab, trials)[0][0]
    q = trials[1].q_motor.copy()
    q[500:800, 4] = np.nan
    clocks, verdicts = synchronise(
        lab, [without_holes(t) for t in (trials[0], replace(trials[1], q_motor=q), trials[2])]
    )
    late = float(clocks[0].to_mocap(np.array([whole.epoch]))[0] - whole.to_mocap(np.array([whole.epoch]))[0])
    assert abs(late) < whole.sigma and "3 trials" in verdicts[0].message
