"""Where the robot turns and which way it goes."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.numerics.lie import from_vector, to_vector
from calibration.robot.laboratory import Laboratory
from calibration.stages.frames.base_fit import fit_base_frame, ties
from calibration.stages.frames.base_rests import Common, Stations, residuals
from calibration.stages.frames.base_stage import STANDING, locate_base
from calibration.stages.frames.heins_baseline import printed_base_frame
from tests.doubles import rigid_robot
from tests.doubles.spinning_base import EVERY, FLOOR, SIGMA, TILT, TRUE, path, stations


def fitted(data, start=None, free=EVERY):
    return fit_base_frame(data, np.zeros(6) if start is None else start, FLOOR, free)


def sampled(n: int, wander: float):
    """Estimates of T_base_B over n seeds, each from noise and wander of its own."""
    found = []
    for seed in range(n):
        rng = np.random.default_rng(seed)
        found.append(fitted(stations(*path(wander, rng=rng), SIGMA, rng)))
    assert all(f.converged for f in found)
    return np.array([f.common.base for f in found]) - TRUE, found


def test_without_noise_the_truth_is_found():
    found = fitted(stations(*path()))
    np.testing.assert_allclose(found.common.base, TRUE, atol=1e-12)
    np.testing.assert_allclose(found.common.tilt, TILT, atol=1e-12)
    assert found.converged and not found.wander.any()


def test_the_start_does_not_matter():
    far = np.array([0.3, -0.2, 0.0, 0.02, -0.05, 2.5])
    data = stations(*path(), base=far)
    np.testing.assert_allclose(fitted(data, printed_base_frame(data).start(np.zeros(6))).common.base, far, atol=1e-11)


def test_derivatives_are_those_of_the_residuals():
    planar, index, kinds = path()
    data = stations(planar, index, kinds)
    x0 = np.concatenate([TRUE + 0.02, TILT - 0.01, 0.03 * np.arange(6) - 0.1, planar.ravel() + 0.01])

    def at(x):
        common = Common(x[:6], x[6:8], x[8:14].reshape(2, 3))
        return residuals(common, x[14:].reshape(-1, 3), data, FLOOR)

    _, J, J_planar = at(x0)
    for k in range(20):
        h = 1e-6 * np.eye(len(x0))[k]
        difference = (at(x0 + h)[0] - at(x0 - h)[0]) / 2e-6
        exact = np.zeros_like(difference)
        if k < 14:
            exact = J[:, :, k]
        else:
            exact[(k - 14) // 3] = J_planar[(k - 14) // 3, :, (k - 14) % 3]
        np.testing.assert_allclose(difference, exact, atol=1e-8)


def test_derivatives_are_those_of_the_ties():
    planar, index, kinds = path(1e-3)
    data, planar = stations(planar, index, kinds), planar + np.random.default_rng(1).normal(size=planar.shape)
    for k in range(planar.size):
        h = 1e-6 * np.eye(planar.size)[k].reshape(planar.shape)
        difference = (ties(data, planar + h).c - ties(data, planar - h).c) / 2e-6
        np.testing.assert_allclose(difference, ties(data, planar).C.reshape(-1, planar.size)[:, k], atol=1e-8)


@pytest.mark.slow
def test_a_rigid_spin_is_estimated_at_the_cramer_rao_bound():
    errors, _ = sampled(300, 0.0)
    bound = np.sqrt(np.diag(fitted(stations(*path())).covariance))[:6]
    ratio = np.sqrt((errors**2).mean(axis=0)) / bound
    assert np.sqrt((ratio**2).mean()) < 1.05  # +-2.4 % by chance
    assert ratio.max() < 1.1


def test_a_wandering_spin_is_covered_and_its_wander_found():
    errors, found = sampled(120, 5e-4)
    sigma = np.array([np.sqrt(np.diag(f.covariance))[:6] for f in found])
    covered = (np.abs(errors) < 1.96 * sigma).mean()
    assert 0.88 < covered < 0.98  # s comes from 22 and 6 degrees of freedom
    wander = np.sqrt(np.mean([f.wander**2 for f in found], axis=0))
    np.testing.assert_allclose(wander, 5e-4, rtol=0.1)


def test_a_base_that_stands_otherwise_in_every_trial_is_allowed_for():
    """Trials upright and tilted, together: the axis stays, the scatter is not called noise."""
    planar, index, kinds = path()
    lean = np.array([0.0, 0.0, -8e-4, 4e-4, 9e-4, 0.0])
    upright, leaning = stations(planar, index, kinds), stations(planar, index, kinds, base=leaned(lean))
    both = Stations(
        np.concatenate([upright.T, leaning.T]),
        np.concatenate([upright.covariance, leaning.covariance]),
        np.concatenate([index, index + 2]),
        kinds * 2,
        kinds * 2,
    )
    stiff, soft = fitted(both), fit_base_frame(both, np.zeros(6), FLOOR, EVERY, STANDING[2:5])
    assert stiff.chi2 > 100.0 and soft.chi2 < 1.0 and soft.converged
    np.testing.assert_allclose(soft.common.base[[0, 1, 5]], TRUE[[0, 1, 5]], atol=5e-6)
    lean_found = soft.common.standing[2:] - soft.common.standing[:2]
    np.testing.assert_allclose(lean_found, np.tile(lean[2:5], (2, 1)), atol=1e-5)


def leaned(lean):
    """T_base_B of a base that leans."""
    return to_vector(from_vector(lean) @ from_vector(TRUE))


def test_leaning_on_the_first_rest_costs_accuracy():
    """The printed estimator and ours, on the same wandering spins."""
    ours, theirs = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        data = stations(*path(5e-4, rng=rng), SIGMA, rng)
        ours.append((fitted(data).common.base - TRUE)[[0, 1, 5]])
        theirs.append((printed_base_frame(data).start(TRUE) - TRUE)[[0, 1, 5]])
    rms, rms_printed = (np.sqrt((np.array(e) ** 2).mean(axis=0)) for e in (ours, theirs))
    assert (rms_printed > np.array([1.3, 1.3, 1.0]) * rms).all()


def test_an_offset_constant_in_the_world_gives_a_mean_and_no_centre():
    planar, index, kinds = path(drives=0, span=np.pi)
    data = stations(planar, index, kinds, tilt=np.zeros(2))
    p, centre = data.T[:, :2, 3], planar[0, :2] + FLOOR[:2]
    assert np.linalg.norm(p.mean(axis=0) - centre) > 2e-3  # argmin over d of sum |p_i - d|^2, a half turn
    r = printed_base_frame(data).centre
    np.testing.assert_allclose((data.T[:, :3, :3] @ r + data.T[:, :3, 3])[:, :2], centre[None].repeat(12, 0), atol=2e-4)


@pytest.fixture(scope="module")
def robot():
    return Laboratory(mjcf.urdf(), rigid_robot.described())


def test_the_stage_names_what_it_found_and_what_it_took_on_trust(robot):
    data = replace(stations(*path()), ids=("round", "ahead"))
    model, said = locate_base(robot, data)
    assert [p.name for p in model.parameters] == [f"frame.base.base.{a}" for a in ("x", "y", "z", "rx", "ry", "rz")]
    assert {p.status for p in model.parameters} == {"estimated"}
    sigma = np.array([p.sigma for p in model.parameters])
    assert (sigma[2:5] >= STANDING[2:5]).all() and (sigma[[0, 1, 5]] < 1e-4).all()
    assert [v.verdict for v in said] == ["ok"] * 3
    assert "round: the centre wanders 0.000 mm" in said[1].message and "0.70 m" in said[2].message


def test_without_a_drive_the_heading_stays_as_drawn(robot):
    model, said = locate_base(robot, stations(*path(drives=0)))
    heading = model.parameters[5]
    assert (heading.status, heading.value) == ("not_identifiable", heading.nominal)
    assert any(v.verdict == "warning" and "heading: no drive" in v.message for v in said)


def test_without_a_plate_the_height_stays_as_drawn(robot):
    plateless = robot.description.model_copy(update={"plates": ()})
    model, said = locate_base(replace(robot, description=plateless), stations(*path()))
    assert model.parameters[2].status == "not_identifiable"
    assert any("height" in v.message for v in said if v.verdict == "warning")


def test_a_spin_of_a_few_degrees_is_refused(robot):
    rng = np.random.default_rng(0)
    data = stations(*path(2e-4, rng=rng, span=0.15), SIGMA, rng)
    assert [v.verdict for v in locate_base(robot, data)[1]].count("refused") > 0


def test_a_spin_of_three_rests_is_not_enough(robot):
    model, said = locate_base(robot, stations(*path(spins=3)))
    assert model is None and said[0].verdict == "missing" and "spin" in said[0].message
