"""What a column that sways puts on the floor, against Pinocchio's momentum of all that it carries."""

import numpy as np
import pinocchio as pin

import mjcf
from calibration.robot.laboratory import Laboratory
from calibration.stages.suspension.floor_wrench import motion_load, root_in_base
from tests.doubles import rigid_robot

LAB = Laboratory(mjcf.urdf(), rigid_robot.described())
T = np.arange(0.0, 3.0, 0.01)
Q = np.array([0.1, 0.4, -0.3, 0.2, 1.1, 0.3, -0.4, 0.2])
RATE = 2.0 * np.pi * 4.0


def test_a_column_that_sways_acts_on_the_floor():
    q, lean = np.tile(Q, (len(T), 1)), 1e-3 * np.column_stack([np.sin(RATE * T), 0.5 * np.cos(RATE * T)])
    rigid, swaying = (motion_load(LAB, T, x, np.eye(4), 20.0).signal.x for x in (q, np.hstack([q, lean])))
    model = LAB.floating
    data, at = model.createData(), pin.neutral(model)
    for name, angle in zip(rigid_robot.JOINTS, Q, strict=True):
        at[model.joints[model.getJointId(name)].idx_q] = angle
    pin.forwardKinematics(model, data, at)
    carried = pin.Inertia.Zero()
    for i in range(2, model.njoints):
        carried += data.oMi[1].actInv(data.oMi[i]).act(model.inertias[i])
    leans = [data.oMi[1].actInv(data.oMi[2]).act(pin.Motion(np.eye(6)[3 + axis])) for axis in range(2)]
    to_base = root_in_base(model, LAB.description)
    acts = -np.array([to_base.act(carried * S).vector for S in leans])
    expected, inner = (-(RATE**2) * lean) @ acts, slice(50, -50)
    assert np.abs(expected[inner]).max() > 1.0  # [N.m]
    np.testing.assert_allclose((swaying - rigid)[inner], expected[inner], atol=0.01 * np.abs(expected).max())
