"""The elastic part between the base and one wheel, in base axes.

F = k s + c ds/dt                 three slides; + f sign(ds/dt) along z, where the wheel is guided
M = k_r phi + c_r dphi/dt         hinges about the hub, where the wheel can turn against the base

Where friction holds a wheel of mass m, MuJoCo finds the friction for m alone and then steps with m + h c, since
damping is implicit. The excess h c dv of a step is taken up by the contact's own damping of slip, dv_w/dt = -b v_w:
the wheel runs ahead by c / (m b) of the base's speed, and its spring takes h k / (m b) of the damping away (10 % at a
caster, 1 ms). `tune_held` restores that.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.errors import TwinError

Vector = tuple[float, float, float]
DIRECTIONS = "xyz"
_Z = 2
RUBS = (0.002, 1.0)
"""Reference of a friction that holds: MuJoCo's default, 0.02 s, lets a guide creep at half its friction."""

_AHEAD = 0.5  # h k / (m b), at most
_LATE = 0.1  # h c_r / I, at most
_STIFF = 2.0  # h^2 k_r / I, at most; a lifted wheel runs away at 4
_NONE = (0.0, 0.0, 0.0)


class BushingTooStiff(TwinError):
    """A bushing so stiff that its wheel, which sticks, would follow the base within a step."""

    def __init__(self, wheel: str, stiffness: float, limit: float) -> None:
        super().__init__(
            f"stiffness {stiffness:g} N/m in the floor's plane is more than the light wheel {wheel!r} bears at this "
            f"time step; use at most {limit:.2g} N/m, more contact damping, a shorter step or anchored wheels"
        )


class TorsionTooStiff(TwinError):
    """A bushing's torsion that the inertia of its wheel cannot follow within a step."""

    def __init__(self, wheel: str, what: str, limit: str) -> None:
        super().__init__(
            f"torsional {what} of {wheel!r} is more than its light wheel can turn against at this time step: "
            f"the base would receive another; use at most {limit}, a shorter step or anchored wheels"
        )


@dataclass(frozen=True)
class Bushing:
    """Springs and dampers of one wheel.

    Attributes:
        stiffness: kx, ky, kz [N/m].
        damping: cx, cy, cz [N.s/m].
        torsion: krx, kry, krz [N.m/rad]; 0: the wheel is fixed to the base about that axis.
        torsion_damping: crx, cry, crz [N.m.s/rad].
        guide_friction: f [N].
    """

    stiffness: Vector
    damping: Vector
    torsion: Vector = _NONE
    torsion_damping: Vector = _NONE
    guide_friction: float = 0.0

    @property
    def k(self) -> np.ndarray:
        """(6,) [N/m, N.m/rad]."""
        return np.array([*self.stiffness, *self.torsion])

    @property
    def c(self) -> np.ndarray:
        """(6,) [N.s/m, N.m.s/rad]."""
        return np.array([*self.damping, *self.torsion_damping])

    def hang(self, wheel: mujoco.MjsBody, name: str, R_wheel_base: np.ndarray, hub: np.ndarray, inertia: float) -> None:
        """Add the joints to a wheel's body: its axes in base axes (3, 3), its hub (3,) in its own frame [m].

        And what turns with the wheel where it twists, beyond its own inertia [kg.m2].
        """
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
                    armature=inertia if i >= 3 else 0.0,
                    frictionloss=self.guide_friction if i == _Z else 0.0,
                    solref_friction=RUBS,
                )

    def check_torsion(self, model: mujoco.MjModel, name: str) -> None:
        """The contact holds the wheel by its inertia I alone, spring and damper act on what it holds.

        Raises:
            TurnsLate: The wheel is too light for them.
        """
        step = model.opt.timestep
        for i in np.flatnonzero(self.torsion):
            inertia = float(model.dof_M0[model.joint(joint_name(name, 3 + int(i))).dofadr[0]])
            k, c, most_k, most_c = self.torsion[i], self.torsion_damping[i], _STIFF / step**2, _LATE / step
            if c > most_c * inertia:
                raise TorsionTooStiff(name, f"damping {c:g} N.m.s/rad", f"{most_c * inertia:.1g} N.m.s/rad")
            if k > most_k * inertia:
                raise TorsionTooStiff(name, f"stiffness {k:g} N.m/rad", f"{most_k * inertia:.2g} N.m/rad")

    def tune_held(self, model: mujoco.MjModel, name: str, body_name: str, geom_name: str) -> None:
        """Give back the damping that a wheel loses in the floor's plane while friction holds it.

        Raises:
            RunsAhead: The wheel is too light for its springs.
        """
        mass, geom = float(model.body_subtreemass[model.body(body_name).id]), model.geom(geom_name)
        per_stiffness = model.opt.timestep / (mass * -float(geom.solref[1] / geom.solimp[1]))
        if max(self.stiffness[:2]) * per_stiffness > _AHEAD:
            raise BushingTooStiff(name, max(self.stiffness[:2]), _AHEAD / per_stiffness)
        for i in range(2):
            model.joint(joint_name(name, i)).damping[0] = self.damping[i] / (1.0 - self.stiffness[i] * per_stiffness)


def joint_name(wheel: str, i: int) -> str:
    """Name of the joint along x, y, z or about them, i = 0 to 5."""
    return f"{wheel}.{'r' if i >= 3 else ''}{DIRECTIONS[i % 3]}"
