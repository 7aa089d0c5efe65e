"""What a wheel stands by: a soft contact that sticks and slips.

    N = Kc r + Bc dr/dt       normal, sphere on plane; friction cone of coefficient mu

The law is MuJoCo's with constant impedance d: Kc = S / ((1 - d) iw), iw the inverse weight in the compiled model of
the body that carries the geom. It adds a mass d / ((1 - d) iw) to the motion of the contact, and Bc damps slip, too, at
the rate b = Bc (1 - d) iw / d.

    wheel on a bushing    d = 0.5: the mass is of the light wheel's size; b h <= 2 or friction flips its sign at every
                          step, 280 N.s/m for a 0.14 kg caster at 1 ms; it hops where Kc (1 - d) iw h^2 > 8, 2.2 MN/m
    fixed to the base     d so that b h = 1 at every wheel: the mass is h Bc, an implicit damper's, and slip ends in a
                          step. Wheels of one body that damp its slip at different rates work against each other up to
                          their friction, which then flips. The base hops on six where 6 Kc iw h^2 > 4, 21 MN/m
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.errors import TwinError
from twin.truth import Parameter

_ON_BUSHING = 0.5
_LEAST, _HEAVY = 1e-4, 0.05  # impedance that MuJoCo knows; at which h Bc makes the base too heavy
_HOPS, _BASE_HOPS = 8.0, 4.0 / 6.0  # Kc (1 - d) iw h^2, at most: of a wheel, of a base on six


class ContactTooStiff(TwinError):
    """A contact that overshoots rest within one step: its friction flips its sign, its wheel hops, or mass grows."""

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
            Chatters: Friction would flip its sign at every step, the wheel hop, or damping weigh as mass.
        """
        geom, step, shared = model.geom(geom_name), model.opt.timestep, torsion is None
        iw = float(model.body_invweight0[geom.bodyid[0], 0])
        damped = self.damping * iw * step
        d = max(damped / (1.0 + damped), _LEAST) if shared else _ON_BUSHING
        scale, hops = (1.0 - d) * iw, _BASE_HOPS if shared else _HOPS
        if shared:
            does, most = "the base heavier", _HEAVY / (1.0 - _HEAVY) / iw
        else:
            does, most = "its friction chatter", 1.0 / scale
        if self.damping * step > most:
            raise ContactTooStiff(wheel, f"damping {self.damping:g} N.s/m", does, f"{most / step:.0f} N.s/m")
        if self.stiffness * scale * step**2 > hops:
            limit = f"{hops / (scale * step**2):.2g} N/m"
            raise ContactTooStiff(wheel, f"stiffness {self.stiffness:g} N/m", "the wheel hop", limit)
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
