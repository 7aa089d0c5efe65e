"""Gravity torque of the nominal model at every measured joint.

    tau = dV/dq (q)      what the motors must give at rest [N.m, N], the base level, the declared payload in the hand

It must be asked at angles, not at raw readings: an elbow turned by 0.1 rad changes the load of the wrist.
"""

import numpy as np
import pinocchio as pin

from calibration.errors import ShapeError


def gravity_torques(model: pin.Model, measured: tuple[str, ...], q: np.ndarray) -> np.ndarray:
    """Gravity torques (n, n_measured) of a floating model held level, at joint positions q (n, n_measured) [rad, m].

    Args:
        model: As `inverse_dynamics.floating_model` builds it: root joint first, payload included.
        measured: The joints of the columns of q.
        q: Joint positions, zeros of the readings taken off.
    """
    if q.ndim != 2 or q.shape[1] != len(measured):
        raise ShapeError("q", q.shape, ("n", len(measured)))
    data, neutral = model.createData(), pin.neutral(model)
    ids = [model.joints[model.getJointId(name)].idx_v for name in measured]
    tau, step = np.empty_like(q), np.zeros(model.nv)
    for row, q_row in enumerate(q):
        step[ids] = q_row
        tau[row] = pin.computeGeneralizedGravity(model, data, pin.integrate(model, neutral, step))[ids]
    return tau
