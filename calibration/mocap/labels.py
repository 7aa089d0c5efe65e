"""Labels of markers that a motion capture has exchanged: found by a cluster's residual, corrected or masked.

    e(P) = rms distance of the markers, labels permuted by P, from their rigid cluster where it fits them best

A rigid cluster's residual is of the size of noise and drilling, whatever its pose. Where it exceeds a tenth of the
cluster's shortest edge, something is labelled wrongly: the permutation that fits best is taken if it is within that
limit and no other fits nearly as well. Of several that fit, as a cluster alike in two directions has, the one is taken
that leaves the markers where they were just before and after, if no other comes nearly as near; otherwise the body's
markers are masked at that instant. A single foreign marker is masked alone where the others are rigid without it. A
drawing that is off raises the limit to three times the trial's usual misfit. For exchanges that keep the shape see
`label_jumps`.

Exchanges of labels that keep a body's shape: identified by markers that jump, corrected by the order that did not.

    d(P) = rms |p_k[a] - p_k-1[P(a)]|, labels a          angle(R_P) > w dt,  x_P(a) ~ R_P x_a + c

Where both frames show three markers, these decide; else a hidden one is taken where the body's pose puts it, although
exchanged labels turn that pose.
Between two frames dt apart the identity moves markers by more than half the cluster's shortest edge, and an order P by
less than a third of it: the labels were exchanged by P, unless the body itself turned as P turns the drawing, which no
robot's does faster than w. From there on they stay so until the next jump. Right are the labels that most frames have;
where no order has twice the frames of any other, nobody knows, and the body is masked in the whole trial.
A body whose labels are exchanged throughout a trial shows no jump.
"""

import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from calibration.mocap.cluster_pose import body_poses, misfit
from calibration.mocap.ghosts import without_ghosts
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import rotation_vector
from calibration.numerics.signals import interpolate_columns
from calibration.recording.dataset import Dataset
from calibration.recording.holes import without_holes
from calibration.recording.schema import Body, Description, Role, TrialEntry
from calibration.recording.trial import Trial

_LIMIT = 0.1  # of the shortest edge [-]
_CLEAR = 3.0  # times better than the next permutation [-]
_NEAR = 1.0  # [s] within which markers seen rightly show where they are
_log = logging.getLogger(__name__)
MOST = 6  # markers of a cluster whose permutations are tried: 720
_FASTEST = 10.0  # [rad/s] three times an arm joint's highest speed
_JUMP = 0.5  # of the shortest edge [-]
_CLEAR_JUMP = 3.0  # times nearer than with the labels as they are [-]
_SURE = 2.0  # times the frames of any other order [-]


def with_right_labels(bodies: Sequence[Body], trial: Trial) -> Trial:
    """The trial with exchanged labels corrected; the trial itself where nothing was wrong."""
    position = trial.marker_position
    for body in bodies:
        columns = _columns(body, trial)
        xyz = np.array([m.xyz for m in body.markers if m.name in trial.marker])
        if len(columns) < 3 or not len(position):
            continue
        before = position[:, columns]
        after = without_jumps(xyz, trial.t_mocap, _of_one_shape(xyz, trial.t_mocap, before))
        rows = np.flatnonzero(_changed(before, after).any(axis=1))
        if len(rows):
            n_masked = int(np.isnan(after[rows]).all(axis=(1, 2)).sum())
            text = "%s: labels of body %r exchanged: %d frames corrected, %d masked"
            _log.warning(text, trial.id, body.name, len(rows) - n_masked, n_masked)
        right = without_ghosts(xyz, trial.t_mocap, after)
        if n := int(_changed(after, right).sum()):
            _log.warning("%s: body %r: %d positions masked that its shape contradicts", trial.id, body.name, n)
        if len(rows) or n:
            position = position.copy()
            position[:, columns] = right
    return trial if position is trial.marker_position else replace(trial, marker_position=position)


def _changed(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Which markers (n, m) of positions (n, m, 3) are elsewhere, or masked."""
    return np.asarray(((after != before) & ~(np.isnan(after) & np.isnan(before))).any(axis=2))


def relabelled_trial(dataset: Dataset, entry: TrialEntry) -> MeasuredTrial:
    """Read one continuous trial, exchanged marker labels corrected, lost samples left out.

    Raises:
        InputError: As `Dataset.read`.
    """
    description = dataset.description
    return _relabelled(description, dataset.read(entry))


def relabelled_trials(dataset: Dataset, role: Role, *kinds: str) -> Iterator[tuple[TrialEntry, MeasuredTrial]]:
    """Read the continuous trials of a role one after the other, as `relabelled_trial`."""
    for entry, trial in dataset.trials(role, *kinds):
        yield entry, _relabelled(dataset.description, trial)


def _relabelled(description: Description, trial: Trial) -> MeasuredTrial:
    return MeasuredTrial.of(description, with_right_labels(description.bodies, without_holes(trial)))


def _of_one_shape(xyz: np.ndarray, t: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) corrected or masked where they have not the cluster's shape."""
    found = misfit(xyz, p)
    rows = np.flatnonzero(found > max(_limit(xyz), _CLEAR * float(np.median(found))))
    if not len(rows):
        return p
    out = p.copy()
    out[rows] = _mended(xyz, p[rows], _places(t, p, rows))
    return out


def _columns(body: Body, trial: Trial) -> np.ndarray:
    """Where the body's markers are in the trial, in the body's order."""
    return np.array([trial.marker.index(m.name) for m in body.markers if m.name in trial.marker], dtype=int)


def _limit(xyz: np.ndarray) -> float:
    return _LIMIT * shortest_edge(xyz)


def _places(t: np.ndarray, p: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Where markers p (n, m, 3) are in the `wrong` rows by those around them at t (n,) [s]; NaN where none are near."""
    right = np.setdiff1d(np.arange(len(t)), wrong)
    out = np.full((len(wrong), *p.shape[1:]), np.nan)
    for k in range(p.shape[1]):
        seen = right[np.isfinite(p[right, k]).all(axis=1)]
        if not len(seen):
            continue
        after = np.clip(np.searchsorted(seen, wrong), 1, max(len(seen) - 1, 1))
        apart = np.abs(t[wrong] - t[seen[[after - 1, np.minimum(after, len(seen) - 1)]]]).min(axis=0)
        at = interpolate_columns(t[wrong], t[seen], p[seen, k])
        out[:, k] = np.where(apart[:, None] <= _NEAR, at, np.nan)
    return out


def _mended(xyz: np.ndarray, p: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) in the order that fits, or NaN; `places` (n, m, 3) is where they were around."""
    m = p.shape[1]
    orders = np.array(list(permutations(range(m)))) if m <= MOST else np.arange(m)[None]
    found = np.array([misfit(xyz, p[:, order]) for order in orders])
    fits = found <= _limit(xyz)
    found[:, np.isfinite(p).all(axis=2).sum(axis=1) < 4] = np.inf  # three say nothing by their shape
    moved = np.where(fits, np.array([_apart(p[:, order], places) for order in orders]), np.inf)
    by_shape = _clearest(found) & (fits & np.isfinite(found)).any(axis=0)
    by_place = _clearest(moved) & np.isfinite(moved).any(axis=0)
    best = orders[np.where(by_shape, np.argmin(found, axis=0), np.argmin(moved, axis=0))]
    clear = (by_shape | by_place)[:, None, None]
    out = np.where(clear, np.take_along_axis(p, best[:, :, None], axis=1), np.nan)
    return _without_one(xyz, p, out)


def _clearest(found: np.ndarray) -> np.ndarray:
    """Where one of the orders (k, n) is far better than all others."""
    rank = np.sort(found, axis=0)
    second = rank[1] if len(rank) > 1 else np.full(found.shape[1], np.inf)
    return np.asarray(second > _CLEAR * rank[0])


def _apart(p: np.ndarray, places: np.ndarray) -> np.ndarray:
    """rms distance (n,) [m] of markers p (n, m, 3) from their places; infinite where fewer than three are known."""
    d = ((p - places) ** 2).sum(axis=2)
    known = np.isfinite(d).sum(axis=1)
    return np.where(known >= 3, np.sqrt(np.nansum(d, axis=1) / np.maximum(known, 1)), np.inf)


def _without_one(xyz: np.ndarray, p: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Where no order fits: the markers without the one that is not of the cluster, if four others agree."""
    lost = np.isnan(out).all(axis=(1, 2))
    for k in range(p.shape[1]):
        rest = p.copy()
        rest[:, k] = np.nan
        enough = np.isfinite(rest).all(axis=2).sum(axis=1) >= 3
        take = lost & enough & (misfit(xyz, rest) <= 0.1 * _limit(xyz))
        out[take], lost = rest[take], lost & ~take
    return out


def without_jumps(xyz: np.ndarray, t: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) [m, lab] in the order that most frames have; all NaN where none has; p itself if it stays.

    Args:
        xyz: (m, 3) drawing [m, body].
        t: (n,) [s].
        p: (n, m, 3) [m, lab], NaN where hidden.
    """
    rows = np.flatnonzero(np.isfinite(p).all(axis=2).sum(axis=1) >= 3)
    if len(xyz) > MOST or len(rows) < 2:
        return p
    whole = _completed(xyz, p[rows])
    before, after = whole[:-1], whole[1:]
    jumped = np.flatnonzero(_apart(after, before) > _JUMP * shortest_edge(xyz))
    if not len(jumped):
        return p
    seen = p[rows[jumped]], p[rows[jumped + 1]]
    exchanged = _exchanges(xyz, np.diff(t[rows])[jumped], (before[jumped], after[jumped]), seen)
    if (exchanged == np.arange(len(xyz))).all():
        return p
    starts = np.concatenate([[0], rows[jumped + 1], [len(p)]])
    states = [np.arange(len(xyz))]
    for order in exchanged:
        states.append(states[-1][order])
    frames: Counter[tuple[int, ...]] = Counter()
    for state, n in zip(states, np.histogram(rows, starts)[0], strict=True):
        frames[tuple(state.tolist())] += int(n)
    (right, most), *others = frames.most_common()
    if others and most < _SURE * others[0][1]:
        return np.full_like(p, np.nan)
    out = p.copy()
    for state, start, stop in zip(states, starts[:-1], starts[1:], strict=True):
        out[start:stop, np.argsort(right)[state]] = p[start:stop]
    return out


def _completed(xyz: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Markers (n, m, 3) with the hidden ones where the body's pose puts them; hidden where it has none."""
    if np.isfinite(p).all():
        return p
    T = body_poses(xyz, p).T
    return np.where(np.isfinite(p), p, np.einsum("nij,mj->nmi", T[:, :3, :3], xyz) + T[:, None, :3, 3])


def shortest_edge(xyz: np.ndarray) -> float:
    """Of a cluster (m, 3) [m]."""
    return min(float(np.linalg.norm(a - b)) for a, b in combinations(xyz, 2))


def _exchanges(
    xyz: np.ndarray, dt: np.ndarray, whole: tuple[np.ndarray, np.ndarray], seen: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """For each jump (k,) the order P (k, m) that explains it, else the identity: markers (k, m, 3) before it, after."""
    orders = np.array(list(permutations(range(len(xyz)))))
    turns = np.linalg.norm(rotation_vector(body_poses(xyz, xyz[orders]).T[:, :3, :3]), axis=1)
    d, by_pose = (np.array([_apart(after, before[:, P]) for P in orders]) for before, after in (seen, whole))
    d = np.where(np.isfinite(d), d, by_pose)
    d[1:][turns[1:, None] <= _FASTEST * dt] = np.inf
    best = np.argmin(d, axis=0)
    clear = d[best, np.arange(len(dt))] * _CLEAR_JUMP < d[0]
    return np.asarray(orders[np.where(clear, best, 0)])
