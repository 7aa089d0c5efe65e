"""A differential: two motors drive two joints together, so that either one's backlash and offset shows on both.

    m_1 = q_a + q_b        m_2 = q_a - q_b         motors, from joint positions; q_a = (m_1 + m_2) / 2
    mesh i: delta_i = m_i(links) - m_i(motors), |delta_i| <= gap_i / 2 but for the mesh's spring K_i

The motors are alike, so their inertia and servos are diagonal in joint coordinates too: the rotors of both joints stay
as two `Gear`s put them, and only the meshes are coupled. Torque follows from virtual work, t_a = t_1 + t_2,
t_b = t_1 - t_2: with K_i half of what the joints' own gears have, each joint is as stiff as before. The backlash of
the pair is a diamond, |q_a + q_b| <= gap_1 / 2 and |q_a - q_b| <= gap_2 / 2, about the motors' positions.

Friction in a mesh (`gear_friction`) has half of its joint's spring k_i and slider s_i. While joint b bears no torque
each mesh bears half of t_a, and joint a shows, of its own K_i, k_i, s_i,

    1 / K = sum 1 / K_i / 2       s = sum (s_i / K_i) / sum 1 / K_i       K + k = 2 / sum 1 / (K_i + k_i)
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import mujoco

from twin.defects.defect import Defect
from twin.defects.gear import Gear, add_mesh, add_servo, mesh_tendon, rotor_joint, tune_mesh
from twin.defects.gear_friction import GearFriction, friction_parameters
from twin.errors import TwinError
from twin.truth import Parameter

_SIGNS = (1.0, -1.0)


class UnlikeMotors(TwinError):
    """A differential whose two motors differ."""

    def __init__(self, first: str, second: str, what: str, values: tuple[float, float]) -> None:
        super().__init__(
            f"{first} and {second} are driven by one differential with two motors alike, "
            f"but their {what} are {values[0]:g} and {values[1]:g}; make them equal"
        )


@dataclass(frozen=True)
class Differential(Defect):
    """Two geared joints with one differential.

    Attributes:
        gears: What each joint's drive train would be alone. The mesh of motor i has the gap of gear i, and half of its
            stiffness and damping.
        frictions: The same of the friction in their meshes, of the joints that have any.
    """

    gears: tuple[Gear, Gear]
    frictions: tuple[GearFriction, ...] = ()

    def __post_init__(self) -> None:
        """Check that the motors are alike.

        Raises:
            UnlikeMotors: They are not.
        """
        a, b = self.gears
        names = ("rotor inertia", "servo stiffness", "servo damping")
        motors = ((g.rotor_inertia, *g.servo_gains) for g in self.gears)
        for what, *values in zip(names, *motors, strict=True):
            if values[0] != values[1]:
                raise UnlikeMotors(a.joint_name, b.joint_name, what, (values[0], values[1]))

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Add rotors and servos joint by joint, and the two meshes across both."""
        a, b = (g.joint_name for g in self.gears)
        for gear in self.gears:
            gear.add_rotor(spec)
        for gear, sign in zip(self.gears, _SIGNS, strict=True):
            wraps = {a: 1.0, b: sign, rotor_joint(a): -1.0, rotor_joint(b): -sign}
            add_mesh(spec, mesh_tendon(gear.joint_name), wraps, gear.gap)
            add_servo(spec, rotor_joint(gear.joint_name), *gear.servo_gains)
        for whole in self.frictions:
            replace(whole, stiffness=0.5 * whole.stiffness, slip=0.5 * whole.slip).apply(spec)

    def tune(self, model: mujoco.MjModel) -> None:
        """Give each mesh half of its gear's stiffness and damping."""
        for gear in self.gears:
            tune_mesh(model, mesh_tendon(gear.joint_name), 0.5 * gear.stiffness, 0.5 * gear.damping)

    def parameters(self) -> tuple[Parameter, ...]:
        """Of each motor's mesh, and what each joint shows of them while the other one bears no torque."""
        a, b = self.gears
        shown = {
            "backlash.{}.gap": 0.5 * (a.gap + b.gap),
            "gear.{}.compliance": 0.5 * (1.0 / a.stiffness + 1.0 / b.stiffness),
            "gear.{}.damping": 2.0 / (1.0 / a.damping + 1.0 / b.damping) if a.damping * b.damping else 0.0,
        }
        joint = {name.format(g.joint_name): value for g in self.gears for name, value in shown.items()}
        own = [p._replace(value=joint.get(p.name, p.value)) for g in self.gears for p in g.parameters()]
        for i, gear in enumerate(self.gears, 1):
            own.append(Parameter(f"differential.motor_{i}.gap", "rad", gear.gap))
            own.append(Parameter(f"differential.motor_{i}.stiffness", "N.m/rad", 0.5 * gear.stiffness))
        return (*own, *self._friction_shown())

    def _friction_shown(self) -> Iterator[Parameter]:
        """Spring and slider of both joints, what holds each link, and each motor's mesh."""
        if not self.frictions:
            return
        slips = {f.joint_name: f for f in self.frictions if f.slip > 0.0}
        of = [(f.stiffness, f.slip) if (f := slips.get(g.joint_name)) else (0.0, 0.0) for g in self.gears]
        soft = sum(1.0 / g.stiffness for g in self.gears)
        slip = sum(s / g.stiffness for (_, s), g in zip(of, self.gears, strict=True)) / soft
        series = sum(1.0 / (g.stiffness + k) for (k, _), g in zip(of, self.gears, strict=True))
        stiffness = 2.0 / series - 2.0 / soft
        holding = {f.joint_name: f.holding for f in self.frictions}
        for i, (gear, (k, s)) in enumerate(zip(self.gears, of, strict=True), 1):
            yield from friction_parameters(gear.joint_name, stiffness, slip, holding.get(gear.joint_name, 0.0))
            yield Parameter(f"differential.motor_{i}.slip", "N.m", 0.5 * s)
            yield Parameter(f"differential.motor_{i}.slip_stiffness", "N.m/rad", 0.5 * k)
