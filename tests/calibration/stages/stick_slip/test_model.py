import json
from dataclasses import replace

import numpy as np
import pytest

from calibration.errors import NoSuchElement
from calibration.estimate.plain_values import plain, restored
from calibration.stages.stick_slip.band import PlainBand
from calibration.stages.stick_slip.fit import fit_direction
from calibration.stages.stick_slip.forcing import STEP, STEPS, Tilting
from calibration.stages.stick_slip.kernel.integration import simulated
from calibration.stages.stick_slip.likelihood import bases_of
from calibration.stages.stick_slip.model import PUSHED, StickSlip
from calibration.stages.stick_slip.parameters import covariance_of, wheel_parameters
from calibration.stages.stick_slip.search import warmed
from calibration.stages.stick_slip.stream import Sample, slip_stream
from calibration.stages.stick_slip.wheels import preloads
from tests.calibration.stages.stick_slip import slipping
from tests.calibration.stages.stick_slip.slipping import MASS, TRUTH, WEIGHT, WHEELS


@pytest.fixture(scope="module")
def model():
    trials = slipping.campaign(3, seed=21)
    direction = fit_direction("plate", trials, warmed(trials, TRUTH.logarithms))
    return StickSlip(WHEELS, Tilting(1e7 * np.eye(6), np.eye(6)), (direction,))


@pytest.fixture(scope="module")
def new():
    return trial(33)


def trial(seed, size=1.0):
    """A forcing and the true motion."""
    w = slipping.push(np.random.default_rng(seed), size=size)
    x, force = slipping.slid(w)
    return slipping.forcing(w, force), x[STEPS - 1 :: STEPS]


def test_new_trials_are_predicted_within_their_bands(model):
    inside, left, moved = [], [], []
    for seed in range(40, 48):
        forcing, true = trial(seed, size=0.7)  # less than in the calibration trials
        found = model.predict(forcing)
        error = found.x - true
        left.append((error**2).sum(axis=0))
        moved.append((true**2).sum(axis=0))
        assert found.share.max() > 0.0 and np.all(found.kept <= 1.0)
        inside.append((np.abs(error) < 1.96 * np.sqrt(found.variance)).mean(axis=0))
    assert np.all(np.median(np.array(left) / moved, axis=0) < 0.05)
    assert np.all(np.mean(inside, axis=0) > 0.9)


def test_a_plate_tells_how_the_wheels_stood(model):
    """Bases that came there by slips: what the casters bear at first is what displaces the base when they let go."""
    load, rng, left, alone, inside = WEIGHT + [0.0, 40.0, -20.0], np.random.default_rng(5), [], [], []
    stood = 0.8 * preloads(WHEELS, TRUTH, load)
    for seed, e in zip(range(60, 76), rng.permutation(stood), strict=False):
        w = slipping.push(np.random.default_rng(seed), size=0.25)
        x, force = slipping.slid(w, TRUTH, load, e[None])
        forcing = slipping.forcing(w, force + rng.normal(size=force.shape) * [0.1, 0.1, 0.03])
        forcing.drive[:, 3:6] = load
        found, true = model.predict(forcing), x[STEPS - 1 :: STEPS]
        bases = bases_of(WHEELS, model.direction("plate").logarithms[None], True)
        (unloaded,), _, _ = simulated(np.array([0, len(true)]), forcing.drive, forcing.inertia, bases, STEP, 1)
        late = slice(len(true) // 2, None)
        left.append(((found.x - true)[late] ** 2).mean(axis=0))
        alone.append(((unloaded - true)[late] ** 2).mean(axis=0))
        inside.append((np.abs(found.x - true) < 1.96 * np.sqrt(found.variance))[late].mean(axis=0))
    assert np.sqrt(np.mean(left, axis=0) / np.mean(alone, axis=0))[2] < 0.85
    assert np.mean(inside) > 0.85


def test_the_band_sees_a_slip_coming_that_nobody_can_predict(model):
    forcing, true = trial(42)  # its jolts reach the friction of the drives, which no calibration trial did
    known, _ = trial(43, size=0.7)  # less than in the calibration trials
    found = model.predict(forcing)
    sigma = np.sqrt([p.variance[-1] for p in (found, model.predict(known))])
    assert np.all(sigma[0] > 10.0 * sigma[1])
    assert np.all(np.abs(found.x - true)[-1] < 4.0 * sigma[0])


def test_a_pushed_base_is_known_to_a_share_of_how_far_it_moves(model):
    forcing, _ = trial(43, size=0.7)
    free, pushed = (model.predict(replace(forcing, pushed=push)) for push in (False, True))
    np.testing.assert_array_equal(pushed.x, free.x)
    more = PUSHED["plate"] ** 2 * np.maximum.accumulate(free.x**2, axis=0)
    np.testing.assert_allclose(pushed.variance - free.variance, more, rtol=1e-6, atol=1e-18)
    assert pushed.variance[-1, 2] > 2.0 * free.variance[-1, 2]


def test_prediction_is_pure(model, new):
    before = new[0].drive.copy()
    first, second = model.displacement(new[0]), model.displacement(new[0])
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(before, new[0].drive)
    assert first[0].shape == first[1].shape == (len(new[0].t), 6)


def test_an_axis_that_is_linear_is_the_compliances(model, new):
    linear = np.array([False, False, True])
    direction = replace(model.directions[0], linear=linear, plain=PlainBand(np.full(3, 2e-4), np.zeros(3)))
    forcing = replace(new[0], linear=np.full((len(new[0].t), 3), 1e-3))
    found, before = replace(model, directions=(direction,)).predict(forcing), model.predict(new[0])
    np.testing.assert_array_equal(found.x[:, 2], 1e-3)
    np.testing.assert_array_equal(found.variance[:, 2], 4e-8)
    np.testing.assert_array_equal(found.x[:, :2], before.x[:, :2])


def test_a_source_that_was_not_fitted_is_refused(model):
    with pytest.raises(NoSuchElement, match="dynamics"):
        model.predict(slipping.forcing(np.zeros((200, 3))))


def test_samples_one_by_one_are_what_a_recording_is(model, new):
    forcing, _ = new
    batch, stream, state, x = model.predict(forcing), slip_stream(model), None, []
    for k, t in enumerate(forcing.t):
        now = forcing.drive[STEPS * k + STEPS - 1]
        wrench = np.array([*now[8:10], -WEIGHT[0], -WEIGHT[2], WEIGHT[1], now[10]])
        driving = np.concatenate([now[:3], MASS[np.triu_indices(3)]])
        sample = Sample(float(t), wrench, np.zeros((2, 3)), driving)
        state = stream.stepped(sample, state)
        x.append(state.x)
    moved = np.abs(batch.x).max(axis=0)
    assert np.all(np.abs(np.array(x) - batch.x).max(axis=0) < 0.02 * moved)
    np.testing.assert_allclose(state.variance(model.directions[0]), batch.variance[-1], rtol=0.5)


def test_heave_and_tilt_are_as_uncertain_sample_by_sample_as_in_a_recording(model, new):
    forcing, direction = (
        new[0],
        replace(model.directions[0], heave=PlainBand(np.full(3, 5e-6), np.array([0.1, 0.02, 0.03]))),
    )
    heave = 1e-3 * np.sin(np.cumsum(~forcing.rest) / 30.0)[:, None] * [0.1, 1.0, 2.0]
    known = replace(model, directions=(direction,))
    stream, state, expected = slip_stream(known), None, known.displacement(replace(forcing, heave=heave))[1][:, 2:5]
    for t, h in zip(forcing.t, heave, strict=True):
        state = stream.stepped(
            Sample(float(t), np.array([0.0, 0.0, -700.0, 0.0, 0.0, 0.0]), np.stack([h, np.zeros(3)])), state
        )
    np.testing.assert_allclose(direction.heave.variance(state.found[4]), expected[-1], rtol=1e-12)
    assert expected[-1, 1] == pytest.approx(25e-12 + 4e-4 * 1e-6, rel=1e-2)


def test_a_plate_alone_moves_a_base_of_no_inertia(model, new):
    forcing, true = new
    stream, state, x = slip_stream(model), None, []
    for k, t in enumerate(forcing.t):
        last = forcing.drive[STEPS * k + STEPS - 1]
        wrench = np.array([*last[8:10], -WEIGHT[0], -WEIGHT[2], WEIGHT[1], last[10]])
        state = stream.stepped(Sample(float(t), wrench, np.zeros((2, 3))), state)
        x.append(state.x)
    error = np.abs(np.array(x) - true).mean(axis=0)
    assert np.all(error < 0.5 * np.abs(true).mean(axis=0))


def test_parameters_have_the_names_of_the_contract(model):
    found = {p.name: p for p in wheel_parameters(WHEELS, model.directions[0])}
    assert found["suspension.front_left.kx"].value == found["suspension.front_right.ky"].value
    assert found["suspension.front_left.kx"].status == "estimated"
    assert found["contact.left.mu"].status == found["suspension.front_left.cx"].status == "not_identifiable"
    assert found["suspension.left.cx"].status == "estimated"
    assert found["contact.back_left.mu"].unit == "-" and found["slip.body_cr"].unit == "N.m.s/rad"
    C = covariance_of(WHEELS, model.directions[0])
    np.testing.assert_allclose(np.sqrt(np.diag(C)), [p.sigma for p in found.values()])


def test_where_wheels_are_not_what_moves_the_base_none_of_them_is_identified(model):
    direction = model.directions[0]
    assert any(p.status == "estimated" for p in wheel_parameters(model.wheels, direction))
    for other in ({"linear": np.array([False, True, False])}, {"by_plate": False}):
        found = wheel_parameters(model.wheels, replace(direction, **other))
        assert {p.status for p in found} == {"not_identifiable"}


def test_a_model_is_the_same_after_it_was_written(model, new):
    again = restored(StickSlip, json.loads(json.dumps(plain(model))))
    for a, b in zip(model.displacement(new[0]), again.displacement(new[0]), strict=True):
        np.testing.assert_array_equal(a, b)


def test_an_estimate_of_before_knows_nothing_that_wheels_hold(model, new):
    content = json.loads(json.dumps(plain(model)))
    (of,) = content["directions"]
    of["logarithms"], of["ensemble"] = of["logarithms"][:15], [row[:15] for row in of["ensemble"]]
    of["covariance"] = [row[:15] for row in of["covariance"][:15]]
    del content["wheels"]["usual"], content["wheels"]["vertical"]
    before = restored(StickSlip, content)
    np.testing.assert_allclose(before.predict(new[0]).x, model.predict(new[0]).x, atol=2e-6)
    assert before.wheels.vertical == 0.0
