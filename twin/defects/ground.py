"""Wheels that give: each wheel on its own bushing, standing by a soft contact with friction.

    bushing:  F = k d + c dd       three slides between base and wheel, in base axes
    contact:  N = Kc r + Bc dr     normal, sphere on plane; friction cone of coefficient mu

The contact's law is MuJoCo's with constant impedance d: Kc = S / ((1 - d) iw), iw the wheel body's inverse weight in
the compiled model. The same Bc damps slip, so Bc (1 - d) iw dt <= 1 or friction flips its sign at every step: a
0.14 kg caster bears 280 N.s/m at 1 ms. d = 0.5 with three no-slip iterations holds without creep or chatter when light
wheels ride on bushings. Wheels are braked: they do not roll.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.defects.base import Defect, Parameter, body
from twin.errors import TwinError

_DIRECTIONS = "xyz"
_IMPEDANCE = 0.5


class Chatters(TwinError):
    """A contact whose friction would overshoot rest within one step and flip its sign at every step."""

    def __init__(self, wheel: str, damping: float, limit: float) -> None:
        super().__init__(
            f"contact damping {damping:g} N.s/m of {wheel!r} makes its friction chatter at this time step; "
            f"use at most {limit:.0f} N.s/m or a shorter step"
        )


@dataclass(frozen=True)
class Wheel(Defect):
    """One wheel on its bushing.

    Attributes:
        name: Wheel's name.
        body_name: Body that rides on the bushing.
        contact_geom: Its contact sphere.
        stiffness: kx, ky, kz [N/m].
        damping: cx, cy, cz [N.s/m].
        contact_stiffness: Normal [N/m].
        contact_damping: Normal [N.s/m].
        friction: Coefficient mu [-].
    """

    name: str
    body_name: str
    contact_geom: str
    stiffness: tuple[float, float, float]
    damping: tuple[float, float, float]
    contact_stiffness: float
    contact_damping: float
    friction: float

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Replace the wheel's joints by its bushing."""
        wheel = body(spec, self.body_name)
        for joint in (*wheel.joints, *(j for b in wheel.bodies for j in b.joints)):
            spec.delete(joint)
        R_base_wheel = Rotation.from_quat(wheel.quat, scalar_first=True).as_matrix()
        for i, direction in enumerate(_DIRECTIONS):
            wheel.add_joint(
                name=f"{self.name}.{direction}",
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=R_base_wheel.T[:, i],
                stiffness=np.array([self.stiffness[i], 0.0, 0.0]),
                damping=np.array([self.damping[i], 0.0, 0.0]),
            )

    def tune(self, model: mujoco.MjModel) -> None:
        """Turn contact stiffness and damping into the geom's reference parameters."""
        geom = model.geom(self.contact_geom)
        scale = (1.0 - _IMPEDANCE) * model.body_invweight0[geom.bodyid[0], 0]
        if self.contact_damping * scale * model.opt.timestep > 1.0:
            raise Chatters(self.name, self.contact_damping, 1.0 / (scale * model.opt.timestep))
        geom.solref[:] = -self.contact_stiffness * scale, -self.contact_damping * scale
        geom.solimp[:] = _IMPEDANCE, _IMPEDANCE, 0.001, 0.5, 2.0
        geom.friction[0], geom.condim[0], geom.priority[0] = self.friction, 3, 1

    def parameters(self) -> tuple[Parameter, ...]:
        """Bushing and contact; the contact carries no torsion and neither does the wheel."""
        s, c = f"suspension.{self.name}", f"contact.{self.name}"
        return (
            *(Parameter(f"{s}.k{a}", "N/m", k) for a, k in zip(_DIRECTIONS, self.stiffness, strict=True)),
            *(Parameter(f"{s}.c{a}", "N.s/m", k) for a, k in zip(_DIRECTIONS, self.damping, strict=True)),
            Parameter(f"{c}.kn", "N/m", self.contact_stiffness),
            Parameter(f"{c}.bn", "N.s/m", self.contact_damping),
            Parameter(f"{c}.mu", "-", self.friction),
        )


def spatial_stiffness(wheels: tuple[Wheel, ...], contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear K and C (6, 6) about the base frame's origin, wheels holding on the floor, gravity's part apart.

        K = sum_i A_i' diag(kx, ky, kz | Kc) A_i,   C alike,   A_i = [1, -[p_i]x],   | bushing and contact in series

    A braked sphere that tilts with the base keeps its contact point, hence p_i (n, 3) [m] are contact points.
    """
    K, C = np.zeros((6, 6)), np.zeros((6, 6))
    for wheel, (x, y, z) in zip(wheels, contacts, strict=True):
        A = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
        k, c = np.array(wheel.stiffness), np.array(wheel.damping)
        k[2], c[2] = _in_series(k[2], c[2], wheel.contact_stiffness, wheel.contact_damping)
        K += A.T @ np.diag(k) @ A
        C += A.T @ np.diag(c) @ A
    return K, C


def _in_series(k1: float, c1: float, k2: float, c2: float) -> tuple[float, float]:
    """Stiffness and damping of two spring-dampers in series, slow motion: 1 / (k + c s) to first order in s."""
    return k1 * k2 / (k1 + k2), (c1 * k2**2 + c2 * k1**2) / (k1 + k2) ** 2
