"""What to record next, where the data leave something to the drawing."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration import load_estimate, save_estimate
from calibration.design.information import dwell_noise
from calibration.design.next_motions import drive_next, predicted_sigma, sweep, sweeps_next, swings_next
from calibration.design.next_postures import N, believed_play, record_next
from calibration.estimate.estimate import Estimate, RobotNames
from calibration.inference.parameters import Parameter
from calibration.numerics.lie import exp6
from calibration.recording.experiment import read_plans
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.stages.frames.base_stage import locate_base
from calibration.stages.geometry.hand_residual import linearised
from calibration.stages.geometry.parameters import geometry_parameters, reading_sigma
from calibration.stages.geometry.stage import calibrate_geometry
from calibration.stages.joints.model import JointModel, Quality
from calibration.stages.joints.separable_fit import RHO, Problem, search
from calibration.stages.suspension.cross_validation import HeldOut
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.wheels import KNOWN, jackknife
from tests.doubles import rigid_robot, spinning_base

DESCRIBED = rigid_robot.described()
LAB = Laboratory(mjcf.urdf(), DESCRIBED)
TRUTH = rigid_robot.defects(3)
NOISE = 10.0  # of the markers, over the datasheet's


@pytest.fixture(scope="module")
def chain():
    return chain_of(mjcf.urdf(), DESCRIBED)


def recorded(q, seed):
    """Postures at angles q with noise as the markers make it."""
    exact = rigid_robot.postures(TRUTH, q)
    S = NOISE**2 * dwell_noise(exact.T_base_hand, DESCRIBED)
    e = np.einsum("nij,nj->ni", np.linalg.cholesky(S), np.random.default_rng(seed).normal(size=(len(q), 6)))
    return replace(exact, T_base_hand=exact.T_base_hand @ exp6(e), covariance=S)


@pytest.fixture(scope="module")
def still(chain):
    """A campaign in which the torso and the last two joints never moved."""
    q = rigid_robot.near_postures(np.random.default_rng(0), 25)
    q[:, [0, 6, 7]] = 0.15, 0.1, 0.2
    postures = recorded(q, 1)
    return postures, *calibrate_geometry(chain, DESCRIBED, postures)


@pytest.fixture(scope="module")
def suggested(chain, still):
    return record_next(mjcf.urdf(), chain, DESCRIBED, still[0], still[1], False)


def test_five_postures_tell_what_joints_that_never_moved_left_open(suggested, still):
    remedy, said = suggested
    assert still[1].rank < 36 and len(remedy.postures) == N == 5
    assert (
        f"{36 - still[1].rank} of 36 identifiable combinations" in remedy.why
        and said[0].verdict == "warning"
        and "record_next.yaml" in said[0].message
    )
    assert remedy.sigma[0].name == "hand.position" and remedy.sigma[0].after < 0.1 * remedy.sigma[0].before
    q = np.array([p.q for p in remedy.postures])
    assert np.ptp(q[:, 0]) > 0.1 and np.ptp(q[:, 6]) > 0.5 and np.ptp(q[:, 7]) > 0.5


def test_recording_them_gives_the_sigmas_that_were_predicted(chain, suggested, still):
    """The five recorded and everything calibrated again: the fit's own sigmas, and errors they explain."""
    remedy, _ = suggested
    postures, before, _ = still
    more = recorded(np.array([p.q for p in remedy.postures]) - TRUTH.offset, 2)
    after, said = calibrate_geometry(chain, DESCRIBED, postures.joined(more))
    assert after.rank == 36 and all(v.verdict == "ok" for v in said)
    names = [p.name for p in before.parameters]
    old, new = (np.array([m.parameters[names.index(s.name)].sigma for s in remedy.sigma[1:]]) for m in (before, after))
    np.testing.assert_allclose([s.before for s in remedy.sigma[1:]], old, rtol=1e-6)
    ratio = np.array([s.after for s in remedy.sigma[1:]]) / new
    assert (ratio > 0.5).all() and (ratio < 1.6).all()  # play is estimated anew, and the width of the priors
    assert (old / new > 2.0).all()


def test_enough_postures_ask_for_no_more(chain):
    postures = recorded(rigid_robot.near_postures(np.random.default_rng(0), 40), 1)
    model, _ = calibrate_geometry(chain, DESCRIBED, postures)
    assert record_next(mjcf.urdf(), chain, DESCRIBED, postures, model, False) == (None, ())


@pytest.mark.parametrize("n, rejected", [(4, True), pytest.param(8, False, marks=pytest.mark.slow)])
def test_a_fit_of_few_postures_ends_with_postures_too(chain, n, rejected):
    """After a rejected fit their sigmas are those of errors of known sizes: at the datasheet's play nine times."""
    postures = recorded(rigid_robot.near_postures(np.random.default_rng(0), n), 1)
    model, _ = calibrate_geometry(chain, DESCRIBED, postures)
    remedy, reported = record_next(mjcf.urdf(), chain, DESCRIBED, postures, model, rejected)
    assert f"{13 - n} distinct postures are missing" in reported[0].message
    assert len(remedy.postures) == max(N, 13 - n) and remedy.sigma[0].after < 0.6 * remedy.sigma[0].before
    more = recorded(np.array([p.q for p in remedy.postures]) - TRUTH.offset, 2)
    after, said = calibrate_geometry(chain, DESCRIBED, postures.joined(more))
    assert not [v for v in said if v.verdict == "refused"]
    C = after.random_covariance if rejected else after.covariance
    known = dict(zip([p.name for p in after.parameters], np.sqrt(np.diag(C)), strict=True))
    ratio = np.array([s.after / known[s.name] for s in remedy.sigma[1:]])
    assert (ratio > 0.8).all() and (ratio < (2.5 if rejected else 1.5)).all()


@pytest.mark.parametrize("size", [0.0, 0.5, 1.0])
def test_play_is_believed_as_the_postures_tell(chain, size):
    """Ten postures of six robots: a factor of the datasheet's play; the markers' noise is worth 0.04 of it."""
    parameters, datasheet, found = geometry_parameters(chain, DESCRIBED), reading_sigma(chain, DESCRIBED), []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        q = rigid_robot.near_postures(rng, 10)
        postures = recorded(q + size * datasheet * rng.normal(size=q.shape), seed)
        postures = replace(postures, q=q + TRUTH.offset)
        nominal = nominal_hand(chain, parameters.nominal[:12])
        theta = np.array([p.value for p in calibrate_geometry(chain, DESCRIBED, postures)[0].parameters])
        found.append(believed_play(nominal, parameters, postures, theta, datasheet)[1] / datasheet[1])
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(size, rel=0.4, abs=0.05)


@pytest.mark.slow
def test_the_same_data_get_the_same_postures(chain, still, suggested):
    assert record_next(mjcf.urdf(), chain, DESCRIBED, still[0], still[1], False) == suggested


def test_what_is_predicted_of_a_dwell_is_its_derivative(chain):
    """B of the recorded postures is the fit's own whitened Jacobian, play none."""
    from calibration.design.information import prospect

    parameters = geometry_parameters(chain, DESCRIBED)
    hand = nominal_hand(chain, parameters.nominal[:12])
    q = rigid_robot.near_postures(np.random.default_rng(0), 5)
    exact = replace(rigid_robot.postures(rigid_robot.Truth(), q), covariance=dwell_noise(hand.poses(q), DESCRIBED))
    J = linearised(hand, parameters.nominal, exact, parameters.names).J
    W = np.linalg.inv(np.linalg.cholesky(exact.covariance))
    reported = prospect(hand, parameters, DESCRIBED, np.zeros(8), q, q[:1], np.eye(len(parameters)))
    np.testing.assert_allclose(reported.B, W @ J * parameters.scale, rtol=1e-6, atol=1e-5)


def test_a_missing_drive_is_asked_for_and_tells_what_it_should(chain):
    """Predicted from the spin alone; then driven."""
    rng = np.random.default_rng(0)
    spun = spinning_base.stations(*spinning_base.path(drives=0), spinning_base.SIGMA, rng)
    model, _ = locate_base(LAB, spun)
    remedy, said = drive_next(LAB, spun, model)
    assert [m.kind for m in remedy.motions] == ["drive"] and said[0].verdict == "warning"
    heading = next(s for s in remedy.sigma if s.name.endswith("rz"))
    assert heading.before == pytest.approx(DESCRIBED.tolerances.body_rotation)
    both, _ = locate_base(LAB, spinning_base.stations(*spinning_base.path(), spinning_base.SIGMA, rng))
    assert heading.after == pytest.approx(both.parameters[5].sigma, rel=0.4)
    assert drive_next(LAB, spinning_base.stations(*spinning_base.path()), both) == (None, ())


def test_no_motion_of_the_base_at_all_asks_for_both(chain):
    remedy, _ = drive_next(LAB, None, None)
    assert [m.kind for m in remedy.motions] == ["spin", "drive"]
    assert {s.name[-2:] for s in remedy.sigma} >= {".x", ".y", "rz"}
    assert all(s.after < 0.1 * s.before for s in remedy.sigma if s.name[-2:] in (".x", ".y", "rz"))


def test_the_estimate_keeps_them_as_a_file(chain, suggested, tmp_path):
    names = RobotNames(chain.measured, chain.base_frame, chain.tool_frame)
    remedies = (suggested[0], drive_next(LAB, None, None)[0])
    estimate = Estimate("not_calibrated", (), (), (), "", mjcf.urdf(), names, remedies=remedies)
    save_estimate(estimate, tmp_path)
    assert read_plans(tmp_path / "record_next.yaml") == (chain.measured, remedies)
    assert load_estimate(tmp_path).remedies == remedies
    save_estimate(replace(estimate, remedies=()), tmp_path)
    assert not (tmp_path / "record_next.yaml").exists()


def flanks(rho, size=10e-3, residual=1e-3):
    """A joint whose reading is off by -+size/2, chosen by the sign of its motion."""
    box = np.array([[-1.0, 1.0], [-5.0, 5.0]])
    a, b = np.array([0.5 * size]), np.array([-0.5 * size])
    quality = Quality(size, residual, 0.9, 0.9)
    return JointModel("arm_6_joint", "total", 0, ((0, 0),), (), rho, a, b, box, 0.0, quality=quality)


def test_a_rho_at_its_limit_is_asked_for_by_a_sweep_at_the_right_speed():
    remedy, said = sweeps_next([flanks(RHO[1]), flanks(50.0)])
    (motion,) = remedy.motions
    peak = 2.0 * np.pi * motion.frequency * motion.amplitude
    assert motion.kind == "sweep" and 1.0 < RHO[1] * peak < 10.0
    assert remedy.sigma[0].after < 0.5 * remedy.sigma[0].before and said[0].verdict == "warning"
    fast = sweeps_next([flanks(RHO[0], 0.1)])[0].motions[0]
    assert 2.0 * np.pi * fast.frequency * fast.amplitude > 0.5 / RHO[0]


def test_flanks_that_lie_together_are_not_asked_for():
    remedy, said = sweeps_next([flanks(RHO[1], 1e-5)])
    assert remedy is None and "no sweep identifies it" in said[0].message
    assert sweeps_next([flanks(50.0)]) == (None, ())


def test_the_sigma_of_rho_is_that_of_simulated_sweeps():
    """Errors that stay for a second, fitted as the stage does."""
    model = flanks(300.0)
    motion = sweep(flanks(RHO[1]))
    t = np.arange(0.0, motion.seconds, 0.1)
    v = 2.0 * np.pi * motion.frequency * motion.amplitude * np.cos(2.0 * np.pi * motion.frequency * t)
    exact = model.discrepancy(np.zeros(len(t)), np.zeros(len(t)), v)
    found = []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        error = model.quality.residual * rng.normal(size=int(motion.seconds) + 1)[t.astype(int)]
        found.append(search(Problem(np.ones((len(t), 1)), v, exact + error)).rho)
    assert np.std(found) == pytest.approx(predicted_sigma(model, motion), rel=0.3)


def scattering(slip: bool, n: int = 6) -> Suspension:
    """A suspension whose x y element scatters a little too much between trials."""
    K, rest = np.diag([1e5, 1e5, 1e6, 2e4, 2e4, 1e4]), np.zeros((6, 6))
    error = np.zeros((n, 6))
    error[:, 1] = 0.9 * slip
    held = HeldOut(error, np.ones((n, 6)), np.zeros((n, 6)), np.full(n, 100.0))
    p = Parameter("suspension.K.12", "N/m", 0.0, 0.0, 4e4, "not_identifiable")
    q = Parameter("suspension.K.11", "N/m", 0.0, 1e5, 1e3, "estimated")
    return Suspension("compliance", K, 0.01 * K, rest, rest, (("plate", held),), (q, p), ())


def test_elements_that_scatter_ask_for_as_many_swings_as_would_tell_them():
    remedy, said = swings_next(scattering(slip=False))
    (motion,), (sigma,) = remedy.motions, remedy.sigma
    assert sigma.name == "suspension.K.12" and sigma.before == 4e4
    assert sigma.after < KNOWN * 1e5  # reported, as the stage counts it
    assert sigma.before * np.sqrt(6 / (6 + motion.repeats - 2)) > KNOWN * 1e5  # and no more than needed
    assert f"{motion.repeats} more swings" in said[0].message


def test_elements_of_axes_that_slip_are_said_to_be_beyond_any_motion():
    remedy, said = swings_next(scattering(slip=True))
    assert remedy is None and "1 elements of K and C: the motion excites no spring along y" in said[0].message


def test_a_jackknife_falls_with_the_number_of_trials_as_is_predicted():
    rng = np.random.default_rng(0)
    few, many = (np.mean([jackknife(left_out(rng.normal(size=(n, 1))))[0, 0] for _ in range(2000)]) for n in (6, 15))
    assert np.sqrt(many / few) == pytest.approx(np.sqrt(6 / 15), rel=0.03)


def left_out(values):
    """Means without one each."""
    return (values.sum(axis=0) - values) / (len(values) - 1)
