"""The elastic part between the base and one wheel, in base axes.

F = k s + c ds/dt                 three slides
M = k_r phi + c_r dphi/dt         hinges about the hub, where the wheel can turn against the base
"""

from dataclasses import dataclass

import mujoco
import numpy as np

Vector = tuple[float, float, float]
DIRECTIONS = "xyz"
_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Bushing:
    """Springs and dampers of one wheel.

    Attributes:
        stiffness: kx, ky, kz [N/m].
        damping: cx, cy, cz [N.s/m].
        torsion: krx, kry, krz [N.m/rad]; 0: the wheel is fixed to the base about that axis.
        torsion_damping: crx, cry, crz [N.m.s/rad].
    """

    stiffness: Vector
    damping: Vector
    torsion: Vector = _NONE
    torsion_damping: Vector = _NONE

    @property
    def k(self) -> np.ndarray:
        """(6,) [N/m, N.m/rad]."""
        return np.array([*self.stiffness, *self.torsion])

    @property
    def c(self) -> np.ndarray:
        """(6,) [N.s/m, N.m.s/rad]."""
        return np.array([*self.damping, *self.torsion_damping])

    def hang(self, wheel: mujoco.MjsBody, name: str, R_wheel_base: np.ndarray, hub: np.ndarray) -> None:
        """Add the joints to a wheel's body: its axes in base axes (3, 3), its hub (3,) in its own frame [m]."""
        slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
        for i, (k, c) in enumerate(zip(self.k, self.c, strict=True)):
            if i < 3 or k > 0.0:
                wheel.add_joint(
                    name=joint_name(name, i),
                    type=slide if i < 3 else hinge,
                    pos=hub,
                    axis=R_wheel_base[:, i % 3],
                    stiffness=np.array([k, 0.0, 0.0]),
                    damping=np.array([c, 0.0, 0.0]),
                )


def joint_name(wheel: str, i: int) -> str:
    """Name of the joint along x, y, z or about them, i = 0 to 5."""
    return f"{wheel}.{'r' if i >= 3 else ''}{DIRECTIONS[i % 3]}"
