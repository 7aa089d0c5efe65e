"""From the values of one robot to its parts: every stochastic one sampled from a stream of its own name."""

from dataclasses import dataclass, replace

import numpy as np

import mjcf
from twin.config.robot import ArmJoint
from twin.config.twin import RobotConfig
from twin.defects.bending import Flexibility
from twin.defects.defect import Defect
from twin.defects.differential import Differential
from twin.defects.gear import DirectDrive
from twin.defects.inertia import LinkMass
from twin.defects.placement import Placement
from twin.defects.wheels.base import Base, WheelType, ground, wheels_of
from twin.defects.wheels.wheel import Wheel
from twin.fields.names import ARM, BASE, TORSO
from twin.fields.values import point
from twin.instruments import motion_capture
from twin.instruments.encoder import Encoder, harmonics
from twin.instruments.markers import Cluster, LooseMarker
from twin.random_streams import generator
from twin.simulation.force_plates import PlateGrid, PlatePlacement

WRIST = ARM[-2:]


@dataclass(frozen=True)
class Robot:
    """One robot with its sensors and targets.

    Attributes:
        defects: What changes the body, in the order it is applied.
        encoders: Motor and link encoders.
        clusters: Marker bodies.
        wheels: Its wheels, also in the defects.
        loose: Markers that hang.
    """

    defects: tuple[Defect, ...]
    encoders: tuple[Encoder, ...]
    clusters: tuple[Cluster, ...]
    wheels: tuple[Wheel, ...]
    loose: tuple[LooseMarker, ...] = ()

    def with_defects(self, *defects: Defect) -> "Robot":
        """The robot with further defects, each in place of one of its class on the same joint, link or wheel."""
        new, own = {_place(d): d for d in defects}, {_place(d) for d in self.defects}
        kept = tuple(new.get(_place(d), d) for d in self.defects)
        found = (*kept, *(d for place, d in new.items() if place not in own))
        return replace(self, defects=found, wheels=tuple(d for d in found if isinstance(d, Wheel)) or self.wheels)


def _place(defect: Defect) -> tuple[type, str]:
    """The class of a defect and what of the robot it concerns."""
    parts = (getattr(defect, name, None) for name in ("joint_name", "link", "name"))
    return type(defect), next((part for part in parts if part), "")


def sample(config: RobotConfig, seed: int) -> Robot:
    """One robot of the series; the same seed gives the same robot."""
    base, torso = _base(config, seed), config.torso
    wheels = wheels_of(base)
    arm = {name: _joint(config, seed, joint) for name, joint in config.arm.items()}
    return Robot(
        defects=(
            PlateGrid(config.instruments.plate_grid),
            PlatePlacement(config.instruments.plate_place),
            *_placements(config, seed),
            *_masses(config, seed),
            *_gears(config, arm),
            DirectDrive(TORSO, torso.rotor_inertia, torso.servo_stiffness),
            Flexibility("torso_lift_link", torso.bending_stiffness, torso.bending_damping),
            *ground(base, wheels),
            config.payload.sample(generator(seed, "payload")),
            *config.departures.defects(),
            *(d.sample(generator(seed, "defect", str(k))) for k, d in enumerate(config.defects)),
        ),
        encoders=_encoders(config, seed, arm),
        clusters=mounted(config, seed),
        wheels=wheels,
        loose=tuple(config.departures.loosened.values()),
    )


def mounted(config: RobotConfig, seed: int, *session: str) -> tuple[Cluster, ...]:
    """The marker bodies as mounted, in the first session unless one is named."""
    bodies = config.instruments.bodies.items()
    return tuple(body.mounted(name, generator(seed, *session, "cluster", name)) for name, body in bodies)


def _placements(config: RobotConfig, seed: int) -> tuple[Placement, ...]:
    w = config.widths
    widths = np.repeat([w.placement_translation, w.placement_rotation], 3)
    xi = {n: generator(seed, "placement", n).normal(size=6) * widths for n in (TORSO, *config.arm)}
    mount = np.repeat([w.mount_translation, w.mount_rotation], 3)
    xi[next(iter(config.arm))] += generator(seed, "mount").normal(size=6) * mount
    return tuple(Placement(name, twist) for name, twist in xi.items())


def _masses(config: RobotConfig, seed: int) -> tuple[LinkMass, ...]:
    """Links of the upper body with a mass of their own; the base's never moves against the plate."""
    nominal = mjcf.model()
    links = [nominal.body(i).name for i in range(nominal.nbody)]
    heavy = [
        n for n in links if nominal.body(n).mass[0] > 0 and n.startswith(("torso", "head", "arm", "wrist", "gripper"))
    ]
    w = config.widths
    which = int(generator(seed, "make").integers(max(1, len(w.makes))))
    make: dict[str, float] = {str(link): scale for link, scale in (w.makes or ({},))[which].items()}

    def one(link: str) -> LinkMass:
        rng = generator(seed, "mass", link)
        scale = make.get(link, 1.0) * (1.0 + w.link_mass * float(rng.uniform(-1.7, 1.7)))
        return LinkMass(link, scale, point(w.link_com * rng.normal(size=3)))

    return tuple(one(link) for link in heavy)


def _joint(config: RobotConfig, seed: int, joint: ArmJoint) -> ArmJoint:
    """Gap, offset, stiffness and friction scattered about what is written."""
    spread = config.widths.spread
    wider = max(spread, config.widths.gaps_and_offsets)

    def scattered(what: str, width: float) -> float:
        return float(getattr(joint, what)) * _factor(seed, width, what, joint.joint_name)

    return replace(
        joint,
        gap=scattered("gap", wider),
        offset=scattered("offset", wider),
        stiffness=scattered("stiffness", spread),
        coulomb=scattered("coulomb", spread),
        viscous=scattered("viscous", spread),
    )


def _base(config: RobotConfig, seed: int) -> Base:
    """Stiffness along the floor and across it, and friction, of each type of wheel scattered about what is written."""
    width = config.widths.spread

    def one(name: str, of: WheelType) -> WheelType:
        (kx, ky, kz), k = of.stiffness, _factor(seed, width, "k", name)
        stiffness = (k * kx, k * ky, _factor(seed, width, "kz", name) * kz)
        return replace(of, stiffness=stiffness, friction=of.friction * _factor(seed, width, "mu", name))

    base = config.base
    return replace(
        base,
        drive=one("drive", base.drive),
        caster_front=one("caster_front", base.caster_front),
        caster_back=one("caster_back", base.caster_back),
    )


def _factor(seed: int, width: float, what: str, of: str) -> float:
    return 1.0 + width * float(generator(seed, "spread", what, of).uniform(-1.0, 1.0))


def _gears(config: RobotConfig, arm: dict[str, ArmJoint]) -> tuple[Defect, ...]:
    """Drive trains base to tip, then what friction adds to them."""
    frictions = tuple(config.friction_held.values()) if config.gear_form == "friction_held" else ()
    if not config.coupled_wrist:
        return (*arm.values(), *frictions)
    first, second = (arm[name] for name in WRIST)
    of_wrist = tuple(f for f in frictions if f.joint_name in WRIST)
    alone = [joint for name, joint in arm.items() if name not in WRIST]
    return (*alone, Differential((first, second), of_wrist), *(f for f in frictions if f.joint_name not in WRIST))


def _encoders(config: RobotConfig, seed: int, arm: dict[str, ArmJoint]) -> tuple[Encoder, ...]:
    still = (0.0, 0.0, 0.0, 0.0)
    link, motor = config.instruments.link_encoders, config.instruments.motor_encoders
    found = [Encoder(TORSO, "motor", 0.0, still, config.torso.quantum, prismatic=True)]
    for name, j in arm.items():
        waves = harmonics(generator(seed, "motor encoder", name), motor.once, motor.twice)
        found.append(Encoder(name, "motor", j.offset, waves, j.quantum))
        rng = generator(seed, "link encoder", name)
        offset = link.offset * float(rng.normal())
        found.append(Encoder(name, "link", offset, harmonics(rng, link.once, link.twice), link.quantum))
    return tuple(found)


def links_seen(config: RobotConfig, robot: Robot) -> list[str]:
    """Links whose poses the instruments depend on."""
    arm = set(motion_capture.ARM) if config.instruments.mocap.cameras else set()
    return sorted({c.link for c in robot.clusters} | {BASE} | arm)
