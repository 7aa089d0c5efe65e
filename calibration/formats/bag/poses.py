"""6D poses of rigid bodies in a ROS bag: PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped and TF.

A driver of motion capture, a tracker or a camera publishes them, in m and quaternions x, y, z, w, stamped by the
machine of the readings. Bodies of several topics are brought to the first one's stamps, linearly where neighbours are
near.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError
from calibration.formats.mapping.channels import Markers
from calibration.formats.mapping.layouts import PoseTopic
from calibration.formats.mapping.poses import marker_names, markers_at
from calibration.numerics.signals import interpolate_columns

_APART = 0.1  # [s] between neighbours that are interpolated
_TIMES = 3.0  # of the declared standard deviation, beyond which that of the messages is reported [-]


def read_poses(
    path: Path, topics: Mapping[str, PoseTopic], messages: Mapping[str, list[Any]]
) -> tuple[Markers, tuple[str, ...]]:
    """Markers that stand for the poses of all bodies, and what was noticed.

    Raises:
        InputError: A body is on no message, or the bodies' poses are in different frames.
    """
    t, frames = None, dict[str, str]()
    parts, names, notes = list[np.ndarray](), list[str](), list[str]()
    for body, channels in topics.items():
        rows = [row for message in messages[channels.topic] for row in _rows(message, channels.frame)]
        frames[body] = _parent(path, body, channels, rows)
        s, first = np.unique([row[0] for row in rows], return_index=True)
        numbers = np.array([row[1] for row in rows])[first]
        try:
            p = markers_at(numbers[:, :3], numbers[:, 3:], channels)
        except ValueError as error:
            raise InputError(path, f"pose of {body}: {error}") from error
        t = s if t is None else t
        parts.append(_at(t, s, p))
        names += marker_names(body)
        notes += _covariance(body, channels, messages[channels.topic])
    if t is None or len(set(frames.values())) > 1:
        raise InputError(path, f"poses are in different frames: {frames}; name topics of one frame, or its `parent`")
    return Markers(t, tuple(names), np.concatenate(parts, axis=1)), tuple(notes)


def _rows(message: Any, frame: str | None) -> Iterator[tuple[float, list[float], str]]:
    """Stamp [s], position and quaternion x, y, z, w, and frame_id of each pose of a body in a message."""
    for one in getattr(message, "transforms", (message,)):
        if frame is not None and getattr(one, "child_frame_id", frame).lstrip("/") != frame.lstrip("/"):
            continue
        if hasattr(one, "transform"):
            p, r = one.transform.translation, one.transform.rotation
        else:
            pose = getattr(one.pose, "pose", one.pose)
            p, r = pose.position, pose.orientation
        stamp = one.header.stamp
        at = (stamp.sec * 10**9 + stamp.nanosec) / 1e9
        yield at, [p.x, p.y, p.z, r.x, r.y, r.z, r.w], one.header.frame_id.lstrip("/")


def _parent(path: Path, body: str, channels: PoseTopic, rows: list[tuple[float, list[float], str]]) -> str:
    """The one frame a body's poses are in."""
    if not rows:
        raise InputError(path, f"{channels.topic}: no pose of frame {channels.frame!r} for {body}; see `frame`")
    found = sorted({row[2] for row in rows})
    wanted = found[0] if channels.parent is None else channels.parent.lstrip("/")
    if found != [wanted]:
        raise InputError(path, f"{channels.topic}: poses of {body} are in frame {found}, wanted is {wanted!r}")
    return wanted


def _at(t: np.ndarray, s: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Positions p (n, m, 3) at s (n,) brought to t (k,) [s]; NaN where s has no neighbours near."""
    found = interpolate_columns(t, s, p.reshape(len(s), -1), np.nan)
    after = np.clip(np.searchsorted(s, t), 1, len(s) - 1)
    alone = (s[after] - s[after - 1] > _APART) & ~np.isin(t, s)
    found[alone] = np.nan
    return found.reshape(len(t), -1, 3)


def _covariance(body: str, channels: PoseTopic, messages: list[Any]) -> Iterator[str]:
    """Remark on a covariance in the messages that contradicts the declared standard deviations."""
    stated = [m.pose.covariance for m in messages if hasattr(m, "pose") and hasattr(m.pose, "covariance")]
    if not stated:
        return
    sigma = np.sqrt(np.median(np.array(stated).reshape(-1, 6, 6).diagonal(axis1=1, axis2=2), axis=0))
    for what, unit, seen, declared in (
        ("position", "m", sigma[:3].mean(), channels.sigma_position),
        ("rotation", "rad", sigma[3:].mean(), channels.sigma_rotation),
    ):
        if seen > 0.0 and not 1.0 / _TIMES < seen / declared < _TIMES:
            yield (
                f"{channels.topic}: messages state a standard deviation of {seen:.2g} {unit} for the {what} of {body}, "
                f"the mapping {declared:.2g}"
            )
