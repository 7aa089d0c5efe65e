"""Marker labels grouped into rigid bodies: the distances within a body do not change while the robot moves.

    markers a, b are of one body where the middle 90 % of |p_a - p_b| are within 5 mm, over all trials together

Labels that are rigid together and have different names (base1.., shoulder1..) are bodies of their own if each has
three. The body that moves most is the hand, the one that moves least the base.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.formats.mapping.channels import Recorded

_FLEX = 5e-3  # [m]
_SAMPLES = 100  # of a trial
_FEWEST = 3


@dataclass(frozen=True)
class FoundBody:
    """A group of labels that are rigid together.

    Attributes:
        name: What its labels have in common.
        markers: Its labels.
        travel: How far its centre moved, between the 5th and 95th percentiles [m].
    """

    name: str
    markers: tuple[str, ...]
    travel: float


def found_bodies(trials: Sequence[Recorded]) -> tuple[tuple[FoundBody, ...], tuple[str, ...]]:
    """Bodies, the one that moves least first, and labels that belong to none."""
    names = tuple(dict.fromkeys(n for r in trials for n in _names(r)))
    p = np.concatenate([_sampled(r, names) for r in trials]) if names else np.zeros((0, 0, 3))
    groups, rest = [], list(range(len(names)))
    apart = _flexibility(p)
    while rest:
        group = [rest[0]]
        for k in rest[1:]:
            if all(apart[k, j] < _FLEX for j in group):
                group.append(k)
        groups += _by_name(group, names)
        rest = [k for k in rest if k not in group]
    bodies = [FoundBody(_common(g, names), tuple(names[k] for k in g), _travel(p[:, g])) for g in groups]
    alone = tuple(n for b in bodies if len(b.markers) < _FEWEST for n in b.markers)
    if len(bodies) == 1:
        return tuple(bodies), ()
    return tuple(sorted((b for b in bodies if len(b.markers) >= _FEWEST), key=lambda b: b.travel)), alone


def _names(recorded: Recorded) -> tuple[str, ...]:
    if recorded.means is not None:
        return recorded.means.markers
    return () if recorded.markers is None else recorded.markers.names


def _sampled(recorded: Recorded, names: Sequence[str]) -> np.ndarray:
    """Some positions (n, m, 3) of all names, NaN where the file does not have them."""
    known = _names(recorded)
    group = recorded.means or recorded.markers
    if group is None:
        return np.full((0, len(names), 3), np.nan)
    rows = np.unique(np.linspace(0, len(group.position) - 1, _SAMPLES).astype(int))
    found = np.full((len(rows), len(names), 3), np.nan)
    for k, name in enumerate(names):
        if name in known:
            found[:, k] = group.position[rows, known.index(name)]
    return found


def _flexibility(p: np.ndarray) -> np.ndarray:
    """Range (m, m) of the middle 90 % of each distance [m]; infinite where two were never seen together."""
    d = np.linalg.norm(p[:, :, None] - p[:, None], axis=3)
    seen = np.isfinite(d).sum(axis=0) > 1
    low, high = (np.nanpercentile(np.where(seen, d, 0.0), q, axis=0) for q in (5.0, 95.0))
    return np.where(seen, high - low, np.inf)


def _by_name(group: list[int], names: Sequence[str]) -> list[list[int]]:
    """The group, or its parts of one name each, where every part has three."""
    parts: dict[str, list[int]] = {}
    for k in group:
        parts.setdefault(_stem(names[k]), []).append(k)
    return list(parts.values()) if min(map(len, parts.values())) >= _FEWEST else [group]


def _stem(name: str) -> str:
    return re.sub(r"(\.[xyz][+-]|[\W_]*\d*)$", "", name)  # also of the markers that stand for a pose


def _common(group: Sequence[int], names: Sequence[str]) -> str:
    stems = {_stem(names[k]) for k in group}
    stem = stems.pop() if len(stems) == 1 else ""
    return stem or "body_" + re.sub(r"\W", "", names[group[0]])


def _travel(p: np.ndarray) -> float:
    centre = p[np.isfinite(p).all(axis=(1, 2))].mean(axis=1)
    if not len(centre):
        return 0.0
    low, high = np.percentile(centre, (5.0, 95.0), axis=0)
    return float(np.linalg.norm(high - low))
