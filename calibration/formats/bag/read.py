"""Joint readings from a ROS bag: JointState topics, or PAL's introspection; times from header.stamp.

A joint may come in messages of several publishers, in any order of names: each reading is taken by its name. Messages
without any joint of the mapping are others' and passed over; one with some of them only is an error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError
from calibration.formats.bag.messages import JOINT_STATE, PREFIX, STATISTICS_NAMES, SUFFIXES, typestore
from calibration.formats.bag.poses import read_poses
from calibration.formats.mapping.channels import Joints, Recorded
from calibration.formats.mapping.layouts import BagLayout
from calibration.numerics.signals import interpolate_columns
from calibration.recording.trial import check_times

_FIELDS = tuple(SUFFIXES)
_MESSAGE_BYTES, _ALL_BYTES = 2**20, 2**28  # of a message, and of all [B]
_FIRST = 200  # messages from which the names of joints are taken
_COMPRESSION = "ompression"  # in every message of rosbags about one it does not know


def read_bag(files: Sequence[Path], layout: BagLayout) -> Recorded:
    """Joint readings of the bag of one trial.

    Raises:
        InputError: It cannot be read, lacks a topic or a joint, or its stamps do not increase.
    """
    if len(files) > 1:
        raise InputError(files[1], f"one bag a trial; {files[0]} has the same name")
    path = files[0]
    messages = _messages(path, layout.topics)
    joints = None
    if layout.joints:
        joints = _states(path, layout, messages) if layout.source == "joint_states" else _values(path, layout, messages)
    if joints is not None and layout.wrist is not None:
        joints = replace(joints, wrist_wrench=_wrist(path, layout.wrist, layout, messages, joints.t))
    if not layout.poses:
        return Recorded(str(path), joints=joints)
    markers, notes = read_poses(path, layout.poses, messages)
    return Recorded(str(path), markers, joints, together=("robot",) if joints is not None else (), notes=notes)


def _messages(path: Path, topics: Sequence[str]) -> dict[str, list[Any]]:
    """Messages of each topic, in the order of the bag."""
    store = typestore(2)
    from rosbags.highlevel import AnyReader

    found: dict[str, list[Any]] = {topic: [] for topic in topics}
    try:
        with AnyReader([path], default_typestore=store) as bag:
            _bound_chunks(bag)
            total = 0
            for connection, _, raw in bag.messages([c for c in bag.connections if c.topic in found]):
                total += len(raw)
                if len(raw) > _MESSAGE_BYTES or total > _ALL_BYTES:
                    raise InputError(path, f"{connection.topic}: {len(raw)} bytes a message, {total} so far: too large")
                found[connection.topic].append(bag.deserialize(raw, connection.msgtype))
            known = sorted(bag.topics)
    except _unreadable() as error:
        remedy = "truncated? copy it again"
        if _COMPRESSION in str(error) and "upported" in str(error):
            remedy = "write it again with another: `rosbag decompress` for ROS 1, `ros2 bag convert` for ROS 2"
        raise InputError(path, f"cannot be read as a ROS bag ({error}); {remedy}") from error
    empty = [topic for topic, rows in found.items() if not rows]
    if empty:
        raise InputError(path, f"no messages on {empty}; the bag has {known}; correct the mapping file")
    return found


def _bound_chunks(bag: Any) -> None:
    """Let no chunk of a ROS 1 bag grow beyond all bounds when it is decompressed."""
    import bz2

    import lz4.frame

    known = {bz2.decompress: bz2.BZ2Decompressor, lz4.frame.decompress: lz4.frame.LZ4FrameDecompressor}

    def bounded(decompressor: Any, data: bytes) -> bytes:
        at_once = known[decompressor]()
        found: bytes = at_once.decompress(data, max_length=_ALL_BYTES)
        if not at_once.eof:
            raise ValueError(f"a chunk of more than {_ALL_BYTES} bytes, or cut off")
        return found

    for reader in bag.readers:
        chunks = getattr(reader, "chunks", {})
        for place, chunk in chunks.items():
            if chunk.decompressor in known:
                chunks[place] = chunk._replace(decompressor=partial(bounded, chunk.decompressor))


def topics_of(path: Path) -> dict[str, tuple[str, set[str]]]:
    """Message type and names of joints in the first messages of every topic of a bag.

    Raises:
        InputError: It cannot be read.
    """
    store = typestore(2)
    from rosbags.highlevel import AnyReader

    try:
        with AnyReader([path], default_typestore=store) as bag:
            _bound_chunks(bag)
            kinds = {c.topic: c.msgtype for c in bag.connections}
            named = [c for c in bag.connections if c.msgtype in (JOINT_STATE, STATISTICS_NAMES)]
            names: dict[str, set[str]] = {c.topic: set() for c in bag.connections}
            for k, (connection, _, raw) in enumerate(bag.messages(named)):
                message = bag.deserialize(raw, connection.msgtype)
                listed = message.name if connection.msgtype == JOINT_STATE else message.names
                bare = (n.removeprefix(PREFIX) for n in listed)
                names[connection.topic] |= {n.removesuffix(SUFFIXES["q_motor"]) for n in bare}
                if k > _FIRST:
                    break
    except _unreadable() as error:
        raise InputError(path, f"cannot be read as a ROS bag ({error}); truncated? copy it again") from error
    return {topic: (kinds[topic], names[topic]) for topic in kinds}


def _unreadable() -> tuple[type[Exception], ...]:
    """What reading a damaged bag may raise; the zstd module has no other name for its own error."""
    from rosbags.highlevel import AnyReaderError
    from rosbags.rosbag1 import ReaderError as One
    from rosbags.rosbag2 import ReaderError as Two
    from rosbags.rosbag2.reader import zstd

    damaged = OSError, EOFError, ValueError, KeyError, OverflowError, AssertionError, RuntimeError
    return AnyReaderError, One, Two, zstd.ZstdError, *damaged


def _states(path: Path, layout: BagLayout, messages: dict[str, list[Any]]) -> Joints:
    names = list(layout.joints.values())
    t, motor = _table(path, layout.motor, messages, names, ("position", "velocity", "effort"), required=names)
    fields = {"q_motor": motor[0], "v_motor": motor[1], "effort": motor[2]}
    for field, topic in (("q_link", layout.link), ("q_command", layout.command)):
        fields[field] = np.full((len(t), len(names)), np.nan)
        if topic is not None:
            s, (x,) = _table(path, topic, messages, names, ("position",), required=[])
            at = list(interpolate_columns(t, s, x, np.nan).T)
            fields[field] = np.stack(at, axis=1)
    return Joints(t, tuple(layout.joints), **fields)


def _table(
    path: Path, topic: str, messages: dict[str, list[Any]], names: list[str], fields: Sequence[str], required: list[str]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (n,) and one array (n, k) a field, of the messages that hold joints of ours."""
    stamps, rows = [], []
    for k, message in enumerate(messages[topic]):
        place = {name: i for i, name in enumerate(message.name)}
        columns = [place.get(name) for name in names]
        if all(c is None for c in columns):
            continue
        missing = [n for n in required if n not in place]
        if missing:
            raise InputError(
                path, f"{topic}: message {k} has no {missing}, but others of our joints; log them together"
            )
        stamps.append(_seconds(message))
        rows.append([_picked(getattr(message, field), columns) for field in fields])
    if not rows:
        seen = sorted({name for message in messages[topic] for name in message.name})
        raise InputError(path, f"{topic}: none of {names}; it has {seen}; correct the mapping file")
    t = np.array(stamps)
    _check_increasing(path, topic, t)
    table = np.array(rows, dtype=float)
    return t, [table[:, i] for i in range(len(fields))]


def _picked(values: Any, columns: list[int | None]) -> list[float]:
    return [float("nan") if c is None or c >= len(values) else float(values[c]) for c in columns]


def _values(path: Path, layout: BagLayout, messages: dict[str, list[Any]]) -> Joints:
    """PAL's introspection: names once, then values by version of the names."""
    versions = {m.names_version: [n.removeprefix(PREFIX) for n in m.names] for m in messages[layout.names]}
    stamps, rows = [], []
    for k, message in enumerate(messages[layout.values]):
        names = versions.get(message.names_version)
        if names is None or len(names) != len(message.values):
            raise InputError(path, f"{layout.values}: message {k} has no names of version {message.names_version}")
        place = {name: i for i, name in enumerate(names)}
        missing = [n for n in layout.joints.values() if n + SUFFIXES["q_motor"] not in place]
        if missing:
            raise InputError(path, f"{layout.values}: no position of {missing}; it has {sorted(names)}")
        stamps.append(_seconds(message))
        rows.append(list(_row(message.values, place, layout)))
    t = np.array(stamps)
    _check_increasing(path, layout.values, t)
    table = np.array(rows)
    return Joints(t, tuple(layout.joints), **{field: table[:, i] for i, field in enumerate(_FIELDS)})


def _row(values: Any, place: dict[str, int], layout: BagLayout) -> Iterator[list[float]]:
    for field in _FIELDS:
        columns = [place.get(name + SUFFIXES[field]) for name in layout.joints.values()]
        yield _picked(values, columns)


def _wrist(path: Path, topic: str, layout: BagLayout, messages: dict[str, list[Any]], t: np.ndarray) -> np.ndarray:
    """ACTION on the wrist's sensor (n, 6) at the readings' times t (n,), linear, NaN outside."""
    s = np.array([_seconds(m) for m in messages[topic]])
    _check_increasing(path, topic, s)
    both = ([m.wrench.force, m.wrench.torque] for m in messages[topic])
    w = np.array([[getattr(part, axis) for part in two for axis in "xyz"] for two in both])
    sign = 1.0 if layout.wrist_convention == "action" else -1.0
    return sign * interpolate_columns(t, s, w, np.nan)


def _seconds(message: Any) -> float:
    stamp = message.header.stamp
    return float((stamp.sec * 10**9 + stamp.nanosec) / 1e9)


def _check_increasing(path: Path, topic: str, t: np.ndarray) -> None:
    back = np.flatnonzero(~(np.diff(t) > 0.0))
    if not len(back):
        check_times(path, topic, t)
    if len(back):
        k = int(back[0])
        why = "has the stamp of the one before" if t[k + 1] == t[k] else "has an earlier stamp than the one before"
        raise InputError(path, f"{topic}: message {k + 1} of our joints {why} ({t[k + 1]:.6f} s); log one publisher")
