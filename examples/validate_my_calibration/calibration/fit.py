"""Least squares over the markers of the hand, seen from the base.

    r = T_base_body p_body - T_base_hand(q - offset) T_hand_marker m

p_body: hand markers in the frame of the base's markers (measured); m: hand markers as nominal in dataset.json.
Unknown: both marker frames (translation [m], rotation vector [rad]) and one zero a joint [rad, m].
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from calibration.postures import Postures, read_postures

AXES = ("x", "y", "z", "rx", "ry", "rz")


def calibrate(dataset: Path, out: Path) -> Path:
    """Write out/estimate.json from a dataset folder; return its path."""
    described = json.loads((dataset / "dataset.json").read_text(encoding="utf-8"))
    bodies = {body["link"]: body for body in described["bodies"]}
    base, hand = bodies[described["base_frame"]], bodies[described["tool_frame"]]
    postures = read_postures(dataset, base["name"], hand["name"])
    model = pin.buildModelFromUrdf(str(dataset / "nominal.urdf"))
    theta = fit(model, described["tool_frame"], postures, *(drawn(body) for body in (base, hand)))
    names = [f"frame.base.{base['name']}.{a}" for a in AXES] + [f"frame.tool.hand.{a}" for a in AXES]
    names += [f"encoder.{joint}.motor.offset" for joint in postures.joints]
    parameters = [{"name": name, "value": float(value)} for name, value in zip(names, theta, strict=True)]
    out.mkdir(parents=True, exist_ok=True)
    path = out / "estimate.json"
    estimate = {"schema": 1, "main": "mine", "models": {"mine": {"parameters": parameters}}}
    path.write_text(json.dumps(estimate), encoding="utf-8")
    return path


def fit(model: pin.Model, tool: str, postures: Postures, base: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """Unknowns (12 + n_joints,) from the postures; `base` and `hand` are the markers as nominal (n, 3)."""
    data, frame, n = model.createData(), model.getFrameId(tool), len(postures.joints)
    columns = [model.joints[model.getJointId(name)].idx_q for name in postures.joints]
    bodies = [rigid(base, seen) for seen in postures.base]
    seen = np.array([(hand - T.translation) @ T.rotation for T, hand in zip(bodies, postures.hand, strict=True)])

    def residual(theta: np.ndarray) -> np.ndarray:
        T_base_body, T_tool_hand = (pose(v) for v in (theta[:6], theta[6:12]))
        errors = []
        for reading, markers in zip(postures.q, seen, strict=True):
            q = pin.neutral(model)
            q[columns] = reading - theta[12:]
            pin.framesForwardKinematics(model, data, q)
            T = T_base_body.inverse() * data.oMf[frame] * T_tool_hand
            errors.append(hand @ T.rotation.T + T.translation - markers)
        prior = theta / np.concatenate([np.full(12, 0.02), np.full(n, 0.06)]) * 1e-4
        return np.concatenate([np.ravel(errors), prior])

    return np.asarray(least_squares(residual, np.zeros(12 + n), method="lm").x)


def pose(vector: np.ndarray) -> pin.SE3:
    """Pose of a translation [m] and a rotation vector [rad] (6,)."""
    return pin.SE3(pin.exp3(vector[3:]), vector[:3])


def drawn(body: dict) -> np.ndarray:
    """Markers of a body as nominal (n, 3) [m, body frame]."""
    return np.array([marker["xyz"] for marker in body["markers"]])


def rigid(drawn: np.ndarray, seen: np.ndarray) -> pin.SE3:
    """Pose of a body whose markers are drawn at (n, 3) and seen at (n, 3), by least squares."""
    U, _, V = np.linalg.svd((seen - seen.mean(axis=0)).T @ (drawn - drawn.mean(axis=0)))
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V
    return pin.SE3(R, seen.mean(axis=0) - R @ drawn.mean(axis=0))
