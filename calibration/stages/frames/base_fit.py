"""The base frame from yaw spins and drives: where the robot turns, and which way it goes.

    T_lab_B(i) = T_lab_floor  E_i  S_t  T_base_B  exp6(e_i),     e_i ~ N(0, C_i)        see `base_poses`

    floor    tilted by a little
    E_i      pose of an upright base on the floor, a nuisance of every rest
    S_t      how the base stands in trial t, height and tilt: zero, or sampled once a trial from N(0, standing^2)
    T_base_B the marker body B in the base frame, what is asked for, (x, y, z, rx, ry, rz)

Motion ties the rests of a trial together (`base_ties`), up to a wander of s a step that is estimated, one s a trial
(`base_wander`); s = 0 is the rigid spin of a turntable. Spins give the axis; rz, the forward direction, needs a drive;
z the floor.
Reference: Heins, mobile_manipulation_central, calibration notes, 2022, eq. 3-4, for the question.

How a motion ties the rests of a trial together.

From one rest to the next, on the floor:

spin     (dx, dy) = w                          w ~ N(0, s^2 1)     a free centre that wanders by s a step
drive    dy cos(phi) - dx sin(phi) = w         w ~ N(0, s^2)       no side slip; phi the mean heading, exact on arcs

How far a base wanders a step, by the scatter of its ties: restricted maximum likelihood.

    y = -X g + n,    n ~ N(0, diag(V + s^2, 1))        g integrated out with a flat prior

Score and expected information of v = s^2, with P the projection that takes g out of y, Q_t the ties of trial t:

    2 score_t = y' P Q_t P y - tr(P Q_t),      2 information_tu = tr(P Q_t P Q_u),
    v <- max(0, v + information^-1 score)

Reference: Patterson, Thompson, Biometrika 1971.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.numerics.lie import from_vector, inverse
from calibration.stages.frames.base_rests import Common, Stations, residuals

_STEPS = 40
_REST = 1e-5  # steps smaller than this, in standard deviations, end the iteration [-]
_SCORING = 30
_STILL = 1e-3  # relative change of s^2 below which it stands still [-]


@dataclass(frozen=True)
class BaseFrame:
    """What spins and drives identify.

    Attributes:
        common: T_base_B, the floor's tilt and how the base stood.
        planar: (n, 3) x, y and heading of the base frame at each rest [m, m, rad], about the floor's origin.
        wander: (n_trials,) s, side slip or wander of the centre a step [m].
        covariance: (p, p) of what is common, in its order; zero rows for what was fixed.
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


@dataclass(frozen=True)
class Ties:
    """Linearised constraints between rests: c(d + dd) = c + C dd.

    Attributes:
        c: (m,) value [m].
        C: (m, n, 3) derivative by every rest's planar pose.
        trial: (m,) index of the trial each row is of.
    """

    c: np.ndarray
    C: np.ndarray
    trial: np.ndarray


def ties(stations: Stations, planar: np.ndarray) -> Ties:
    """Constraints between consecutive rests of each trial, see the head of this file."""
    n, values, rows, trials = len(planar), [], [], []
    for i in range(1, n):
        trial = stations.trial[i]
        if stations.trial[i - 1] != trial:
            continue
        dx, dy = planar[i, :2] - planar[i - 1, :2]
        if stations.kinds[trial] == "spin":
            row = np.zeros((2, n, 3))
            row[:, i, :2], row[:, i - 1, :2] = np.eye(2), -np.eye(2)
            values += [dx, dy]
        else:
            phi = 0.5 * (planar[i, 2] + planar[i - 1, 2])
            s, k = np.sin(phi), np.cos(phi)
            turning = -0.5 * (dx * k + dy * s)
            row = np.zeros((1, n, 3))
            row[0, i], row[0, i - 1] = (-s, k, turning), (s, -k, turning)
            values.append(dy * k - dx * s)
        rows.append(row)
        trials += [trial] * len(row)
    return Ties(np.array(values), np.concatenate(rows), np.array(trials))


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
