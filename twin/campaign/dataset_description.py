"""The description of a dataset, dataset.json, from datasheet values only."""

from typing import cast

import mjcf
from calibration.recording import Description, TrialEntry, schema
from twin.config.instruments import Instruments
from twin.config.twin import TwinConfig
from twin.fields.names import BASE, HAND, TORSO
from twin.fields.values import point
from twin.simulation.force_plates import PLATE, PlateGrid, T_lab_plate
from twin.simulation.wrist_sensor import WRIST_SENSOR


def describe_dataset(config: TwinConfig, trials: tuple[TrialEntry, ...]) -> Description:
    """The description of a recorded campaign.

    Raises:
        TypeError: The values are those of one robot.
    """
    if not isinstance(config, TwinConfig):
        raise TypeError(f"a dataset is described by nominal values, TwinConfig, not by {type(config).__name__}")
    i, d = config.instruments, config.datasheet
    joints = [schema.Joint(name=TORSO, encoders=("motor",), rate=i.robot_rate)]
    joints += [schema.Joint(name=n, encoders=("motor", "link"), rate=i.robot_rate) for n in config.arm]
    finest = max(j.quantum for j in config.arm.values())
    return Description(
        robot="tiago",
        base_frame=BASE,
        tool_frame=HAND,
        joints=tuple(joints),
        bodies=tuple(
            schema.Body(name=n, link=b.link, markers=tuple(schema.Marker(name=m, xyz=p) for m, p in b.markers.items()))
            for n, b in i.bodies.items()
        ),
        wheels=tuple(schema.Wheel(name=w.name, type=w.type, centre=w.centre, contact=w.contact) for w in mjcf.wheels()),
        plates=_plates(i),
        payload=_payload(config),
        wrist_link=None if i.wrist is None else WRIST_SENSOR,
        sigmas=schema.Sigmas(
            marker=i.marker_noise, encoder=finest, plate_force=i.plate_force_noise, plate_moment=i.plate_moment_noise
        ),
        tolerances=schema.Tolerances(
            joint_translation=d.joint_translation,
            joint_rotation=d.joint_rotation,
            encoder_offset=d.encoder_offset,
            joint_play=d.joint_play,
            body_translation=d.body_translation,
            body_rotation=d.body_rotation,
            link_mass=d.link_mass,
            link_com=d.link_com,
            joint_delay=d.joint_delay,
            joint_delay_spread=d.joint_delay_spread,
            joint_windup=d.joint_windup,
        ),
        trials=trials,
    )


def _plates(instruments: Instruments) -> tuple[schema.Plate, ...]:
    spec = mjcf.spec()
    T = T_lab_plate(spec.body(PLATE), instruments.plate_place)
    axes = cast(schema.Axes, tuple(map(point, T[:3, :3].T)))
    cut = PlateGrid(instruments.plate_grid).cut(*(2.0 * spec.geom(PLATE).size[:2]).tolist())
    return tuple(
        schema.Plate(name=t.name, centre=point(T[:3, :3] @ (*t.shift, 0.0) + T[:3, 3]), axes=axes, size=t.size)
        for t in cut
    )


def _payload(config: TwinConfig) -> schema.Payload | None:
    p = config.payload
    return (
        schema.Payload(link=HAND, mass=p.mass, com=p.com, tolerance=config.datasheet.payload_mass) if p.mass else None
    )
