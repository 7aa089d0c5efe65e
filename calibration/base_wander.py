"""How far a base wanders a step, told by the scatter of its ties: restricted maximum likelihood.

    y = -X g + n,    n ~ N(0, diag(V + s^2, 1))        g integrated out with a flat prior

Score and expected information of v = s^2, with P the projection that takes g out of y, Q_t the ties of trial t:

    2 score_t = y' P Q_t P y - tr(P Q_t),      2 information_tu = tr(P Q_t P Q_u),
    v <- max(0, v + information^-1 score)

Reference: Patterson, Thompson, Biometrika 1971.
"""

import numpy as np

_SCORING = 30
_STILL = 1e-3  # relative change of s^2 below which it stands still [-]


def wander_of(y: np.ndarray, X: np.ndarray, V: np.ndarray, trial: np.ndarray, v: np.ndarray) -> np.ndarray:
    """s^2 of each trial (n_trials,) [m2].

    Args:
        y: (m + p,) the m ties [m], then what the rests say of g alone, whitened [-].
        X: (m + p, p) their derivatives by g.
        V: (m, m) covariance of the ties [m2].
        trial: (m,) index of the trial of each tie.
        v: (n_trials,) where to start.
    """
    m = len(trial)
    member = (trial[:, None] == np.arange(len(v))).astype(float)
    for _ in range(_SCORING):
        inverse_V = np.eye(len(y))
        inverse_V[:m, :m] = np.linalg.inv(V + np.diag(v[trial]))
        seen = inverse_V @ X
        P = (inverse_V - seen @ np.linalg.solve(X.T @ seen, seen.T))[:m]
        score = 0.5 * member.T @ ((P @ y) ** 2 - np.diag(P[:, :m]))
        information = 0.5 * member.T @ P[:, :m] ** 2 @ member
        new = np.maximum(0.0, v + np.linalg.pinv(information) @ score)
        still = np.abs(new - v) <= _STILL * new
        v = new
        if still.all():
            break
    return v
