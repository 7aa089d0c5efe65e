"""A caster that turns where it would slide: it swivels and rolls against bearings and scrub, not against Coulomb's law.

    m_w d(v + s')/dt = F - g,    a s'' = F - g - f sign(s')      held where |..| < f; s along x and along y

Two slides between fork and wheel, each held by f whatever the load; g the floor's force. a = I / r^2 is what swivel and
wheel turn at their radius. Without it the light wheel between two frictions in series is found by more sweeps than
MuJoCo makes, and creeps.
"""

import mujoco
import numpy as np

from twin.defects.bushing import DIRECTIONS, RUBS

CASTER_INERTIA = 5e-4
"""Of a caster's wheel and of its swivel each, bearings and tyre included [kg.m2]."""

_RADIUS = 0.025  # of a caster's wheel [m]
INERTIA = CASTER_INERTIA / _RADIUS**2
"""a [kg]."""


def let_turn(hub: mujoco.MjsBody, wheel: str, axes: np.ndarray, force: float) -> None:
    """Add the slides along axes (2, 3) of the body that stands on the floor, each held by a force [N]."""
    for axis, letter in zip(axes, DIRECTIONS, strict=False):
        hub.add_joint(
            name=f"{wheel}.turn_{letter}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=axis,
            armature=INERTIA,
            frictionloss=force,
            solref_friction=RUBS,
        )
