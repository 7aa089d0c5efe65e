"""Recovery of a drive train from data of its own model; derivatives; purity; intervals of an unknown history."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.stages.drive_trains.drive_train import DriveMotion, DriveTrain, harmonic_terms
from calibration.stages.drive_trains.fit import identification, mesh_friction
from calibration.stages.drive_trains.fit.identification import (
    Candidate,
    judged,
    loaded,
    residual_and_doubt,
    rubbing,
    torque_sigma,
)
from calibration.stages.drive_trains.fit.joint_data import JointData
from calibration.stages.drive_trains.fit.quantities import FORM, MOTOR, covariance_of, reported, reverses
from calibration.stages.drive_trains.fit.steady_contact import slipped_encoder, steady_contact
from calibration.stages.drive_trains.fit.train_fit import (
    FLOORS,
    Problem,
    TrainFit,
    derivatives,
    evaluated,
    fit_train,
    prior_of,
)
from calibration.stages.drive_trains.kernel.link_motion import COULOMB

TRUTH = DriveTrain("joint", "dead_zone", np.array([3e-3, 8e-4, 0.15, 0.05, 1.5e-3, 0.0, 0.0]), dynamic=False)
ECCENTRICITY = np.array([4e-3, 1e-3, -2e-3, 3e-4, -5e-4])
SECONDS = 30.0


def data(of: DriveTrain = TRUTH, load: float = 1.2, noise: float = 2e-5, seed: int = 0) -> JointData:
    rng, t = np.random.default_rng(seed), np.arange(0.0, SECONDS, 0.01)
    q = np.concatenate([a * np.sin(w * t + p) for a, w, p in ((0.9, 0.9, 0.0), (0.6, 1.7, 1.0), (1.0, 0.6, 2.0))])
    v, a = np.gradient(q, 0.01), np.gradient(np.gradient(q, 0.01), 0.01)
    torque = load * np.sin(1.3 * q + 0.2 * np.tile(t, 3))
    begins = np.array([0, len(t), 2 * len(t), 3 * len(t)])
    motion = DriveMotion(np.tile(t, 3), q, v, a, torque, np.full(len(q), 0.02), begins)
    first = np.arange(0, len(q), 10)
    n = len(first)
    bare = JointData(
        ("a", "b", "c"), motion, np.zeros((len(q), 0)), first, np.repeat(np.arange(3), n // 3),
        np.zeros(n, dtype=int), np.zeros(n), np.zeros((n, 5)), np.ones(n),
    )  # fmt: skip
    terms = np.column_stack([np.ones(n), harmonic_terms(bare.means(q))])
    low, high = of.ends(torque[begins[:-1]])
    delta = bare.means(of.deltas(motion, torque, 0.5 * (low + high)))
    return replace(bare, terms=terms, y=delta + terms @ ECCENTRICITY + noise * rng.normal(size=n))


def problem(of_data: JointData) -> Problem:
    return Problem("joint", of_data, prior_of(of_data, "dead_zone", 8e-3, 1e-2), dynamic=False)


START = np.array([2e-3, 5e-4, 0.3, 0.02, 0.0])


def test_a_drive_train_is_recovered_from_its_own_data() -> None:
    of = problem(data())
    rough = fit_train(of, START, FLOORS[:2])
    found = steady_contact(of, rough.theta, rough.gamma)
    assert found is not None
    assert found.theta[0] == pytest.approx(3e-3, rel=0.005)
    assert found.theta[1] == pytest.approx(8e-4, rel=0.02)
    assert found.theta[2] == pytest.approx(0.15, rel=0.1)
    assert found.theta[3] == pytest.approx(0.05, abs=0.01)
    assert np.abs(found.gamma - ECCENTRICITY).max() < 1e-4
    sigma = np.sqrt(np.diag(found.covariance))
    off = np.append(found.theta[:4] - TRUTH.values[:4], found.gamma - ECCENTRICITY)
    assert (np.abs(off) < 1.96 * np.delete(sigma, 4)).all()


def test_windows_beside_a_change_of_side_do_not_count() -> None:
    of = problem(data())
    found = steady_contact(of, np.append(TRUTH.values[:4], 0.0), ECCENTRICITY)
    assert found is not None
    open_ = np.abs(of.deltas(found.theta, found.gamma)) < 0.8 * found.theta[0]
    assert open_.any()
    for shift in (-1, 0, 1):
        assert not found.used[np.roll(open_, shift)].any()


def test_a_joint_that_rests_has_no_steady_contact() -> None:
    of_data = data()
    still = replace(of_data, regime=np.full(len(of_data.y), 2))
    assert steady_contact(problem(still), START, ECCENTRICITY) is None


def test_no_gap_is_estimated_as_none() -> None:
    none = replace(TRUTH, values=np.array([0.0, 8e-4, 0.15, 0.05, 1.5e-3, 0.0, 0.0]))
    of_data = data(none)
    fit = fit_train(problem(of_data), START)
    train = reported(fit.problem.train(fit.theta), fit, covariance_of(fit), 0.0)
    gap = next(p for p in train.parameters if p.name == "backlash.joint.gap")
    assert gap.status == "estimated" and gap.value - 1.96 * gap.sigma <= 0.0 < 5e-4
    assert gap.value < 2e-4


def test_a_gap_is_no_better_known_than_the_torque_that_winds_the_mesh() -> None:
    fit = fit_train(problem(data()), START, FLOORS[:2])
    exact, wound = (
        reported(replace(fit.problem.train(fit.theta), torque_sigma=sigma), fit, covariance_of(fit), 0.0).parameters[0]
        for sigma in (0.0, 0.05)
    )
    assert exact.name == "backlash.joint.gap" and exact.sigma < 7e-5
    assert wound.sigma == pytest.approx(np.hypot(exact.sigma, 2.0 * 0.05 * fit.theta[1]), rel=1e-9)


def test_friction_in_the_mesh_must_predict_better_than_a_dead_zone_of_the_same_windows(monkeypatch) -> None:
    of, poor = problem(data()), 100.0
    plain = identification.best_train(of, of.data, 8e-3, 1e-2)
    worse = replace(plain, score=plain.score + poor)  # steady contact alone, where jolts misled it
    monkeypatch.setattr(identification, "_dead_zone", lambda *_: worse)
    with_mesh = np.concatenate([plain.fit.theta[:5], [5e3, 0.1]])
    monkeypatch.setattr(identification, "hinted", lambda *_: [with_mesh])
    assert plain.steady and identification.best_train(of, of.data, 8e-3, 1e-2) is worse


def test_a_search_that_went_astray_is_left_for_a_dead_zone_where_friction_in_the_mesh_began(monkeypatch) -> None:
    of, poor = problem(data()), 100.0
    plain = identification.best_train(of, of.data, 8e-3, 1e-2)
    astray = replace(plain, score=plain.score + poor, steady=False)
    monkeypatch.setattr(identification, "_dead_zone", lambda *_: astray)
    monkeypatch.setattr(identification, "hinted", lambda *_: [np.concatenate([plain.fit.theta[:5], [5e3, 0.1]])])
    found = identification.best_train(of, of.data, 8e-3, 1e-2)
    assert found.fit.problem.form == "dead_zone" and found.score < plain.score + 0.1 * poor


def test_a_gap_that_is_never_crossed_is_not_identifiable_and_says_what_would() -> None:
    of_data = data(load=0.0)
    loaded = replace(of_data.motion, torque=of_data.motion.torque + 8.0)
    constant = replace(of_data, motion=loaded, y=of_data.terms @ ECCENTRICITY)
    fit = fit_train(problem(constant), START, FLOORS[:1])
    train = reported(fit.problem.train(fit.theta), fit, covariance_of(fit), 0.0)
    gap = next(p for p in train.parameters if p.name == "backlash.joint.gap")
    assert gap.status == "not_identifiable" and gap.sigma > 1e-3
    assert "changes sign" in gap.remedy


def test_derivatives_are_those_of_a_smaller_step() -> None:
    of = problem(data(noise=0.0))
    theta, gamma = np.append(TRUTH.values[:4], 0.0), ECCENTRICITY
    J = derivatives(of, theta, gamma)
    finer = replace(of, prior=replace(of.prior, step=0.1 * of.prior.step))
    K = derivatives(finer, theta, gamma)
    for j in range(2):
        assert np.median(np.abs(J[:, j] - K[:, j])) < 0.02 * np.abs(K[:, j]).max()
    assert (J[:, 5:] == of.data.terms).all()


def test_several_play_operators_at_once_are_each_alone() -> None:
    of_data = data()
    q = of_data.motion.q
    of = problem(replace(of_data, modes=0.05 * np.column_stack([np.sin(q), np.cos(2.0 * q)])))
    rng = np.random.default_rng(0)
    theta = np.abs(np.append(START, [0.3, -0.2]) * rng.uniform(0.5, 2.0, (5, 7)))
    at_once = of.data.played(theta[:, :5], theta[:, 5:], ECCENTRICITY)
    alone = np.array([of.deltas(x, ECCENTRICITY) for x in theta])
    np.testing.assert_allclose(at_once, alone, rtol=0.0, atol=1e-15)


def test_a_fit_leaves_its_data_and_start_as_they_were() -> None:
    of_data, start = data(), START.copy()
    before = {name: getattr(of_data.motion, name).copy() for name in ("q", "v", "torque", "inertia")}
    y = of_data.y.copy()
    fit_train(problem(of_data), start, FLOORS[:1])
    assert (start == START).all() and (of_data.y == y).all()
    assert all((getattr(of_data.motion, name) == x).all() for name, x in before.items())


def test_a_trial_without_readings_is_left_out() -> None:
    of_data = data().without(1)
    fit = fit_train(problem(of_data), START, FLOORS[:2])
    assert np.isnan(fit.residuals[of_data.trial == 1]).all()
    assert fit.theta[0] == pytest.approx(3e-3, rel=0.05)


@pytest.mark.parametrize("doubt", [0.4, 1.0, 2.5])
def test_what_changes_of_side_leave_is_apart_from_what_certain_sides_leave(doubt: float) -> None:
    of, rng = problem(data()), np.random.default_rng(6)
    theta, off = np.append(TRUTH.values[:4], 0.0), 2.0 * torque_sigma(TRUTH.values[2])
    fit = evaluated(of, theta, ECCENTRICITY)
    wide = np.ptp([of.deltas(theta, ECCENTRICITY, x) for x in (-off, 0.0, off)], axis=0)
    open_ = wide > 0.1 * theta[0]
    assert 0.02 < open_.mean() < 0.9
    left = np.hypot(2e-5, np.where(open_, doubt * wide / np.sqrt(12.0), 0.0)) * rng.choice([-1.0, 1.0], len(wide))
    residual, found = residual_and_doubt(Candidate(fit, 0.0, left, np.eye(10)))
    assert residual == pytest.approx(2e-5, rel=1e-6)
    assert found == pytest.approx(max(doubt, 1.0), rel=1e-3)
    train = replace(TRUTH, residual=residual, doubt=found, doubt_at_rest=0.5)
    variance = train.variance(np.zeros(3), np.array([0.0, 6e-3, 6e-3]), np.array([True, True, False]))
    np.testing.assert_allclose(variance, [4e-10, 4e-10 + found**2 * 3e-6, 4e-10 + 0.75e-6])


def test_a_single_trial_is_left_out_by_parts() -> None:
    of = problem(data().only(0))
    fit = fit_train(of, START, FLOORS[:2])
    steady = steady_contact(of, fit.theta, fit.gamma)
    assert steady is not None and np.sqrt(np.nanmean(judged(fit).left_out ** 2)) < 1e-3
    assert np.abs(steady.without(of)[:, :2] - TRUTH.values[:2]).max() < 1e-4


def test_the_interval_of_an_unknown_start_closes_once_the_gap_was_crossed() -> None:
    motion = data(load=0.0).motion
    torque = motion.torque + TRUTH.link_inertia * motion.a
    low, high = (TRUTH.deltas(motion, torque, end) for end in TRUTH.ends(torque[motion.begins[:-1]]))
    assert (high - low)[0] == pytest.approx(2.0 * (3e-3 + 0.15 * 8e-4), rel=0.02)
    assert np.abs(high - low)[600:3000].max() < 1e-9


def test_a_load_that_keeps_its_sign_shows_no_gap() -> None:
    load = 5.0 + np.sin(np.linspace(0.0, 60.0, 1000))
    assert not reverses(load, 0.5)
    assert not reverses(-load, 0.5)
    assert reverses(load, 4.5)  # friction of a reversing joint takes it to the other side
    assert reverses(load - 5.0, 0.5)


@pytest.mark.parametrize("size", [0.0, 2e-3, -6e-3])
def test_a_link_encoder_that_slips_is_found_with_its_trial(size: float) -> None:
    of_data = data()
    at = int(1.6 * len(of_data.y) / 3)
    of = problem(replace(of_data, y=of_data.y + np.where(np.arange(len(of_data.y)) > at, size, 0.0)))
    later = replace(of.data.motion, t=of.data.motion.t + np.repeat(np.arange(3) * 100.0, len(of.data.motion.t) // 3))
    of = replace(of, data=replace(of.data, motion=later))
    found = slipped_encoder(evaluated(of, np.append(TRUTH.values[:4], 0.0), ECCENTRICITY))
    if size == 0.0:
        assert found is None
    else:
        assert found is not None and found.trial_id == "b"
        assert found.t == pytest.approx(0.6 * SECONDS, abs=1.0)
        assert found.size == pytest.approx(size, rel=0.05)


def test_a_link_that_crosses_its_gap_once_and_late_is_no_slip_of_its_encoder() -> None:
    of_data = data()
    t = np.arange(len(of_data.motion.t)) / 100.0
    motion = replace(of_data.motion, torque=2.0 * np.tanh(5.0 * (t - 0.5 * t[-1])))
    late = np.roll(motion.torque, 35)
    delta = of_data.means(TRUTH.deltas(motion, late, TRUTH.ends(late[motion.begins[:-1]])[0]))
    of_data = replace(of_data, motion=replace(motion, t=t), y=delta + of_data.terms @ ECCENTRICITY)
    assert slipped_encoder(evaluated(problem(of_data), np.append(TRUTH.values[:4], 0.0), ECCENTRICITY)) is None


def test_a_stiff_joint_s_load_is_what_its_changes_of_side_show() -> None:
    """0.25 N.m that the nominal masses leave out wind its mesh up by 25 urad, and move when it changes sides."""
    stiff = replace(TRUTH, values=np.array([3e-3, 1e-4, 0.15, 0.05, 1.5e-3, 0.0, 0.0]))
    of_data = data(stiff)
    unknown, motion = np.full((len(of_data.motion.q), 1), 0.25), of_data.motion
    of_data = replace(of_data, modes=unknown, motion=replace(motion, torque=motion.torque - 0.25))
    of = problem(of_data)
    theta = np.append(stiff.values[:4], [0.0, 0.0])
    steady = steady_contact(of, theta, ECCENTRICITY)
    assert steady is not None and np.sqrt(steady.covariance[5, 5]) > 0.3
    assert loaded(steady, of).theta[-1] == pytest.approx(1.0, abs=0.15) != steady.theta[-1]


def test_a_friction_that_steady_contact_does_not_show_is_begun_where_changes_of_side_are_explained() -> None:
    """Friction beyond every load: what steady contact has is the prior's, at which the load would decide the side."""
    of = problem(data(load=0.05))
    steady = steady_contact(of, np.append(TRUTH.values[:4], 0.0), ECCENTRICITY)
    assert steady is not None and of.believes(steady.information, COULOMB)
    assert steady.theta[COULOMB] < 0.01
    right = rubbing(steady, of, 0.15)
    np.testing.assert_allclose(right.theta[:3], TRUTH.values[:3], rtol=0.03)
    assert rubbing(right, of, 0.005).theta[COULOMB] == right.theta[COULOMB]


def test_where_a_play_operator_found_the_friction_the_link_keeps_its_inertia(monkeypatch) -> None:
    """A play operator lets a link in its gap jump where its own inertia needs more than the friction it was given."""
    bare, inertia = data(load=0.0), 0.05
    motion = replace(bare.motion, torque=inertia * bare.motion.a, inertia=np.full(len(bare.motion.q), inertia))
    delta = bare.means(replace(TRUTH, dynamic=True).deltas(motion, motion.torque, np.zeros(3)))
    of = problem(replace(bare, motion=motion, y=delta + bare.terms @ ECCENTRICITY))
    wrong = np.array([3e-3, 8e-4, 0.6, 0.05, 0.0])

    def ends(of: Problem, theta: np.ndarray, floors: tuple[float, ...]) -> TrainFit:
        return evaluated(of, wrong if of.dynamic else np.append(TRUTH.values[:4], 0.0), ECCENTRICITY)

    rough = fit_train(of, START, FLOORS[:2])
    monkeypatch.setattr(identification, "fit_train", ends)
    monkeypatch.setattr(Problem, "believes", lambda *_: True)
    found = identification._dead_zone(of, rough).fit
    assert found.problem.dynamic
    np.testing.assert_array_equal(found.theta[:4], TRUTH.values[:4])


def of_train(fit: TrainFit) -> DriveTrain:
    return replace(fit.problem.train(fit.theta), link=np.zeros(5), torque_sigma=0.0)


def test_readings_show_a_link_encoder_s_eccentricity_less_the_motor_s() -> None:
    fit = fit_train(problem(data()), START, FLOORS[:2])
    own = np.sqrt(np.diag(covariance_of(fit)))[-4:]
    found = {q.name: q.sigma for q in reported(of_train(fit), fit, covariance_of(fit), 0.0).parameters}
    stated = [found[f"encoder.joint.link.{what}"] for what in ("cos1", "sin1", "cos2", "sin2")]
    np.testing.assert_allclose(stated, np.hypot(own, MOTOR))


def test_a_mesh_that_friction_holds_is_known_no_better_than_its_form() -> None:
    of_data = data()
    of = Problem("joint", of_data, prior_of(of_data, "friction_held", 8e-3, 1e-2), "friction_held", dynamic=False)
    fit = evaluated(of, np.concatenate([TRUTH.values[:4], [0.0, 1.0 / TRUTH.values[1], 0.2]]), ECCENTRICITY)
    known = np.zeros((len(fit.theta) + 5,) * 2)
    found = {q.name.split(".")[2]: q for q in reported(of_train(fit), fit, known, 0.0).parameters[:6]}
    for name, what in (("gap", "half_gap"), ("compliance", "compliance"), ("slip", "slip"), ("stiffness", "spring")):
        assert found[name].sigma == pytest.approx(FORM[what] * found[name].value)


@pytest.mark.parametrize("seed", [0, 1])
def test_friction_in_the_mesh_is_found_from_a_dead_zone_that_it_misled(seed) -> None:
    """Too wide a gap and a third of the link's friction, as on arm_5 of scenario `friction_held`."""
    true = DriveTrain("joint", "friction_held", np.array([1.5e-3, 8e-4, 1.0, 0.05, 6e-3, 1.2e3, 0.3]), dynamic=False)
    of_data = data(true, load=2.0, seed=seed)
    misled, prior = np.array([5e-3, 7e-4, 0.3, 0.2, 0.0]), prior_of(of_data, "friction_held", 8e-3, 1e-2)
    richer = Problem("joint", of_data, prior, "friction_held", dynamic=False)
    starts = mesh_friction.hinted(problem(of_data), richer, of_data, misled)
    best = min((mesh_friction.continued(richer, x, FLOORS[2:]) for x in starts), key=lambda fit: fit.cost)
    np.testing.assert_allclose(best.theta[[0, 2, 6]], true.values[[0, 2, 6]], rtol=0.12)


def test_no_friction_is_looked_for_where_a_dead_zone_leaves_nothing(monkeypatch) -> None:
    of_data = data(noise=2e-6)
    richer = Problem("joint", of_data, prior_of(of_data, "friction_held", 8e-3, 1e-2), "friction_held", dynamic=False)
    fit = fit_train(problem(of_data), START)
    monkeypatch.setattr(mesh_friction, "continued", lambda *_: pytest.fail("looked for"))
    assert mesh_friction.hinted(problem(of_data), richer, of_data, fit.theta) == []
    of = fit.problem
    assert of.of_sizes(np.full(of_data.n_groups, FLOORS[-1])) <= fit.cost  # which none can be below
