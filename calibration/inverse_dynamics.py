"""What the nominal robot's motion does to the force plate, and what the plate read.

    W = -(tau_1..6)(q, dq, ddq)      floating base held still, M_arm(q) a + C v + g (RNEA), root axes about the root
    M_c = R_lab_root m + (p_root - c) x R_lab_root f        about the plate centre c, lab axes [N.m]

The base is where its markers, at nominal places, are in the first second. The base's own sway is left out: at low
frequency it adds no delay, since plate / arm = (c s + K) / (I s^2 + c s + K).
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from calibration.bodies import poses_of
from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.markers import base_body
from calibration.play import play
from calibration.recording import Trial
from calibration.robot import reduced_model
from calibration.schema import Description
from calibration.se3 import inverse, mean
from calibration.signals import RATE, Signal, even, low_passed

_CUTOFF = 3.0  # [Hz] below the base's resonance
_DECIMATED = 0.01  # [s] plate samples averaged together
_HALF_GAPS = (1e-3, 4e-3)  # [rad, m] of the play terms of each joint
_MOVES = 20.0  # half gaps a joint must move to get its terms
_STRIDE = 4  # the dynamics are evaluated every so many samples: 25 Hz for signals below 3 Hz
_REST = 1.0  # [s] at the start of every trial


def floating_model(urdf: str, description: Description) -> pin.Model:
    """Free-flyer model with the measured joints and the declared payload, root joint first."""
    model = reduced_model(urdf, description.joint_names, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion(np.array([*description.gravity, 0.0, 0.0, 0.0]))
    if description.payload is not None:
        frame = model.frames[model.getFrameId(description.payload.link)]
        box = pin.Inertia(description.payload.mass, np.array(description.payload.com), np.zeros((3, 3)))
        model.inertias[frame.parentJoint] = model.inertias[frame.parentJoint] + frame.placement.act(box)
    return model


def plate_moments(trial: Trial) -> Signal:
    """Mx, My (n, 2) [N.m, lab] of all plates about the first plate's centre, low-passed, on the plate's clock."""
    force, moment = trial.plate_wrench[..., :3], trial.plate_wrench[..., 3:]
    moment = (moment + np.cross(trial.plate_centre - trial.plate_centre[0], force)).sum(axis=1)
    size = max(1, round(_DECIMATED / float(np.median(np.diff(trial.t_plate)))))
    n = len(trial.t_plate) // size * size
    t = trial.t_plate[:n].reshape(-1, size).mean(axis=1)
    return low_passed(even(t, moment[:n, :2].reshape(-1, size, 2).mean(axis=1)), _CUTOFF)


def base_moments(model: pin.Model, description: Description, trial: Trial, robot: Clock) -> tuple[Signal, np.ndarray]:
    """The same from the nominal model along q_motor, on the mocap clock, and what play and zeros add (n, k, 2)."""
    q = even(robot.to_mocap(trial.t_robot), trial.q_motor)
    lost = [play(q.x, np.full(q.x.shape[1], w)) - q.x for w in _HALF_GAPS]
    both = low_passed(replace(q, x=np.hstack([q.x, *lost, np.ones_like(q.x)])), _CUTOFF)
    order = [description.joint_names.index(name) for name in list(model.names)[2:]]
    x = both.x.reshape(len(q.t), len(lost) + 2, -1)[:, :, order]
    T_lab_root = _root_in_lab(description, trial, model)
    wrench, change = _root_wrenches(model, T_lab_root, x)
    T_c_root = pin.SE3(T_lab_root[:3, :3], T_lab_root[:3, 3] - trial.plate_centre[0])
    action = -T_c_root.dualAction[3:5]
    moves = np.ptp(q.x[:, order], axis=0) > _MOVES * _HALF_GAPS[0]
    nuisance = np.einsum("mi,niwk->nwkm", action, change[..., moves]).reshape(len(q.t), -1, 2)
    return Signal(both.t, wrench @ action.T, both.valid), nuisance


def _root_in_lab(description: Description, trial: Trial, model: pin.Model) -> np.ndarray:
    """T_lab_root (4, 4) of the first second, from the base markers at their nominal places."""
    body = base_body(description)
    T_lab_body = poses_of(body, trial).T[trial.t_mocap < trial.t_mocap[0] + _REST]
    if not np.isfinite(T_lab_body).any():
        raise NotEnoughData(f"{trial.id}: body {body.name!r} is not seen in the first second")
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    T_root_body = data.oMi[1].actInv(data.oMf[model.getFrameId(body.link)]).homogeneous
    return mean(T_lab_body) @ inverse(T_root_body)


def _root_wrenches(model: pin.Model, T_lab_root: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """RNEA's root wrench (n, 6) along x[:, 0] (n, k), and its change by x[:, w] joint by joint (n, 6, w - 1, k)."""
    data, rows = model.createData(), np.append(np.arange(0, len(x) - 1, _STRIDE), len(x) - 1)
    rates = np.gradient(x, 1.0 / RATE, axis=0)
    accelerations = np.gradient(rates, 1.0 / RATE, axis=0)
    neutral = pin.neutral(model)
    neutral[:7] = pin.SE3ToXYZQUAT(pin.SE3(T_lab_root))
    still = np.zeros(6)
    wrench, change = np.empty((len(rows), 6)), np.empty((len(rows), 6, x.shape[1] - 1, x.shape[2]))
    for k, row in enumerate(rows):
        q = pin.integrate(model, neutral, np.append(still, x[row, 0]))
        v, a = np.append(still, rates[row, 0]), np.append(still, accelerations[row, 0])
        dq, _, da = pin.computeRNEADerivatives(model, data, q, v, a)
        wrench[k] = data.tau[:6]
        change[k] = dq[:6, None, 6:] * x[row, 1:] + da[:6, None, 6:] * accelerations[row, 1:]
    every = np.arange(len(x))
    return CubicSpline(rows, wrench)(every), CubicSpline(rows, change)(every)
