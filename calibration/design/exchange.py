"""The most informative postures: chosen one after another, then one exchanged for a better one while any is.

    D   least volume of what is left,  log det C
    E   least variance of the worst direction,  the largest eigenvalue of C        (in units of the tolerances)
    G   least worst-case error of the hand,  max_e trace(P_e C P_e'); its 8th power mean is what is minimised

With nuisances that no parameter describes (`information`), C + C m (C m)' takes the place of C, and the hand's error
has their share. Each candidate's value comes from the updates  C <- C - C B' (I + B C B')^-1 B C  and
C m <- C m + C B' (I + B C B')^-1 (H - B C m)  for all candidates at once. The largest eigenvalue is bounded from
below on the directions that are the worst now. An exchange is kept only if the criterion itself falls.
Reference: Fedorov, Theory of Optimal Experiments, 1972.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.design.information import Prospect

Criterion = Literal["D", "E", "G"]
_POWER = 8
_WORST = 5  # directions the largest eigenvalue is sought in
_SWEEPS = 3
_BETTER = 1e-4  # relative change of the criterion that is worth an exchange [-]


@dataclass(frozen=True)
class _Steps:
    """What each candidate would change: with L L' = I + B C B'.

    Attributes:
        C: (r, r) before.
        m: (r, z) before.
        K: (n, d, d) I + B C B'.
        G: (n, d, r) L^-1 B C, so that C falls by G' G.
        e: (n, d, z) L^-1 (H - B C m), so that C m grows by G' e.
    """

    C: np.ndarray
    m: np.ndarray
    K: np.ndarray
    G: np.ndarray
    e: np.ndarray


@dataclass(frozen=True)
class _Rule:
    """A criterion, lower is better: its value at C (r, r) and m (r, z), and (n,) with each candidate recorded too."""

    value: Callable[[Prospect, np.ndarray, np.ndarray], float]
    values: Callable[[Prospect, _Steps], np.ndarray]


def choose(prospect: Prospect, n: int, criterion: Criterion = "G", chosen: np.ndarray | None = None) -> np.ndarray:
    """Indices (n,) of the candidates to record, in the order they were chosen; exchanged from `chosen` where given."""
    rule, chosen = _RULES[criterion], np.zeros(0, dtype=int) if chosen is None else chosen
    while len(chosen) < n:
        chosen = np.append(chosen, _best(rule, prospect, chosen))
    for _ in range(_SWEEPS):
        before = chosen
        for k in range(n):
            chosen = _exchanged(rule, prospect, chosen, k)
        if (chosen == before).all():
            break
    return chosen


def _exchanged(rule: _Rule, prospect: Prospect, chosen: np.ndarray, k: int) -> np.ndarray:
    """The choice with its k-th posture exchanged for a better one, if there is one."""
    trial = np.array(chosen)
    trial[k] = _best(rule, prospect, np.delete(chosen, k))
    now, then = (rule.value(prospect, prospect.after(c), prospect.pulled(c)) for c in (chosen, trial))
    return trial if then < now - _BETTER * abs(now) else chosen


def _best(rule: _Rule, prospect: Prospect, taken: np.ndarray) -> int:
    C, m = prospect.after(taken), prospect.pulled(taken)
    BC = prospect.B @ C
    K = BC @ np.swapaxes(prospect.B, 1, 2) + np.eye(BC.shape[1])
    inverse = np.linalg.inv(np.linalg.cholesky(K))
    values = rule.values(prospect, _Steps(C, m, K, inverse @ BC, inverse @ (prospect.H - BC @ m)))
    values[taken] = np.inf
    return int(values.argmin())


def _volume(prospect: Prospect, C: np.ndarray, m: np.ndarray) -> float:
    return float(np.linalg.slogdet(C)[1] + np.linalg.slogdet(np.eye(m.shape[1]) + m.T @ C @ m)[1])


def _volumes(prospect: Prospect, to: _Steps) -> np.ndarray:
    m = to.m + np.swapaxes(prospect.B, 1, 2) @ prospect.H
    pull = np.swapaxes(m, 1, 2) @ (to.C @ to.m + np.swapaxes(to.G, 1, 2) @ to.e)
    return np.asarray(np.linalg.slogdet(np.eye(m.shape[2]) + pull)[1] - np.linalg.slogdet(to.K)[1])


def _largest(prospect: Prospect, C: np.ndarray, m: np.ndarray) -> float:
    return float(np.linalg.eigvalsh(C + (C @ m) @ (C @ m).T)[-1])


def _largest_of_each(prospect: Prospect, to: _Steps) -> np.ndarray:
    Cm = to.C @ to.m
    U = np.linalg.eigh(to.C + Cm @ Cm.T)[1][:, -_WORST:]
    H = to.G @ U
    pulled = U.T @ Cm + np.swapaxes(H, 1, 2) @ to.e
    left = U.T @ to.C @ U - np.swapaxes(H, 1, 2) @ H + pulled @ np.swapaxes(pulled, 1, 2)
    return np.asarray(np.linalg.eigvalsh(left)[:, -1])


def _hand(prospect: Prospect, C: np.ndarray, m: np.ndarray) -> float:
    return float((prospect.hand(C, m) ** (2 * _POWER)).mean() ** (0.5 / _POWER))


def _hand_of_each(prospect: Prospect, to: _Steps) -> np.ndarray:
    """With p = P G' and o = P C m - Z before:  trace(P C P') - |p|^2 + |o + p e|^2, summed up in one product with p."""
    n, d, r = to.G.shape
    p = (to.G.reshape(n * d, r) @ prospect.P.reshape(-1, r).T).reshape(n, d, -1)
    o = (prospect.P @ (to.C @ to.m) - prospect.Z).reshape(p.shape[2], -1)
    change = p * ((to.e @ np.swapaxes(to.e, 1, 2) - np.eye(d)) @ p + 2.0 * (to.e @ o.T))
    before = prospect.hand(to.C) ** 2 + (o**2).sum(axis=1).reshape(-1, 3).sum(axis=1)
    left = np.maximum(before + change.sum(axis=1).reshape(n, -1, 3).sum(axis=2), 0.0)
    return np.asarray(((left / left.max()) ** _POWER).mean(axis=1))


_RULES: dict[Criterion, _Rule] = {
    "D": _Rule(_volume, _volumes),
    "E": _Rule(_largest, _largest_of_each),
    "G": _Rule(_hand, _hand_of_each),
}
