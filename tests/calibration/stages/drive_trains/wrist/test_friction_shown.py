"""Friction of a link that falls from flank to flank under a heavy hand, by the wrist's sensor on its true links."""

from dataclasses import replace

import numpy as np
import pytest

import mjcf
from calibration.stages.drive_trains import DriveTrain, DriveTrains
from calibration.stages.drive_trains.drive_train import Quantity
from calibration.stages.drive_trains.hung_load import hung_load
from calibration.stages.drive_trains.torques import dynamics
from tests.calibration.stages.drive_trains.wrist.test_hung_load import (
    CENTRE,
    LINKS,
    OFFSET,
    T,
    angles,
    described,
    readings,
    trials,
)

JOINT, J, HEAVY = "arm_7_joint", 7, 2.0
VALUES = np.array([10e-3, 1e-3, 0.15, 0.05, 6e-3, 1.0, 0.0])  # half gap, compliance, frictions, ...


def trains(known, values, sigma=0.2, reach=0.1):
    """A robot with a heavy hand whose arm_7 has a gap; loads beyond `reach` [N.m] are new."""
    friction = Quantity(f"friction.{JOINT}.coulomb", "N.m", values[2], sigma, "not_identifiable")
    train = DriveTrain(JOINT, "dead_zone", values, parameters=(friction,), range=np.array([-reach, reach]))
    other = described(None).carrying(HEAVY)
    robot = dynamics(mjcf.urdf(), other, np.zeros(8), known)
    return DriveTrains(robot, (train,), mjcf.urdf(), other, known)


@pytest.fixture(scope="module")
def swing():
    """What was weighed with the usual hand, motors and links of a swing with the heavy one, and the sensor's readings.

    These have noise, and a sensor that is 5 mrad askew.
    """
    usual, q = described(None), angles(5)
    known = hung_load(mjcf.urdf(), usual, OFFSET, trials(usual))
    true = trains(replace(known, links=LINKS, centre=CENTRE), VALUES)
    links = true.likely(true.dynamics.loads("", T, q))
    w = readings(true.description, links, HEAVY)
    w[:, :2] += 5e-3 * w[:, [2]]
    return known, q, links, w + np.random.default_rng(0).normal(scale=np.repeat([0.1, 0.003], 3), size=w.shape)


def off(values, share):
    """The same to what usual loads show, with another friction."""
    return np.array([values[0], values[1] / share, *(share * values[2:4]), *values[4:]])


@pytest.mark.parametrize("share", [0.6, 0.8, 1.5])
def test_the_wrist_s_sensor_shows_the_friction_under_a_load_that_is_new(swing, share):
    known, q, links, w = swing
    of = trains(known, off(VALUES, share))
    found = of.loads("", T, q, None, w)
    assert found.friction == pytest.approx([*7 * [1.0], 1.0 / share], rel=0.1)
    before, after = (
        np.sqrt(np.mean((of.likely(x) - links)[:, J] ** 2)) for x in (replace(found, friction=np.ones(0)), found)
    )
    assert after < 0.5 * before
    assert (of.of_loads(found).q == of.likely(found)).all()
    ((joint, friction, calibrated),) = of.frictions(found)
    assert joint == JOINT and friction == pytest.approx(0.15, rel=0.1) and calibrated == pytest.approx(share * 0.15)


def test_what_a_load_winds_up_is_as_calibrated(swing):
    train = trains(swing[0], VALUES).trains[0]
    for torque in (-1.0, 0.0, 1.0):
        low, high = (of.ends(np.array([torque * of.values[2]])) for of in (train, train.rubbing(1.4)))
        np.testing.assert_allclose(low, high)


@pytest.mark.parametrize("known_as", [{"sigma": 0.01}, {"reach": 1.0}], ids=["known friction", "usual load"])
def test_what_the_calibration_knows_stays(swing, known_as):
    known, q, _, w = swing
    of = trains(known, off(VALUES, 0.8), **known_as)
    found = of.loads("", T, q, None, w)
    assert (found.friction == 1.0).all() and of.frictions(found) == ()


@pytest.mark.parametrize(("reach", "heavier"), [(0.1, True), (1.0, False)])
def test_where_usual_loads_begin_does_not_show_where_heavier_ones_do(swing, reach, heavier):
    known, q, _, w = swing
    of = trains(known, VALUES, sigma=0.01, reach=reach)
    of = replace(of, trains=(replace(of.trains[0], start=(0.9, 0.1)),))
    found = of.loads("", T, q, None, w)
    assert found.heavier == heavier
    delta = q[0, J] - of.likely(found)[0, J]
    tau, (g, c, f) = found.torque[0, J] + of.trains[0].link_inertia, VALUES[:3]
    expected = c * tau + g * np.clip(tau / f, -1.0, 1.0) if heavier else c * (tau + 0.8 * f) + 0.8 * g
    assert delta == pytest.approx(expected, abs=0.02 * g)


def test_a_hand_that_is_pushed_shows_none(swing):
    known, q, links, _ = swing
    of = trains(known, off(VALUES, 0.8))
    pushed = of.loads("", T, q, None, readings(of.description, links, HEAVY, push=40.0))
    unread = of.loads("", T, q, None, np.full((len(T), 6), np.nan))
    assert not len(pushed.friction) and of.frictions(pushed) == () and not len(unread.friction)
