"""The nominal robot on a free-flying base, with its declared payload."""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from calibration.recording.schema import Description
from calibration.robot.chain import reduced_model


def floating_model(urdf: str, description: Description) -> pin.Model:
    """Free-flyer model with the measured joints and the declared payload, root joint first."""
    model = reduced_model(urdf, description.joint_names, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion(np.array([*description.gravity, 0.0, 0.0, 0.0]))
    if description.payload is not None:
        frame = model.frames[model.getFrameId(description.payload.link)]
        box = pin.Inertia(description.payload.mass, np.array(description.payload.com), np.zeros((3, 3)))
        model.inertias[frame.parentJoint] = model.inertias[frame.parentJoint] + frame.placement.act(box)
    return model


def configurations(model: pin.Model, T_lab_root: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Configurations (n, nq) of a floating model from root poses (n, 4, 4) and joints q (n, k) in the model's order."""
    root = np.hstack([T_lab_root[:, :3, 3], Rotation.from_matrix(T_lab_root[:, :3, :3]).as_quat()])
    if model.nq - 7 == q.shape[1]:
        return np.hstack([root, q])
    neutral, still = pin.neutral(model), np.zeros(6)  # continuous joints are stored as cosine and sine
    joints = np.array([pin.integrate(model, neutral, np.concatenate([still, row]))[7:] for row in q])
    return np.hstack([root, joints])


def root_wrenches(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Wrench (n, 6) [N, N.m] of the world on the root, root axes and origin, by RNEA.

    Args:
        model: Floating model.
        q: Configurations (n, nq).
        v: Velocities (n, nv), root twist first.
        a: Accelerations (n, nv).
    """
    data = model.createData()
    return np.array([pin.rnea(model, data, *row)[:6] for row in zip(q, v, a, strict=True)]).reshape(-1, 6)
