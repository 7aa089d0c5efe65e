"""A recording of a hand that shows a point only, as the means over its rests: no rotation identifies a clock.

    q = mean of the readings,  p = mean of the markers,  std^2 = mean over rests of var(quarter means) / 4

Readings and markers must have been sampled together, on one clock; each rest loses its edges
(`postures.inner_windows`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.errors import InputError
from calibration.formats.mapping.channels import Joints, Markers, Means, Recorded
from calibration.formats.mapping.mapping import MappedTrial, MappingFile
from calibration.formats.mapping.rests import offset_between, rests
from calibration.mocap.postures import BLOCKS, inner_windows

_LEAST = 1e-6  # smallest standard deviation of a mean [m]


def rests_of(mapping: MappingFile, trial: MappedTrial, recorded: Recorded) -> Recorded:
    """The trial as it is, or its rests as means where the mapping's hand has fewer than three markers.

    Raises:
        InputError: Such a recording is not of static postures on one clock with the markers, or does not say when.
    """
    hand = next((b for b in mapping.content.bodies if b.name == mapping.content.hand_name), None)
    joints, markers = recorded.joints, recorded.markers
    if hand is None or not 0 < len(hand.marker_names) < 3 or joints is None or markers is None:
        return recorded
    dwells = recorded.dwells if trial.dwells is None else np.array(trial.dwells).reshape(-1, 2)
    few = f"trial {trial.id}: a hand of {len(hand.marker_names)} markers"
    if trial.kind != "static" or dwells is None or not len(dwells):
        what = "is used at rest only; declare it `static` with `dwells`, or put three markers on the hand"
        raise InputError(recorded.file, f"{few} {what}")
    if "robot" not in {*recorded.together, *mapping.content.setup.mocap_clock}:
        what = "shows no rotation that identifies the clock; sample both together, or put three markers on the hand"
        raise InputError(recorded.file, f"{few} {what}")
    return replace(recorded, markers=None, joints=None, plates=None, dwells=None, means=_means(joints, markers, dwells))


def posture_means(trials: Sequence[Recorded], one_clock: bool) -> list[Recorded]:
    """Continuous trials with dwells as the means over them, for where marker bodies are; those without are left out.

    Args:
        trials: What was recorded.
        one_clock: Whether readings are on the markers' clock; else they are shifted to where their rests are dwells.
    """
    whole = [r for r in trials if r.dwells is not None and len(r.dwells) and r.joints and r.markers]
    read = [rests(r.joints.t, r.joints.q_motor) for r in whole if r.joints]
    offset = 0.0 if one_clock else offset_between([np.asarray(r.dwells) for r in whole], read)
    if not np.isfinite(offset):
        return []
    return [
        replace(
            r, means=_means(replace(r.joints, t=r.joints.t + offset), r.markers, r.dwells), joints=None, markers=None
        )
        for r in whole
        if r.joints and r.markers and r.dwells is not None
    ]


def _means(joints: Joints, markers: Markers, dwells: np.ndarray) -> Means:
    """Of the rests that have readings and markers."""
    q, p, variances = [], [], []
    for start, stop in inner_windows(dwells):
        rows = np.flatnonzero((joints.t >= start) & (joints.t <= stop))
        seen = np.flatnonzero((markers.t >= start) & (markers.t <= stop))
        if not len(rows) or len(seen) < BLOCKS:
            continue
        q.append(joints.q_motor[rows].mean(axis=0))
        p.append(_seen_mean(markers.position[seen]))
        quarters = np.array([_seen_mean(markers.position[part]) for part in np.array_split(seen, BLOCKS)])
        variances.append(quarters.var(axis=0, ddof=1) / BLOCKS)
    shape = (0, len(markers.names), 3)
    std = float(np.sqrt(np.nanmean(variances))) if np.isfinite(variances).any() else _LEAST
    places = np.array(p).reshape(-1, *shape[1:])
    return Means(joints.names, np.array(q).reshape(-1, len(joints.names)), markers.names, places, max(std, _LEAST))


def _seen_mean(position: np.ndarray) -> np.ndarray:
    """Mean (m, 3) of positions (n, m, 3) of markers seen in more than half of them, NaN of others."""
    seen = np.isfinite(position).all(axis=2)
    total = np.where(seen[..., None], position, 0.0).sum(axis=0)
    often = seen.sum(axis=0) > 0.5 * len(position)
    return np.where(often[:, None], total / np.maximum(seen.sum(axis=0), 1)[:, None], np.nan)
