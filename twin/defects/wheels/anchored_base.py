"""The base as Nguyen et al. (Humanoids 2024) model it: every wheel a 6D spring-damper to the floor, and no contact.

    F_i = Kt_i dr_i + Ct_i d(dr_i)/dt,   M_i = Ktheta_i theta + Ctheta_i dtheta/dt,   dr_i = s + theta x r_i
    sum_i (F_i, M_i + r_i x F_i) = K (s, theta) + C d(s, theta)/dt,   as in `stiffness`

linear in the base's displacement s along its own axes and in its angles theta, from where it is placed. The base
hangs on six joints, angles before slides; K and C are springs and dampers of fixed tendons along their eigenvectors,
since a tendon of length e'x with stiffness k pulls with e k e'x. The forces are those of wheels suspended in the base's
axes that act on fixed points of the floor.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.defect import UNTOUCHED, Defect, body
from twin.defects.wheels.stiffness import spatial_stiffness
from twin.defects.wheels.wheel import Wheel
from twin.fields.names import BASE
from twin.truth import Parameter

AXES = ("x", "y", "z", "rx", "ry", "rz")
_ORDER = (3, 4, 5, 0, 1, 2)  # outermost first


@dataclass(frozen=True)
class Anchored(Defect):
    """A base on anchored wheels.

    Attributes:
        wheels: On bushings, without contacts.
    """

    wheels: tuple[Wheel, ...]

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Hang the base on its springs."""
        for wheel in self.wheels:
            wheel.fixed(spec)
            geom = spec.geom(wheel.contact_geom)
            geom.contype, geom.conaffinity = UNTOUCHED
        base = body(spec, BASE)
        for joint in base.joints:
            spec.delete(joint)
        for i in _ORDER:
            kind = mujoco.mjtJoint.mjJNT_HINGE if i >= 3 else mujoco.mjtJoint.mjJNT_SLIDE
            base.add_joint(name=f"root.{AXES[i]}", type=kind, axis=np.eye(3)[i % 3])
        K, C = spatial_stiffness(self.wheels)
        _tie(spec, "spring", K)
        _tie(spec, "damper", C)

    def parameters(self) -> tuple[Parameter, ...]:
        """Of every bushing."""
        return tuple(p for wheel in self.wheels for p in wheel.parameters())


def _tie(spec: mujoco.MjSpec, kind: str, matrix: np.ndarray) -> None:
    """A tendon for each eigenvector of a symmetric (6, 6) over the six joints."""
    values, vectors = np.linalg.eigh(matrix)
    for n, (value, vector) in enumerate(zip(values, vectors.T, strict=True)):
        tendon = spec.add_tendon(name=f"root.{kind}.{n}")
        setattr(tendon, "stiffness" if kind == "spring" else "damping", np.array([value, 0.0, 0.0]))
        for axis, share in zip(AXES, vector, strict=True):
            tendon.wrap_joint(f"root.{axis}", float(share))
