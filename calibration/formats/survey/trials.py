"""Which files are one trial, and what moved in it."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from calibration.formats.mapping.channels import Markers, Recorded
from calibration.formats.mapping.rests import rests, rests_of_markers
from calibration.formats.survey.bodies import FoundBody
from calibration.formats.survey.view import FileView

_POSTURES = 3  # a static trial rests in
_MOVED = 0.05  # [rad, m] a joint has moved
_SHARE = 0.05  # of the largest motion, below which another joint was at rest
_DRIVEN, _TURNED = 0.1, 0.5  # [m], [rad] a base moved on purpose


def suffixes(views: Sequence[FileView]) -> dict[str, str]:
    """What follows the trial's name in each file: `.csv` of one kind of tables, the ends that match between several."""
    csv: dict[tuple[str, ...], list[str]] = {}
    for view in views:
        if view.kind == "csv":
            csv.setdefault(view.layout, []).append(view.path.name)
    others = {v.path.name if v.path.is_dir() else v.path.stem for v in views if v.kind != "csv"}
    found: dict[str, str] = {}
    for layout, names in csv.items():
        outside = others.union(*(set(_stems(n)) for kind, some in csv.items() if kind != layout for n in some))
        tails = set.intersection(*({n[len(s) :] for s in _stems(n)} for n in names))
        best = max(tails, key=lambda tail: (sum(n.removesuffix(tail) in outside for n in names), -len(tail)))
        found |= dict.fromkeys(names, best)
    return found


def stem_of(view: FileView, tails: dict[str, str]) -> str:
    """Name of the trial a file belongs to."""
    if view.kind == "csv":
        return view.path.name.removesuffix(tails[view.path.name])
    return view.path.name if view.path.is_dir() else view.path.stem


def _stems(name: str) -> Iterator[str]:
    bare = name.removesuffix(Path(name).suffix)
    yield bare
    yield from (bare[: m.start()] for m in re.finditer(r"[._-]", bare) if m.start())


def kind_of(recorded: Recorded, bodies: Sequence[FoundBody]) -> str:
    """static, sweep, swing, spin or drive."""
    if recorded.means is not None or recorded.dwells is not None:
        return "static"
    base_is_seen = len(bodies) > 1 or (bodies and recorded.joints is None)  # one body beside readings is the hand
    if base_is_seen and recorded.markers is not None:
        moved = _base_motion(recorded.markers, bodies[0])
        if moved[1] > _TURNED:
            return "spin"
        if moved[0] > _DRIVEN:
            return "drive"
    read, markers = recorded.joints, recorded.markers
    n = 0 if read is None else _postures(read.t, read.q_motor, rests(read.t, read.q_motor))
    if markers is not None:
        found = rests_of_markers(recorded, [b.markers for b in bodies])
        n = max(n, _postures(markers.t, markers.position.reshape(len(markers.t), -1), found))
    if n >= _POSTURES:
        return "static"
    if read is not None:
        span = np.ptp(read.q_motor, axis=0)
        if span.max() > _MOVED and (span > max(_SHARE * span.max(), 0.5 * _MOVED)).sum() == 1:
            return "sweep"
    return "swing"


def _postures(t: np.ndarray, x: np.ndarray, windows: np.ndarray) -> int:
    """How many rests, windows (r, 2) [s], of x (n, k) at t (n,) differ: a swing that halts does so where it began."""
    found: list[np.ndarray] = []
    for start, stop in windows:
        mean = np.median(x[(t >= start) & (t <= stop)], axis=0)
        if all((np.abs(mean - other) > _MOVED).any() for other in found):
            found.append(mean)
    return len(found)


def _base_motion(markers: Markers, base: FoundBody) -> tuple[float, float]:
    """How far the base's centre went [m], and the direction between two of its markers [rad]."""
    names = [n for n in base.markers if n in markers.names]
    if len(names) < 2:
        return 0.0, 0.0
    p = markers.position[:, [markers.names.index(n) for n in names]]
    p = p[np.isfinite(p).all(axis=(1, 2))]
    if not len(p):
        return 0.0, 0.0
    centre = p.mean(axis=1)
    away = p[:, 0, :2] - p[:, 1, :2]
    heading = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    low, high = np.percentile(centre, (5.0, 95.0), axis=0)
    return float(np.linalg.norm(high - low)), float(np.ptp(np.percentile(heading, (5.0, 95.0))))
