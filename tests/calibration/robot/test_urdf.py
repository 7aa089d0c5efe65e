"""Masses written into a URDF, against Pinocchio."""

import numpy as np
import pinocchio as pin

import mjcf
from calibration.robot.chain import reduced_model
from calibration.robot.urdf import LinkMasses
from tests.doubles import rigid_robot


def bodies(urdf):
    return reduced_model(urdf, rigid_robot.JOINTS, pin.JointModelFreeFlyer())


NOMINAL = bodies(mjcf.urdf())
JOINTS = tuple(NOMINAL.names)[1:]


def test_each_body_has_its_share_more_and_its_centre_displaced():
    """In the axes of its joint, though its links have axes of their own."""
    rng = np.random.default_rng(0)
    links = LinkMasses(JOINTS, rng.uniform(-0.1, 0.1, len(JOINTS)), rng.uniform(-0.01, 0.01, (len(JOINTS), 3)))
    found = bodies(links.on(mjcf.urdf()))
    assert tuple(found.names)[1:] == JOINTS
    for i, share, shift in zip(range(1, found.njoints), links.share, links.shift, strict=True):
        body, nominal = found.inertias[i], NOMINAL.inertias[i]
        np.testing.assert_allclose(body.mass, nominal.mass * (1.0 + share), rtol=1e-12)
        np.testing.assert_allclose(body.lever, nominal.lever + shift, atol=1e-12)
        np.testing.assert_allclose(body.inertia, nominal.inertia * (1.0 + share), rtol=1e-9, atol=1e-12)


def test_nothing_else_of_the_robot_changes():
    none = LinkMasses(JOINTS, np.zeros(len(JOINTS)), np.zeros((len(JOINTS), 3)))
    found = bodies(none.on(mjcf.urdf()))
    q = pin.randomConfiguration(NOMINAL, -np.ones(NOMINAL.nq), np.ones(NOMINAL.nq))
    for model in (found, NOMINAL):
        np.testing.assert_array_equal(
            model.inertias[3].toDynamicParameters(), NOMINAL.inertias[3].toDynamicParameters()
        )
    one, other = (pin.centerOfMass(m, m.createData(), q) for m in (found, NOMINAL))
    np.testing.assert_array_equal(one, other)
