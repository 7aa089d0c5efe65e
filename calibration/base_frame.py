"""The base frame from yaw spins and drives: where the robot turns, and which way it goes.

    T_lab_B(i) = T_lab_floor  E_i  S_t  T_base_B  exp6(e_i),     e_i ~ N(0, C_i)        see `base_poses`

    floor    tilted by a little
    E_i      pose of an upright base on the floor, a nuisance of every rest
    S_t      how the base stands in trial t, height and tilt: zero, or drawn once a trial from N(0, standing^2)
    T_base_B the marker body B in the base frame, what is asked for, (x, y, z, rx, ry, rz)

Motion ties the rests of a trial together (`base_ties`), up to a wander of s a step that is estimated, one s a trial
(`base_wander`); s = 0 is the rigid spin of a turntable. Spins give the axis; rz, the forward direction, needs a drive;
z the floor.
Reference: Heins, mobile_manipulation_central, calibration notes, 2022, eq. 3-4, for the question.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.base_motion import Stations
from calibration.base_poses import Common, residuals
from calibration.base_ties import ties
from calibration.base_wander import wander_of
from calibration.se3 import from_vector, inverse

_STEPS = 40
_REST = 1e-5  # steps smaller than this, in standard deviations, end the iteration [-]


@dataclass(frozen=True)
class BaseFrame:
    """What spins and drives tell.

    Attributes:
        common: T_base_B, the floor's tilt and how the base stood.
        planar: (n, 3) x, y and heading of the base frame at each rest [m, m, rad], about the floor's origin.
        wander: (n_trials,) s, side slip or wander of the centre a step [m].
        covariance: (p, p) of what is common, in its order; zero rows for what was held.
        chi2: Squared whitened residuals per degree of freedom [-].
        converged: Whether the iteration came to rest.
    """

    common: Common
    planar: np.ndarray
    wander: np.ndarray
    covariance: np.ndarray
    chi2: float
    converged: bool


def fit_base_frame(
    stations: Stations, start: np.ndarray, floor: np.ndarray, free: np.ndarray, standing: np.ndarray | None = None
) -> BaseFrame:
    """Fit the model above.

    Args:
        stations: Poses of the marker body at rest.
        start: (6,) of T_base_B; what is not free stays there [m, rad].
        floor: Origin of the floor's frame in the lab (3,) [m].
        free: (6,) which of T_base_B are asked for.
        standing: Standard deviations (3,) of height [m] and tilt [rad] of the base from trial to trial; None: it
            always stands upright on the floor.
    """
    k = len(stations.kinds)
    columns = np.concatenate([free, [True, True], np.full(3 * k, standing is not None)])
    prior = np.zeros(8 + 3 * k) if standing is None else np.concatenate([np.zeros(8), np.tile(1.0 / standing, k)])
    problem = Problem(stations, floor, columns, prior)
    common = Common(start, np.zeros(2), np.zeros((k, 3)))
    state = BaseFrame(common, _planar(stations, start, floor), np.zeros(k), np.zeros((0, 0)), 0.0, False)
    for _ in range(_STEPS):
        state, step = _step(problem, state)
        if step < _REST:
            return replace(state, converged=True)
    return state


def _planar(stations: Stations, base: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Planar poses (n, 3) behind the measured ones for a level floor."""
    T = stations.T @ inverse(from_vector(base))
    return np.column_stack([T[:, :2, 3] - floor[:2], np.arctan2(T[:, 1, 0], T[:, 0, 0])])


@dataclass(frozen=True)
class Problem:
    """What is given.

    Attributes:
        stations: Poses of the marker body at rest.
        floor: Origin of the floor's frame in the lab (3,) [m].
        columns: (p,) which of the common parameters are free.
        prior: (p,) one over the standard deviation of their priors about zero; 0: none.
    """

    stations: Stations
    floor: np.ndarray
    columns: np.ndarray
    prior: np.ndarray


@dataclass(frozen=True)
class Reduced:
    """The linearised problem with every rest eliminated, d = d0 - D g - G slip; g are the free common parameters.

        ties         c + X g = -n,      n ~ N(0, V + diag(s^2))
        rests alone  h + R g = n,       n ~ N(0, 1)

    Attributes:
        d0: (n, 3) steps of the planar poses by the markers alone.
        sigma: (n, 3) their standard deviations [m, rad].
        D: (n, 3, p).
        G: (m, n, 3).
        c: (m,) [m].
        X: (m, p).
        V: (m, m) [m2].
        trial: (m,) of each tie.
        h: (p,) [-].
        R: (p, p).
        left: Squared whitened residual that no g explains [-].
    """

    d0: np.ndarray
    sigma: np.ndarray
    D: np.ndarray
    G: np.ndarray
    c: np.ndarray
    X: np.ndarray
    V: np.ndarray
    trial: np.ndarray
    h: np.ndarray
    R: np.ndarray
    left: float


def _reduced(problem: Problem, state: BaseFrame) -> Reduced:
    stations, columns = problem.stations, problem.columns
    W = np.linalg.inv(np.linalg.cholesky(stations.covariance))
    r, J_g, J_d = residuals(state.common, state.planar, stations, problem.floor)
    r, J_g, J_d = (W @ r[..., None])[..., 0], (W @ J_g)[:, :, columns], W @ J_d
    J_t = np.swapaxes(J_d, 1, 2)
    H = np.linalg.inv(J_t @ J_d)
    d0, D = -(H @ J_t @ r[..., None])[..., 0], H @ J_t @ J_g
    known = problem.prior * np.concatenate([np.zeros(8), state.common.standing.ravel()])
    rest = np.concatenate([(r + (J_d @ d0[..., None])[..., 0]).ravel(), known[columns]])
    alone = (J_g - J_d @ D).reshape(-1, columns.sum())
    Q, R = np.linalg.qr(np.vstack([alone, np.diag(problem.prior[columns])]))
    h = Q.T @ rest
    tied = ties(stations, state.planar)
    G = np.einsum("mnk,nkl->mnl", tied.C, H)
    return Reduced(
        d0=d0,
        sigma=np.sqrt(np.diagonal(H, axis1=1, axis2=2)),
        D=D,
        G=G,
        c=tied.c + np.einsum("mnk,nk->m", tied.C, d0),
        X=-np.einsum("mnk,nkg->mg", tied.C, D),
        V=np.einsum("mnl,pnl->mp", G, tied.C),
        trial=tied.trial,
        h=h,
        R=R,
        left=float(rest @ rest - h @ h),
    )


def _step(problem: Problem, state: BaseFrame) -> tuple[BaseFrame, float]:
    """One Gauss-Newton step for all, s^2 = v estimated at the linearisation; its largest entry, in sigmas [-]."""
    p, columns = _reduced(problem, state), problem.columns
    v = wander_of(np.concatenate([p.c, p.h]), np.vstack([p.X, p.R]), p.V, p.trial, state.wander**2)
    V_inv = np.linalg.inv(p.V + np.diag(v[p.trial]))
    covariance = np.linalg.inv(p.X.T @ V_inv @ p.X + p.R.T @ p.R)
    g = -covariance @ (p.X.T @ V_inv @ p.c + p.R.T @ p.h)
    slip = V_inv @ (p.c + p.X @ g)
    d = p.d0 - p.D @ g - np.einsum("mnl,m->nl", p.G, slip)
    common, padded = np.zeros(len(columns)), np.zeros((len(columns), len(columns)))
    common[columns], padded[np.ix_(columns, columns)] = g, covariance
    squared = p.left + float(slip @ (p.c + p.X @ g) + ((p.h + p.R @ g) ** 2).sum())
    dof = int(3 * len(p.d0) + len(p.c) + np.count_nonzero(problem.prior[columns]) - len(g))
    step = max(np.abs(g / np.sqrt(np.diag(covariance))).max(), np.abs(d / p.sigma).max())
    chi2 = squared / max(1, dof)
    return BaseFrame(state.common.moved(common), state.planar + d, np.sqrt(v), padded, chi2, False), float(step)
