"""Measured postures of any arm, from its URDF alone: kinematic, with defects of its joints and our instruments' noise.

T_hand = T_lab_base T_base_tool(q - offset, xi) T_tool_H            y = T_hand x + n
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from calibration.robot.chain import Chain, chain_of_frames

ARM = Path(__file__).parents[2] / "docs" / "six_axis_arm" / "arm.urdf"
JOINTS = tuple(f"joint_{k}" for k in range(1, 7))
SHAPE = np.array([[0.06, 0.0, 0.02], [-0.05, 0.05, 0.0], [-0.04, -0.06, 0.01], [0.0, 0.02, 0.07]])


@dataclass(frozen=True)
class MeasuredPostures:
    """Readings q (n, 6) [rad], hand poses T (n, 4, 4) and markers p (n, 4, 3) [m] in the measuring frame."""

    q: np.ndarray
    T: np.ndarray
    p: np.ndarray


def chain() -> Chain:
    return chain_of_frames(ARM.read_text(), JOINTS, "pedestal", "tool0")


def measured(seed: int, n: int, marker_sigma: float = 1e-4, encoder_sigma: float = 2e-5) -> MeasuredPostures:
    """One arm: placements off by 1 mm and 2 mrad, zeros by 10 mrad."""
    rng, nominal = np.random.default_rng(seed), chain()
    true = nominal.with_placements(np.repeat([1e-3, 2e-3], 3) * rng.normal(size=(6, 6)))
    low, high = nominal.limits
    angles = rng.uniform(0.6 * low, 0.6 * high, (n, 6))
    X = pin.SE3(pin.exp3(np.array([0.02, -0.03, 0.7])), np.array([0.5, -0.3, 0.1])).homogeneous
    Y = pin.SE3(pin.exp3(np.array([0.1, 0.0, -0.2])), np.array([0.0, 0.01, 0.05])).homogeneous
    T = X @ true.poses(angles) @ Y
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], SHAPE) + T[:, None, :3, 3]
    q = angles + 1e-2 * rng.normal(size=6) + encoder_sigma * rng.normal(size=(n, 6))
    return MeasuredPostures(q, T, p + marker_sigma * rng.normal(size=p.shape))


def write_markers(path: Path, found: MeasuredPostures) -> Path:
    """A table of markers [mm] and joints [deg]."""
    head = [f"hand{k}_{a}" for k in range(1, 5) for a in "xyz"] + list(JOINTS)
    table = np.concatenate([1e3 * found.p.reshape(len(found.p), -1), np.degrees(found.q)], axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(head), comments="", fmt="%.5f")
    return path
