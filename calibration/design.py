"""Choosing the postures that tell most: greedily one after another, then exchanging one for a better one while any is.

    D   least volume of what is left,  log det C
    E   least variance of the worst direction,  the largest eigenvalue of C        (in units of the tolerances)
    G   least worst-case error of the hand,  max_e trace(P_e C P_e'); its 8th power mean is what is minimised

Each candidate's value comes from the update  C <- C - C B' (I + B C B')^-1 B C  for all candidates at once. The
largest eigenvalue is bounded from below on the directions that are the worst now. An exchange is kept only if the
criterion itself falls.
Reference: Fedorov, Theory of Optimal Experiments, 1972.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.information import Prospect

Criterion = Literal["D", "E", "G"]
_POWER = 8
_WORST = 5  # directions the largest eigenvalue is sought in
_SWEEPS = 3
_BETTER = 1e-4  # relative change of the criterion that is worth an exchange [-]


@dataclass(frozen=True)
class _Rule:
    """A criterion, lower is better: its value at C (r, r), and (n,) at C with each candidate's B added."""

    value: Callable[[Prospect, np.ndarray], float]
    values: Callable[[Prospect, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def choose(prospect: Prospect, n: int, criterion: Criterion = "G", chosen: np.ndarray | None = None) -> np.ndarray:
    """Indices (n,) of the candidates to record, in the order they were chosen; exchanged from `chosen` where given."""
    rule, chosen = _RULES[criterion], np.zeros(0, dtype=int) if chosen is None else chosen
    while len(chosen) < n:
        chosen = np.append(chosen, _best(rule, prospect, prospect.after(chosen), chosen))
    for _ in range(_SWEEPS):
        before = chosen
        for k in range(n):
            chosen = _exchanged(rule, prospect, chosen, k)
        if (chosen == before).all():
            break
    return chosen


def _exchanged(rule: _Rule, prospect: Prospect, chosen: np.ndarray, k: int) -> np.ndarray:
    """The choice with its k-th posture exchanged for a better one, if there is one."""
    others = np.delete(chosen, k)
    trial = np.array(chosen)
    trial[k] = _best(rule, prospect, prospect.after(others), others)
    now, then = (rule.value(prospect, prospect.after(c)) for c in (chosen, trial))
    return trial if then < now - _BETTER * abs(now) else chosen


def _best(rule: _Rule, prospect: Prospect, C: np.ndarray, taken: np.ndarray) -> int:
    BC = prospect.B @ C
    K = BC @ np.swapaxes(prospect.B, 1, 2) + np.eye(BC.shape[1])
    values = rule.values(prospect, C, BC, K)
    values[taken] = np.inf
    return int(values.argmin())


def _volumes(prospect: Prospect, C: np.ndarray, BC: np.ndarray, K: np.ndarray) -> np.ndarray:
    return -np.asarray(np.linalg.slogdet(K)[1])


def _volume(prospect: Prospect, C: np.ndarray) -> float:
    return float(np.linalg.slogdet(C)[1])


def _largest(prospect: Prospect, C: np.ndarray) -> float:
    return float(np.linalg.eigvalsh(C)[-1])


def _largest_of_each(prospect: Prospect, C: np.ndarray, BC: np.ndarray, K: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(C)
    H = np.linalg.solve(np.linalg.cholesky(K), BC @ vectors[:, -_WORST:])
    left = np.diag(values[-_WORST:]) - np.swapaxes(H, 1, 2) @ H
    return np.asarray(np.linalg.eigvalsh(left)[:, -1])


def _hand(prospect: Prospect, C: np.ndarray) -> float:
    return float((prospect.hand(C) ** (2 * _POWER)).mean() ** (0.5 / _POWER))


def _hand_of_each(prospect: Prospect, C: np.ndarray, BC: np.ndarray, K: np.ndarray) -> np.ndarray:
    n, d, r = BC.shape
    H = np.linalg.solve(np.linalg.cholesky(K), BC)
    moved = (H.reshape(n * d, r) @ prospect.P.reshape(-1, r).T).reshape(n, d, len(prospect.P), 3)
    left = np.maximum(prospect.hand(C) ** 2 - np.einsum("ndei,ndei->ne", moved, moved), 0.0)
    return np.asarray(((left / left.max()) ** _POWER).mean(axis=1))


_RULES: dict[Criterion, _Rule] = {
    "D": _Rule(_volume, _volumes),
    "E": _Rule(_largest, _largest_of_each),
    "G": _Rule(_hand, _hand_of_each),
}
