"""A wheel that rolls: the one under the base of a robot that drives.

    drive     the wheel turns on its hub; servo torque kp (u - a) - kv da/dt: a velocity loop with integral
    caster    the fork swivels on its bushing, the wheel rolls in the fork, trailing behind the swivel's axis

Both against dry friction, which takes the place of a standing caster's turning force. Bushing and contact are those
of the standing wheel.
"""

import mujoco
import numpy as np

from twin.defects.gear import add_servo
from twin.truth import Parameter

DRIVES = ("wheel_left", "wheel_right")
CASTER_INERTIA = 5e-4
"""Of a caster's wheel and of its swivel each, bearings and tyre included [kg.m2]."""
_AXIS = np.array([0.0, 0.0, 1.0])  # of every hub and swivel, in its own body
_SERVO = (2000.0, 60.0)  # of a drive [N.m/rad, N.m.s/rad]
_ROTOR = 0.05  # motor of a drive, reflected [kg.m2]
_SWIVEL = (0.02, 0.01)  # dry friction [N.m] and damping [N.m.s/rad] of a swivel, the tyre's scrub included
_ROLL = (0.02, 1e-3)  # of a caster's wheel


def roll_joint(wheel: str) -> str:
    """Name of the joint, and of a drive's servo, about which a wheel rolls."""
    return f"{wheel}.roll"


def let_roll(spec: mujoco.MjSpec, carrier: mujoco.MjsBody, wheel: str) -> None:
    """Add hub, swivel and servo to the body that rides on a standing wheel's bushing."""
    if wheel in DRIVES:
        carrier.add_joint(name=roll_joint(wheel), type=mujoco.mjtJoint.mjJNT_HINGE, axis=_AXIS, armature=_ROTOR)
        add_servo(spec, roll_joint(wheel), *_SERVO)
        return
    (hub,) = carrier.bodies
    _free(carrier, f"{wheel}.swivel", *_SWIVEL)
    _free(hub, roll_joint(wheel), *_ROLL)


def rolling_parameters(wheel: str) -> tuple[Parameter, ...]:
    """Of what lets a wheel roll; those of the standing wheel are its own."""
    name = f"rolling.{wheel}"
    if wheel in DRIVES:
        values = (("servo_stiffness", "N.m/rad", _SERVO[0]), ("servo_damping", "N.m.s/rad", _SERVO[1]))
        return (
            *(Parameter(f"{name}.{n}", unit, value) for n, unit, value in values),
            Parameter(f"{name}.rotor_inertia", "kg.m2", _ROTOR),
        )
    units = (("friction", "N.m"), ("damping", "N.m.s/rad"), ("inertia", "kg.m2"))
    return tuple(
        Parameter(f"{name}.{of}_{what}", unit, value)
        for of, values in (("swivel", _SWIVEL), ("roll", _ROLL))
        for (what, unit), value in zip(units, (*values, CASTER_INERTIA), strict=True)
    )


def _free(carrier: mujoco.MjsBody, name: str, friction: float, damping: float) -> None:
    joint = carrier.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=_AXIS, armature=CASTER_INERTIA)
    joint.frictionloss, joint.damping = friction, np.array([damping, 0.0, 0.0])
