"""From what a scenario says to one robot: every stochastic defect drawn from a stream of its own name."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import mjcf
from twin.config.instruments import MarkerBody
from twin.config.twin import TwinConfig
from twin.defects.bending import Cable, Flexibility
from twin.defects.defect import Defect
from twin.defects.differential import Differential
from twin.defects.gear import DirectDrive, Gear
from twin.defects.gear_friction import GearFriction
from twin.defects.inertia import LinkMass, Payload
from twin.defects.placement import Placement
from twin.defects.thermal_drift import Warming
from twin.defects.wheels.from_config import ground, wheels_of
from twin.defects.wheels.wheel import Wheel
from twin.instruments import motion_capture
from twin.instruments.encoder import Encoder
from twin.instruments.markers import Cluster, LooseMarker
from twin.random_streams import generator
from twin.simulation.build import HAND
from twin.simulation.force_plates import FloorTilt, PlateGrid, PlatePlacement

TORSO = "torso_lift_joint"
TOOL = HAND
BASE = "base_footprint"
WRIST = ("arm_6_joint", "arm_7_joint")
_LINK_INERTIA = 0.004  # [kg.m2] output gear of an arm joint
_DAMPING_RATIO = 1.2  # servo velocity gain over sqrt(kp J)


@dataclass(frozen=True)
class Robot:
    """One drawn robot with its sensors and targets.

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


def sample(config: TwinConfig, seed: int) -> Robot:
    """One robot of the series; the same seed gives the same robot."""
    wheels = wheels_of(config.base)
    return Robot(
        defects=(
            PlateGrid(config.instruments.plate_grid),
            PlatePlacement(config.instruments.plate_place),
            *_placements(config, seed),
            *_masses(config, seed),
            *_gears(config, seed),
            _torso_drive(config),
            Flexibility("torso_lift_link", config.torso.bending_stiffness, config.torso.bending_damping),
            *ground(config.base, wheels),
            _payload(config, seed),
            *_departures(config),
        ),
        encoders=_encoders(config, seed),
        clusters=tuple(cluster(name, body, seed) for name, body in config.instruments.bodies.items()),
        wheels=wheels,
        loose=tuple(LooseMarker(n, m.sag, m.since) for n, m in config.departures.loosened.items()),
    )


def _placements(config: TwinConfig, seed: int) -> tuple[Placement, ...]:
    w = config.widths
    widths = np.repeat([w.placement_translation, w.placement_rotation], 3)
    xi = {n: generator(seed, "placement", n).normal(size=6) * widths for n in (TORSO, *config.arm)}
    mount = np.repeat([w.mount_translation, w.mount_rotation], 3)
    xi[next(iter(config.arm))] += generator(seed, "mount").normal(size=6) * mount
    return tuple(Placement(name, twist) for name, twist in xi.items())


def _masses(config: TwinConfig, seed: int) -> tuple[LinkMass, ...]:
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
        return LinkMass(link, scale, w.link_com * rng.normal(size=3))

    return tuple(one(link) for link in heavy)


def _factor(config: TwinConfig, seed: int, *names: str) -> float:
    return 1.0 + config.widths.spread * float(generator(seed, "spread", *names).uniform(-1.0, 1.0))


def _gears(config: TwinConfig, seed: int) -> tuple[Defect, ...]:
    """Drive trains base to tip, then what friction adds to them."""
    alone = [_gear(config, seed, name) for name in config.arm]
    trains: list[Defect] = [g for g in alone if not (config.coupled_wrist and g.joint_name in WRIST)]
    held = config.friction_held.items() if config.gear_form == "friction_held" else ()
    frictions = [GearFriction(name, h.stiffness, h.slip, h.holding) for name, h in held]
    if config.coupled_wrist:
        first, second = (g for g in alone if g.joint_name in WRIST)
        trains.append(Differential((first, second), tuple(f for f in frictions if f.joint_name in WRIST)))
    return (*trains, *(f for f in frictions if not (config.coupled_wrist and f.joint_name in WRIST)))


def _gear(config: TwinConfig, seed: int, name: str) -> Gear:
    j = config.arm[name]
    return Gear(
        joint_name=name,
        gap=j.gap * _factor(config, seed, "gap", name),
        stiffness=j.stiffness,
        damping=j.damping,
        coulomb=j.coulomb,
        viscous=j.viscous,
        rotor_inertia=j.rotor_inertia,
        link_inertia=_LINK_INERTIA,
        servo_stiffness=j.servo_stiffness,
        servo_damping=_DAMPING_RATIO * float(np.sqrt(j.servo_stiffness * j.rotor_inertia)),
    )


def _torso_drive(config: TwinConfig) -> DirectDrive:
    t = config.torso
    damping = _DAMPING_RATIO * float(np.sqrt(t.servo_stiffness * t.rotor_inertia))
    return DirectDrive(TORSO, t.rotor_inertia, t.servo_stiffness, damping)


def _departures(config: TwinConfig) -> tuple[Defect, ...]:
    """Those the scenario names, none by default."""
    d = config.departures
    return (
        *(Flexibility(link, b.stiffness, b.damping) for link, b in d.bending.items()),
        *(Warming(joint, np.array(w.xi), w.time_constant) for joint, w in d.warming.items()),
        *((FloorTilt(d.floor_tilt),) if any(d.floor_tilt) else ()),
        *(Cable(joint, c.stiffness, c.rest) for joint, c in d.cables.items()),
    )


def _payload(config: TwinConfig, seed: int) -> Payload:
    p = config.payload
    shift = p.com_error * generator(seed, "payload").normal(size=3)
    return Payload(TOOL, p.mass, np.array(p.com) + shift, np.array(p.size))


def _encoders(config: TwinConfig, seed: int) -> tuple[Encoder, ...]:
    still = (0.0, 0.0, 0.0, 0.0)
    link, motor = config.instruments.link_encoders, config.instruments.motor_encoders
    found = [Encoder(TORSO, "motor", 0.0, still, config.torso.quantum, prismatic=True)]
    for name, j in config.arm.items():
        waves = _harmonics(generator(seed, "motor encoder", name), motor.once, motor.twice)
        found.append(Encoder(name, "motor", j.offset * _factor(config, seed, "offset", name), waves, j.quantum))
        rng = generator(seed, "link encoder", name)
        offset = link.offset * float(rng.normal())
        found.append(Encoder(name, "link", offset, _harmonics(rng, link.once, link.twice), link.quantum))
    return tuple(found)


def _harmonics(rng: np.random.Generator, once: float, twice: float) -> tuple[float, float, float, float]:
    """cos1, sin1, cos2, sin2 [rad] of standard deviation `once`, `twice` in amplitude."""
    c1, s1, c2, s2 = rng.normal(size=4) * np.repeat([once, twice], 2) / np.sqrt(2.0) + 0.0  # no -0.0
    return float(c1), float(s1), float(c2), float(s2)


def cluster(name: str, body: MarkerBody, seed: int, *session: str) -> Cluster:
    """Mount a marker body, in the first session unless one is named."""
    rng = generator(seed, *session, "cluster", name)
    nominal = np.array(list(body.markers.values()))
    placement = rng.normal(size=6) * np.repeat([body.translation, body.rotation], 3)
    scattered = nominal + rng.normal(size=nominal.shape) * body.marker
    frames = {BASE: f"base.{name}", TOOL: "tool.hand"}.get(body.link, f"{body.link}.{name}")
    return Cluster(
        name=name,
        link=body.link,
        frames=frames,
        xi=placement,
        marker_names=tuple(body.markers),
        nominal=nominal,
        shift=_without_rigid_part(scattered, nominal) - nominal,
    )


def _without_rigid_part(points: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Points (n, 3) moved onto `nominal` as one rigid body: a body's frame is where its nominal markers fit best.

    Markers of one nominal place, or a single one, tell no rotation: these are only shifted.
    """
    p, q = points.mean(axis=0), nominal.mean(axis=0)
    if (nominal == nominal[0]).all():
        return points - p + q
    return Rotation.align_vectors(nominal - q, points - p)[0].apply(points - p) + q


def links_seen(config: TwinConfig, robot: Robot) -> list[str]:
    """Links whose poses the instruments depend on."""
    arm = set(motion_capture.ARM) if config.instruments.mocap.cameras else set()
    return sorted({c.link for c in robot.clusters} | {BASE} | arm)
