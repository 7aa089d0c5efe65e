"""What a wheel stands by: a soft contact that sticks and slips.

    N = Kc r + Bc dr/dt       normal, sphere on plane; friction cone of coefficient mu

The law is MuJoCo's with constant impedance d: Kc = S / ((1 - d) iw), iw the inverse weight in the compiled
model of the body that carries the geom. It adds a mass d / ((1 - d) iw) to the motion of the contact: of the light
wheel's size at d = 0.5 where the wheel rides on a bushing, 1 % of the base's at d = 0.01 where it is fixed to it.
The same Bc damps slip, so Bc (1 - d) iw dt <= 1 or friction flips its sign at every step: a 0.14 kg caster bears
280 N.s/m at 1 ms. A stiff one makes the wheel hop where Kc (1 - d) iw dt^2 > 8: 2.2 MN/m.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.defects.base import Parameter
from twin.errors import TwinError

_ON_BUSHING, _ON_BASE = 0.5, 0.01
_HOPS = 8.0  # Kc (1 - d) iw dt^2, at most


class Chatters(TwinError):
    """A contact that overshoots rest within one step: its friction flips its sign at every step, or its wheel hops."""

    def __init__(self, wheel: str, what: str, does: str, limit: str) -> None:
        super().__init__(
            f"contact {what} of {wheel!r} makes {does} at this time step; use at most {limit} or a shorter step"
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
            Chatters: Friction would flip its sign at every step, or the wheel hop.
        """
        d = _ON_BASE if torsion is None else _ON_BUSHING
        geom = model.geom(geom_name)
        scale = (1.0 - d) * model.body_invweight0[geom.bodyid[0], 0]
        step = model.opt.timestep
        if self.damping * scale * step > 1.0:
            limit = f"{1.0 / (scale * step):.0f} N.s/m"
            raise Chatters(wheel, f"damping {self.damping:g} N.s/m", "its friction chatter", limit)
        if self.stiffness * scale * step**2 > _HOPS:
            limit = f"{_HOPS / (scale * step**2):.2g} N/m"
            raise Chatters(wheel, f"stiffness {self.stiffness:g} N/m", "the wheel hop", limit)
        geom.solref[:] = -self.stiffness * scale, -self.damping * scale
        geom.solimp[:] = d, d, 0.001, 0.5, 2.0
        geom.friction[:] = self.friction, self.torsional_friction, self.rolling_friction
        geom.condim[0], geom.priority[0] = _condim(torsion), 1

    def parameters(self, wheel: str, torsion: np.ndarray | None) -> tuple[Parameter, ...]:
        """Normal stiffness and damping, and the frictions that a bushing's `torsion` (3,) lets act."""
        values = (
            ("kn", "N/m", self.stiffness),
            ("bn", "N.s/m", self.damping),
            ("mu", "-", self.friction),
            ("torsional_friction", "m", self.torsional_friction),
            ("rolling_friction", "m", self.rolling_friction),
        )
        acting = values[: {3: 3, 4: 4, 6: 5}[_condim(torsion)]]
        return tuple(Parameter(f"contact.{wheel}.{name}", unit, value) for name, unit, value in acting)


def _condim(torsion: np.ndarray | None) -> int:
    """Forces a contact must transmit: 3; with the moment about its normal 4; with all moments 6."""
    if torsion is None or not torsion.any():
        return 3
    return 6 if torsion[:2].any() else 4
