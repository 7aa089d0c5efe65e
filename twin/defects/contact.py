"""What a wheel stands by: a soft contact that sticks and slips.

    N = Kc r + Bc dr/dt       normal, sphere on plane; friction cone of coefficient mu

The law is MuJoCo's with constant impedance d: Kc = S / ((1 - d) iw), iw the inverse weight in the compiled
model of the body that carries the geom. It adds a mass d / ((1 - d) iw) to the motion of the contact: of the light
wheel's size at d = 0.5 where the wheel rides on a bushing, 1 % of the base's at d = 0.01 where it is fixed to it.
The same Bc damps slip, so Bc (1 - d) iw dt <= 1 or friction flips its sign at every step: a 0.14 kg caster bears
280 N.s/m at 1 ms.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.base import Parameter
from twin.errors import TwinError

_ON_BUSHING, _ON_BASE = 0.5, 0.01


class Chatters(TwinError):
    """A contact whose friction would overshoot rest within one step and flip its sign at every step."""

    def __init__(self, wheel: str, damping: float, limit: float) -> None:
        super().__init__(
            f"contact damping {damping:g} N.s/m of {wheel!r} makes its friction chatter at this time step; "
            f"use at most {limit:.0f} N.s/m or a shorter step"
        )


class TurnsLate(TwinError):
    """A bushing's torsional damping that the inertia of its wheel cannot follow within a step."""

    def __init__(self, wheel: str, damping: float, limit: float) -> None:
        super().__init__(
            f"torsional damping {damping:g} N.m.s/rad of {wheel!r} is more than its light wheel can turn against "
            f"at this time step: the base would feel another; use at most {limit:.1g} or anchored wheels"
        )


@dataclass(frozen=True)
class Contact:
    """A soft contact.

    Attributes:
        stiffness: Normal [N/m].
        damping: Normal [N.s/m].
        friction: Coefficient mu [-].
        torsional_friction: Moment about the normal over normal force, at most [m]; used where the bushing twists.
        rolling_friction: Moment about the tangents over normal force, at most [m]; used where the bushing tilts.
    """

    stiffness: float
    damping: float
    friction: float
    torsional_friction: float = 0.0
    rolling_friction: float = 0.0

    def tune(self, model: mujoco.MjModel, wheel: str, geom_name: str, torsion: np.ndarray | None) -> None:
        """Set the geom's reference parameters; `torsion` (3,) of the bushing, None where there is no bushing.

        Raises:
            Chatters: Friction would flip its sign at every step.
        """
        d = _ON_BASE if torsion is None else _ON_BUSHING
        geom = model.geom(geom_name)
        scale = (1.0 - d) * model.body_invweight0[geom.bodyid[0], 0]
        if self.damping * scale * model.opt.timestep > 1.0:
            raise Chatters(wheel, self.damping, 1.0 / (scale * model.opt.timestep))
        geom.solref[:] = -self.stiffness * scale, -self.damping * scale
        geom.solimp[:] = d, d, 0.001, 0.5, 2.0
        geom.friction[:] = self.friction, self.torsional_friction, self.rolling_friction
        geom.condim[0], geom.priority[0] = _condim(torsion), 1

    def parameters(self, wheel: str) -> tuple[Parameter, ...]:
        """Normal stiffness and damping, friction."""
        return (
            Parameter(f"contact.{wheel}.kn", "N/m", self.stiffness),
            Parameter(f"contact.{wheel}.bn", "N.s/m", self.damping),
            Parameter(f"contact.{wheel}.mu", "-", self.friction),
        )


def _condim(torsion: np.ndarray | None) -> int:
    """Forces a contact must transmit: 3; with the moment about its normal 4; with all moments 6."""
    if torsion is None or not torsion.any():
        return 3
    return 6 if torsion[:2].any() else 4
