"""The robot's readings of a trial as a ROS 1 bag, or a ROS 2 bag (mcap), without ROS.

    /joint_states            position, velocity: motor side; effort: motor current [A]
    /joint_states_absolute   position: link encoders        /joint_states_command   position: set-points
    /introspection_data/{names,values}                      the same as PAL's robots log it
    /wrist_ft                wrench: ACTION of the hand on the wrist's sensor, its axes

JointState has no field for a second encoder, hence its second topic. Times are the robot's clock, in header.stamp.
"""

from pathlib import Path
from typing import Any, Literal

import numpy as np

from calibration.errors import InputError
from calibration.formats.bag.messages import (
    ABSOLUTE,
    COMMAND,
    JOINT_STATE,
    MOTOR,
    NAMES,
    PREFIX,
    STATISTICS_NAMES,
    STATISTICS_VALUES,
    SUFFIXES,
    VALUES,
    WRENCH,
    WRIST,
    typestore,
)
from calibration.recording.trial import Trial

_NONE = np.zeros(0)


def write_bag(path: Path, trial: Trial, ros: Literal[1, 2] = 1) -> None:
    """Write the joint readings of a trial: a file for ROS 1, a folder for ROS 2.

    Raises:
        InputError: It has none, or times before zero, which ROS cannot stamp.
    """
    if not len(trial.t_robot):
        raise InputError(path, f"trial {trial.id} has no joint readings")
    if trial.t_robot[0] < 0.0:
        raise InputError(path, f"trial {trial.id} begins at {trial.t_robot[0]} s; ROS has no stamps before zero")
    store, stamps = typestore(ros), np.round(trial.t_robot * 1e9).astype(np.int64).tolist()
    with _writer(path, ros) as bag:
        for topic, kind, messages in _topics(trial, store, stamps, ros):
            connection = bag.add_connection(topic, kind, typestore=store)
            to_bytes = store.serialize_ros1 if ros == 1 else store.serialize_cdr
            for stamp, message in messages:
                bag.write(connection, stamp, to_bytes(message, kind))


def _writer(path: Path, ros: int) -> Any:
    if ros == 1:
        from rosbags.rosbag1 import Writer as Writer1

        one = Writer1(path)
        one.set_compression(Writer1.CompressionFormat.LZ4)
        return one
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    return Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP)


def _topics(trial: Trial, store: Any, stamps: list[int], ros: int) -> list[tuple[str, str, list[tuple[int, Any]]]]:
    names, linked = list(trial.joint), np.isfinite(trial.q_link).any(axis=0)
    link_names = [name for name, has in zip(names, linked, strict=True) if has]
    rows = zip(stamps, trial.q_motor, trial.v_motor, trial.effort, strict=True)
    found = [(MOTOR, JOINT_STATE, [(s, _state(store, s, ros, names, q, v, e)) for s, q, v, e in rows])]
    if link_names:
        link = zip(stamps, trial.q_link[:, linked], strict=True)
        found.append((ABSOLUTE, JOINT_STATE, [(s, _state(store, s, ros, link_names, q)) for s, q in link]))
    if np.isfinite(trial.q_command).all():
        rows_ = zip(stamps, trial.q_command, strict=True)
        found.append((COMMAND, JOINT_STATE, [(s, _state(store, s, ros, names, q)) for s, q in rows_]))
    known = np.flatnonzero(np.isfinite(trial.wrist_wrench).all(axis=1))
    if len(known):
        wrenches = [(stamps[k], trial.wrist_wrench[k].tolist()) for k in known]
        found.append((WRIST, WRENCH, [(s, _wrench(store, s, ros, w)) for s, w in wrenches]))
    return found + _introspection(trial, store, stamps, ros)


def _introspection(
    trial: Trial, store: Any, stamps: list[int], ros: int
) -> list[tuple[str, str, list[tuple[int, Any]]]]:
    columns = {
        f"{PREFIX}{joint}{suffix}": getattr(trial, field)[:, j]
        for j, joint in enumerate(trial.joint)
        for field, suffix in SUFFIXES.items()
        if np.isfinite(getattr(trial, field)[:, j]).all()
    }
    Names, Values = store.types[STATISTICS_NAMES], store.types[STATISTICS_VALUES]
    names = Names(header=_header(store, stamps[0], ros), names=list(columns), names_version=1)
    values = np.ascontiguousarray(np.stack(list(columns.values()), axis=1))
    rows = [
        (s, Values(header=_header(store, s, ros), values=v, names_version=1))
        for s, v in zip(stamps, values, strict=True)
    ]
    return [(NAMES, STATISTICS_NAMES, [(stamps[0], names)]), (VALUES, STATISTICS_VALUES, rows)]


def _state(
    store: Any, stamp: int, ros: int, names: list[str], q: np.ndarray, v: np.ndarray = _NONE, effort: np.ndarray = _NONE
) -> Any:
    State = store.types[JOINT_STATE]
    known = [x if np.isfinite(x).all() else _NONE for x in (v, effort)]
    q, v, effort = map(np.ascontiguousarray, (q, *known))
    return State(header=_header(store, stamp, ros), name=names, position=q, velocity=v, effort=effort)


def _wrench(store: Any, stamp: int, ros: int, wrench: list[float]) -> Any:
    vector, both = store.types["geometry_msgs/msg/Vector3"], store.types["geometry_msgs/msg/Wrench"]
    force, torque = (vector(**dict(zip("xyz", wrench[k : k + 3], strict=True))) for k in (0, 3))
    return store.types[WRENCH](header=_header(store, stamp, ros), wrench=both(force=force, torque=torque))


def _header(store: Any, stamp: int, ros: int) -> Any:
    time = store.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    sequence = {"seq": 0} if ros == 1 else {}
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id="", **sequence)
