"""A wheel under the base: on a bushing or fixed to the base, standing on a contact or anchored in the floor.

    contact:   bushing and contact    sticks, slips and leaves a permanent offset
    anchored:  bushing alone          its lower end fixed in the floor: linear, see `anchored_base`
    rigid:     contact alone          compliant in heave and tilt, rigid in the floor's plane

Drives are braked: they do not roll, see `rolling_wheel` for those that do. Casters slide as they stand or, with a
turning force f, turn first, against the friction of bearings and scrub instead of Coulomb's law:

    m_w d(v + s')/dt = F - g,    a s'' = F - g - f sign(s')      at rest where |..| < f; s along x and along y

two slides between fork and wheel, each with friction f whatever the load; g the floor's force. a = I / r^2 is what
swivel and wheel turn at their radius. Without it the light wheel between two frictions in series needs more solver
iterations than MuJoCo makes, and creeps.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.defects.defect import Defect, Trial, body
from twin.defects.wheels.bushing import DIRECTIONS, RUBS, Bushing
from twin.defects.wheels.contact import Contact
from twin.defects.wheels.rolling_wheel import CASTER_INERTIA, let_roll
from twin.fields.names import BASE
from twin.truth import Parameter

Vector = tuple[float, float, float]
# Solver tolerance, iterations against slip and their tolerance. One rigid body's wheels share its load in more than one
# way: without the fine tolerance of both it creeps. Where each has a spring, those iterations set the accuracy.
_OWN = 1e-4, 20, 1e-9
_TWISTING = 1e-6, 20, 1e-9  # where wheels twist in their bushings, their contacts hold a moment too
_SHARED = 1e-10, 20, 1e-12
_SERIES = 1e-14  # tolerance against slip where a caster's friction in turning is in series with the floor's
_RADIUS = 0.025  # of a caster's wheel [m]
INERTIA = CASTER_INERTIA / _RADIUS**2
"""a [kg]."""


@dataclass(frozen=True)
class Wheel(Defect):
    """One wheel.

    Attributes:
        name: Wheel's name.
        body_name: Body that rides on the bushing.
        contact_geom: Its contact sphere.
        centre: Its hub, in the base frame [m].
        contact: Its point on the floor, in the base frame [m].
        bushing: Between base and wheel; None: fixed to the base.
        footing: Between wheel and floor; None: anchored.
        turning_force: Of a caster along x and along y [N]; 0: it does not turn.
        rolls: Whether its brake is off, under a base that drives; a caster then swivels instead of turning.
    """

    name: str
    body_name: str
    contact_geom: str
    centre: Vector
    contact: Vector
    bushing: Bushing | None
    footing: Contact | None
    turning_force: float = 0.0
    rolls: bool = False

    def at(self, trial: Trial, time: float) -> "Wheel":
        """The wheel let loose, where the base drives."""
        return replace(self, rolls=True) if trial.rolls else self

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Replace the wheel's joints by its bushing."""
        wheel = self.fixed(spec)
        if self.bushing is not None:
            T_base_wheel = _pose_in_base(wheel)
            R, inertia = T_base_wheel[:3, :3], CASTER_INERTIA if wheel.bodies else 0.0
            self.bushing.hang(wheel, self.name, R.T, R.T @ (np.array(self.centre) - T_base_wheel[:3, 3]), inertia)
        if self.rolls:
            let_roll(spec, wheel, self.name)
        elif self.turning_force > 0.0:
            (hub,) = wheel.bodies
            let_turn(hub, self.name, _pose_in_base(hub)[:2, :3], self.turning_force)

    def fixed(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Delete the wheel's joints."""
        wheel = body(spec, self.body_name)
        for joint in (*wheel.joints, *(j for b in wheel.bodies for j in b.joints)):
            spec.delete(joint)
        return wheel

    def tune(self, model: mujoco.MjModel) -> None:
        """Turn the contact's stiffness and damping into reference parameters."""
        if self.footing is not None:
            torsion = self._torsion
            self.footing.tune(model, self.name, self.contact_geom, torsion)
            option = model.opt
            twists = torsion is not None and torsion.any()
            solver = _SHARED if torsion is None else _TWISTING if twists else _OWN
            option.tolerance, option.noslip_iterations, noslip = solver
            if self.bushing is None:
                option.noslip_tolerance = noslip
            else:
                noslip = _SERIES if self.turning_force > 0.0 else noslip
                option.noslip_tolerance = min(option.noslip_tolerance, noslip)  # wheels differ, the finest decides
                self.bushing.check_torsion(model, self.name)
                self.bushing.tune_held(model, self.name, self.body_name, self.contact_geom)

    @property
    def _torsion(self) -> np.ndarray | None:
        return None if self.bushing is None else np.array(self.bushing.torsion)

    def parameters(self) -> tuple[Parameter, ...]:
        """Bushing and contact, what there is of them."""
        found: list[Parameter] = []
        if self.bushing is not None:
            for letter, unit, values in (("k", "", self.bushing.k), ("c", ".s", self.bushing.c)):
                s = f"suspension.{self.name}.{letter}"
                found += [
                    Parameter(f"{s}{a}", f"N{unit}/m", float(v)) for a, v in zip(DIRECTIONS, values, strict=False)
                ]
                if np.any(self.bushing.torsion):
                    turning = zip(DIRECTIONS, values[3:], strict=True)
                    found += [Parameter(f"{s}r{a}", f"N.m{unit}/rad", float(v)) for a, v in turning]
            if self.bushing.guide_friction > 0.0:
                found.append(Parameter(f"suspension.{self.name}.guide_friction", "N", self.bushing.guide_friction))
        if self.turning_force > 0.0:
            found.append(Parameter(f"suspension.{self.name}.turning_force", "N", self.turning_force))
            found.append(Parameter(f"suspension.{self.name}.turning_inertia", "kg", INERTIA))
        if self.footing is not None:
            found += self.footing.parameters(self.name, self._torsion)
        return tuple(found)


def _pose_in_base(found: mujoco.MjsBody) -> np.ndarray:
    """T_base_body (4, 4) along the parents."""
    T = np.eye(4)
    while found.name != BASE:
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_quat(found.quat, scalar_first=True).as_matrix(), found.pos
        T, found = step @ T, found.parent
    return T


def let_turn(hub: mujoco.MjsBody, wheel: str, axes: np.ndarray, force: float) -> None:
    """Add the slides along axes (2, 3) of the body on the floor, each with a dry friction [N]."""
    for axis, letter in zip(axes, DIRECTIONS, strict=False):
        hub.add_joint(
            name=f"{wheel}.turn_{letter}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=axis,
            armature=INERTIA,
            frictionloss=force,
            solref_friction=RUBS,
        )
