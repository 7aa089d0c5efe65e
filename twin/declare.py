"""What the laboratory is told: dataset.json, from datasheet values only."""

import mjcf
from calibration.schema import (
    Body,
    Description,
    Joint,
    Marker,
    Payload,
    Plate,
    Sigmas,
    Tolerances,
    TrialEntry,
    Wheel,
)
from twin.build import WRIST_SENSOR
from twin.config import TwinConfig
from twin.draw import BASE, TOOL, TORSO
from twin.instruments.tiles import Tiles

_LAB_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def declaration(config: TwinConfig, trials: tuple[TrialEntry, ...]) -> Description:
    """The description of a recorded campaign; nothing drawn enters it."""
    i, d = config.instruments, config.datasheet
    joints = [Joint(name=TORSO, encoders=("motor",), rate=i.robot_rate)]
    joints += [Joint(name=n, encoders=("motor", "link"), rate=i.robot_rate) for n in config.arm]
    finest = max(j.quantum for j in config.arm.values())
    return Description(
        robot="tiago",
        base_frame=BASE,
        tool_frame=TOOL,
        joints=tuple(joints),
        bodies=tuple(
            Body(name=n, link=b.link, markers=tuple(Marker(name=m, xyz=p) for m, p in b.markers.items()))
            for n, b in i.bodies.items()
        ),
        wheels=tuple(Wheel(name=w.name, type=w.type, centre=w.centre, contact=w.contact) for w in mjcf.wheels()),
        plates=_plates(Tiles(i.plate_grid)),
        payload=_payload(config),
        wrist_link=None if i.wrist is None else WRIST_SENSOR,
        sigmas=Sigmas(
            marker=i.marker_noise, encoder=finest, plate_force=i.plate_force_noise, plate_moment=i.plate_moment_noise
        ),
        tolerances=Tolerances(
            joint_translation=d.joint_translation,
            joint_rotation=d.joint_rotation,
            encoder_offset=d.encoder_offset,
            joint_play=d.joint_play,
            body_translation=d.body_translation,
            body_rotation=d.body_rotation,
            link_mass=d.link_mass,
            link_com=d.link_com,
        ),
        trials=trials,
    )


def _plates(tiles: Tiles) -> tuple[Plate, ...]:
    spec = mjcf.spec()
    plate, geom = spec.body("plate"), spec.geom("plate")
    x, y, z = map(float, plate.pos + spec.site("plate").pos)
    cut = tiles.cut(*(2.0 * geom.size[:2]).tolist())
    return tuple(
        Plate(name=t.name, centre=(x + t.shift[0], y + t.shift[1], z), axes=_LAB_AXES, size=t.size) for t in cut
    )


def _payload(config: TwinConfig) -> Payload | None:
    p = config.payload
    return Payload(link=TOOL, mass=p.mass, com=p.com, tolerance=config.datasheet.payload_mass) if p.mass else None
