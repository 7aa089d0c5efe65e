"""A wheel that rolls: the one under the base of a robot that drives.

    drive     the wheel turns on its hub; servo torque kp (u - a) - kv da/dt: a velocity loop with integral
    caster    the fork swivels on its bushing, the wheel rolls in the fork, trailing behind the swivel's axis

Both against dry friction, which takes the place of a standing caster's turning force. Bushing and contact are those
of the standing wheel.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from twin.defects.defect import Defect, body
from twin.defects.gear import add_servo
from twin.defects.wheels.wheel import CASTER_INERTIA, Wheel
from twin.truth import Parameter

DRIVES = ("wheel_left", "wheel_right")
_AXIS = np.array([0.0, 0.0, 1.0])  # of every hub and swivel, in its own body
_SERVO = (2000.0, 60.0)  # of a drive [N.m/rad, N.m.s/rad]
_ROTOR = 0.05  # motor of a drive, reflected [kg.m2]
_SWIVEL = (0.02, 0.01)  # dry friction [N.m] and damping [N.m.s/rad] of a swivel, the tyre's scrub included
_ROLL = (0.02, 1e-3)  # of a caster's wheel


def roll_joint(wheel: str) -> str:
    """Name of the joint, and of a drive's servo, about which a wheel rolls."""
    return f"{wheel}.roll"


@dataclass(frozen=True)
class Rolling(Defect):
    """A standing wheel let loose.

    Attributes:
        wheel: As it stands.
    """

    wheel: Wheel

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Add hub, swivel and servo behind the wheel's bushing."""
        replace(self.wheel, turning_force=0.0).apply(spec)
        carrier, name = body(spec, self.wheel.body_name), self.wheel.name
        if name in DRIVES:
            carrier.add_joint(name=roll_joint(name), type=mujoco.mjtJoint.mjJNT_HINGE, axis=_AXIS, armature=_ROTOR)
            add_servo(spec, roll_joint(name), *_SERVO)
            return
        (hub,) = carrier.bodies
        _free(carrier, f"{name}.swivel", *_SWIVEL)
        _free(hub, roll_joint(name), *_ROLL)

    def tune(self, model: mujoco.MjModel) -> None:
        """As the standing wheel."""
        self.wheel.tune(model)

    def parameters(self) -> tuple[Parameter, ...]:
        """Of what lets it roll; those of the standing wheel are its own."""
        name = f"rolling.{self.wheel.name}"
        if self.wheel.name in DRIVES:
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
