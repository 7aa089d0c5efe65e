"""Exchanges of labels that keep a body's shape: told by markers that jump, set right by the order that did not.

    d(P) = rms |p_k[a] - p_k-1[P(a)]|, labels a          angle(R_P) > w dt,  x_P(a) ~ R_P x_a + c

Between two frames dt apart the identity moves markers by more than half the cluster's shortest edge, and an order P by
less than a third of it: the labels were exchanged by P, unless the body itself turned as P turns the drawing, which no
robot's does faster than w. From there on they stay so until the next jump. Right are the labels that most frames have;
where no order has twice the frames of any other, nobody knows, and the body is masked in the whole trial.
A body whose labels are exchanged throughout a trial shows no jump.
"""

from collections import Counter
from itertools import combinations, permutations

import numpy as np

from calibration.bodies import body_poses
from calibration.se3 import rotation_vector

MOST = 6  # markers of a cluster whose permutations are tried: 720
_FASTEST = 10.0  # [rad/s] three times an arm joint's highest speed
_JUMP = 0.5  # of the shortest edge [-]
_CLEAR = 3.0  # times nearer than with the labels as they are [-]
_SURE = 2.0  # times the frames of any other order [-]


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
    before, after = p[rows[:-1]], p[rows[1:]]
    jumped = np.flatnonzero(_apart(after, before) > _JUMP * shortest_edge(xyz))
    exchanged = _exchanges(xyz, np.diff(t[rows])[jumped], before[jumped], after[jumped])
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


def shortest_edge(xyz: np.ndarray) -> float:
    """Of a cluster (m, 3) [m]."""
    return min(float(np.linalg.norm(a - b)) for a, b in combinations(xyz, 2))


def _exchanges(xyz: np.ndarray, dt: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """For each jump (k,) from `before` to `after` (k, m, 3) the order P (k, m) that explains it, or the identity."""
    orders = np.array(list(permutations(range(len(xyz)))))
    turns = np.linalg.norm(rotation_vector(body_poses(xyz, xyz[orders]).T[:, :3, :3]), axis=1)
    d = np.array([_apart(after, before[:, order]) for order in orders])
    d[1:][turns[1:, None] <= _FASTEST * dt] = np.inf
    best = np.argmin(d, axis=0)
    clear = d[best, np.arange(len(dt))] * _CLEAR < d[0]
    return np.asarray(orders[np.where(clear, best, 0)])


def _apart(p: np.ndarray, other: np.ndarray) -> np.ndarray:
    """rms distance (n,) [m] of markers (n, m, 3) seen in both; infinite for fewer than three."""
    d = ((p - other) ** 2).sum(axis=2)
    seen = np.isfinite(d).sum(axis=1)
    return np.where(seen >= 3, np.sqrt(np.nansum(d, axis=1) / np.maximum(seen, 1)), np.inf)
