"""Dwells of static trials: those the mapping or the file states, else the rests of readings and markers.

    d_i = |mean x over [t_i, t_i + w] - mean x over [t_i - w, t_i]|,     w = 0.15 s
    a column is at rest where d_i < 5 sqrt(2 / n) sigma + floor,         n samples in w

sigma is each column's noise, from the median of its second differences, which a smooth motion does not change; the
floor, 1 mm or 1 mrad within w, is a slow settling. Every joint must rest, and of each body half of the markers
that are seen: an exchanged label is not a motion. A rest lasts 0.7 s at least. The one a recording begins with
is not counted: from which side its joints came was not recorded.

Readings decide where there are any. With a clock of their own they are shifted by the offset at which their rests and
the markers' overlap longest, over all trials together: to 0.05 s, a quarter of what a rest loses at both ends later.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.errors import InputError, InputErrors
from calibration.formats.mapping.channels import Recorded
from calibration.formats.mapping.mapping import MappedTrial, MappingFile
from calibration.numerics.signals import GAP

WINDOW = 0.15  # [s]
LEAST = 0.7  # [s]
FLOOR = 1e-3  # [m, rad]
_SIGMAS = 5.0
_GAUSS = 1.4826  # standard deviation over the median distance from the median


def noise_of(x: np.ndarray) -> np.ndarray:
    """Standard deviation (k,) of the samples x (n, k), equally spaced, about whatever smooth motion they follow."""
    second = np.diff(x, n=2, axis=0)
    known = np.isfinite(second).any(axis=0)
    median = np.zeros(x.shape[1])
    median[known] = np.nanmedian(np.abs(second[:, known]), axis=0)
    return np.asarray(_GAUSS * median / np.sqrt(6.0))


def rests(t: np.ndarray, x: np.ndarray, group: np.ndarray | None = None) -> np.ndarray:
    """Start and stop (r, 2) [s] of the rests of a recording.

    Args:
        t: (n,) [s].
        x: Readings (n, k) or positions (n, k, 3) [rad, m]; NaN where not known.
        group: (k,) number of the body each is of, at rest with half of those known; each is one of its own unless
            given.
    """
    group = np.arange(x.shape[1]) if group is None else group
    x = x.reshape(*x.shape[:2], -1)
    half = max(2, round(WINDOW / float(np.median(np.diff(t))))) if len(t) > 1 else 1
    if len(t) <= 2 * half or not x.shape[1]:
        return np.zeros((0, 2))
    change, seen = _changes(x.reshape(len(x), -1), half)
    flat = change < _SIGMAS * np.sqrt(2.0 / half) * noise_of(x.reshape(len(x), -1)) + FLOOR
    seen, flat = (np.asarray(a.reshape(len(a), *x.shape[1:]).all(axis=2)) for a in (seen, flat))
    slow = seen & flat
    of_group = (group[:, None] == np.unique(group)).astype(float)  # (k, groups)
    n_seen, n_slow = seen @ of_group, slow @ of_group
    still = np.asarray((n_slow >= 0.5 * n_seen).all(axis=1) & seen.any(axis=1))
    first, last = t[: len(t) - 2 * half + 1], t[2 * half - 1 :]
    still &= last - first < 2.0 * WINDOW + GAP
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    # a smooth start stays below the threshold for half a window
    ends = [(first[a], last[b - 1] - 0.5 * WINDOW) for a, b in edges.reshape(-1, 2) if a > 0]
    return np.array([(start, stop) for start, stop in ends if stop - start >= LEAST]).reshape(-1, 2)


def rests_of_markers(recorded: Recorded, bodies: Sequence[Sequence[str]]) -> np.ndarray:
    """Rests (r, 2) [s, mocap clock] of the markers of these bodies."""
    markers = recorded.markers
    if markers is None:
        return np.zeros((0, 2))
    names = [name for body in bodies for name in body if name in markers.names]
    owner = [k for k, body in enumerate(bodies) for name in body if name in markers.names]
    p = markers.position[:, [markers.names.index(name) for name in names]]
    return rests(markers.t, p, np.array(owner, dtype=int))


def rests_of_trials(
    trials: Sequence[Recorded], bodies: Sequence[Sequence[str]], one_clock: bool
) -> tuple[np.ndarray, ...]:
    """Rests (r, 2) [s, mocap clock] of each trial of a session.

    Args:
        trials: What was recorded.
        bodies: Names of the markers of each body.
        one_clock: Whether readings are on the markers' clock.
    """
    seen = [rests_of_markers(r, bodies) for r in trials]
    read = [np.zeros((0, 2)) if r.joints is None else rests(r.joints.t, r.joints.q_motor) for r in trials]
    offset = 0.0 if one_clock else offset_between(seen, read)
    return tuple(b + offset if len(b) and np.isfinite(offset) else a for a, b in zip(seen, read, strict=True))


def offset_between(a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> float:
    """What to add to the times of rests b (m, 2) [s] so that, over all trials, they overlap rests a (n, 2) longest.

    Candidates bring the start of one rest to the start of another of its trial; NaN where there is none.
    """
    pairs = [(x, y) for x, y in zip(a, b, strict=True) if len(x) and len(y)]
    if not pairs:
        return float("nan")
    candidates = np.concatenate([(x[:, None, 0] - y[None, :, 0]).ravel() for x, y in pairs])
    totals = [sum(overlap(x, y + offset) for x, y in pairs) for offset in candidates]
    return float(candidates[int(np.argmax(totals))])


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """How long [s] rests a (n, 2) and b (m, 2) are at the same time."""
    start, stop = np.maximum(a[:, None, 0], b[None, :, 0]), np.minimum(a[:, None, 1], b[None, :, 1])
    return float(np.clip(stop - start, 0.0, None).sum())


def _changes(x: np.ndarray, half: int) -> tuple[np.ndarray, np.ndarray]:
    """Distance of neighbouring window means (n - 2 half + 1, k), and where both have half of their samples."""
    known, none = np.isfinite(x), np.zeros((1, x.shape[1]))
    total = np.cumsum(np.concatenate([none, np.where(known, x, 0.0)]), axis=0)
    count = np.cumsum(np.concatenate([none, known]), axis=0)
    sums, counts = total[half:] - total[:-half], count[half:] - count[:-half]
    means, often = sums / np.maximum(counts, 1.0), counts >= 0.5 * half
    return np.abs(means[half:] - means[:-half]), often[half:] & often[:-half]


def with_rests(mapping: MappingFile, trials: Sequence[Recorded]) -> list[Recorded]:
    """The trials of a mapping, static ones with their dwells.

    Raises:
        InputError: A static trial shows no rest; all such trials.
    """
    content = mapping.content
    missing = [_has_to_be_found(t, r) for t, r in zip(content.trials, trials, strict=True)]
    if not any(missing):
        return list(trials)
    together = {name for r in trials for name in r.together} | set(content.setup.mocap_clock)
    found = rests_of_trials(trials, [b.marker_names for b in content.bodies], "robot" in together)
    empty = [
        InputError(r.file, _refusal(t.id))
        for t, r, rests, absent in zip(content.trials, trials, found, missing, strict=True)
        if absent and not len(rests)
    ]
    if empty:
        raise InputErrors(empty)
    rows = zip(content.trials, trials, found, missing, strict=True)
    return [_with(t, r, rests) if absent else r for t, r, rests, absent in rows]


def _has_to_be_found(trial: MappedTrial, recorded: Recorded) -> bool:
    stated = trial.dwells is not None or recorded.dwells is not None
    return trial.kind == "static" and not stated and recorded.means is None and recorded.markers is not None


def _refusal(trial: str) -> str:
    return (
        f"trial {trial} is declared static, and neither readings nor markers rest for {LEAST:g} s between two motions; "
        "record postures of 2 s each, state `dwells: [[start, stop], ...]` [s, markers' clock], or declare its kind"
    )


def _with(trial: MappedTrial, recorded: Recorded, rests: np.ndarray) -> Recorded:
    length = rests[:, 1] - rests[:, 0]
    note = f"{trial.id}: {len(rests)} rests of {length.min():.1f}-{length.max():.1f} s found; `dwells` overrides them"
    return replace(recorded, dwells=rests, notes=(*recorded.notes, note))
