"""The base frame from yaw spins and drives: where the robot turns, and which way it goes.

    T_lab_B(i) = T_lab_floor  E(x_i, y_i, phi_i)  T_base_B  exp6(e_i),     e_i ~ N(0, S_i)

    floor    through a known height, tilted by (a, b) about the lab's x and y; the base stands upright on it
    E        pose of the base frame on the floor, a nuisance of every rest
    T_base_B the marker body B in the base frame, what is asked for, (x, y, z, rx, ry, rz)

Motion ties the rests of a trial together, in base axes and from one rest to the next:

    spin     (dx, dy) = w,                         w ~ N(0, s^2)     a free centre that wanders by s a step
    drive    dy cos(phi) - dx sin(phi) = w         phi the mean heading: no side slip on any arc

s is estimated, one a trial, by restricted maximum likelihood (Fisher scoring, the linearised T_base_B integrated out);
s = 0 is the rigid spin of a turntable. Spins give the axis; rz, the forward direction, needs a drive; z needs the floor.
Reference: Heins, calibration of a mobile manipulator, 2022, eq. 3-4; Patterson, Thompson, Biometrika 1971 (REML).
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.base_motion import Stations
from calibration.se3 import local_twist
from calibration.se3 import adjoint, compose, from_vector, inverse, rotation_vector

_BASE, _TILT = slice(0, 6), slice(6, 8)  # of the common parameters
_STEPS, _SCORING = 40, 30
_REST = 1e-12  # steps smaller than this end the iteration [m, rad]
_TOWARDS_REST = 1e-3  # relative change of s^2 below which it stands still [-]


@dataclass(frozen=True)
class BaseFrame:
    """What spins and drives tell.

    Attributes:
        base: (6,) translation and rotation vector of T_base_B [m, rad].
        tilt: (2,) of the floor about the lab's x and y [rad].
        planar: (n, 3) x, y and heading of the base frame at each rest [m, m, rad], about the floor's origin.
        wander: (n_trials,) s, side slip or wander of the centre a step [m].
        covariance: (8, 8) of base, then tilt; zero rows for what was held.
        chi2: Squared whitened residuals per degree of freedom [-].
        converged: Whether the iteration came to rest.
    """

    base: np.ndarray
    tilt: np.ndarray
    planar: np.ndarray
    wander: np.ndarray
    covariance: np.ndarray
    chi2: float
    converged: bool


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


def fit_base_frame(stations: Stations, start: np.ndarray, floor: np.ndarray, free: np.ndarray) -> BaseFrame:
    """Fit the model above.

    Args:
        stations: Poses of the marker body at rest.
        start: (6,) of T_base_B; what is not free stays there [m, rad].
        floor: Origin of the floor's frame in the lab (3,) [m].
        free: (6,) which of T_base_B are asked for.
    """
    columns = np.concatenate([free, [True, True]])
    state = BaseFrame(start, np.zeros(2), _planar(stations, start, floor), np.zeros(0), np.zeros((8, 8)), 0.0, False)
    v = np.zeros(len(stations.kinds))
    for _ in range(_STEPS):
        state, v, step = _step(stations, state, floor, columns, v)
        if step < _REST:
            return replace(state, converged=True)
    return state


def _planar(stations: Stations, base: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Planar poses (n, 3) behind the measured ones for a level floor."""
    T = stations.T @ inverse(from_vector(base))
    return np.column_stack([T[:, :2, 3] - floor[:2], np.arctan2(T[:, 1, 0], T[:, 0, 0])])


def _step(
    stations: Stations, state: BaseFrame, floor: np.ndarray, columns: np.ndarray, v: np.ndarray
) -> tuple[BaseFrame, np.ndarray, float]:
    """One Gauss-Newton step for all, with s^2 = v estimated at the linearisation; and its largest entry.

    Rests are eliminated one by one: d = d0 - D g, so that g sees the ties through V = C H^-1 C' + diag(v), and the
    postures alone through U.
    """
    W = np.linalg.inv(np.linalg.cholesky(stations.covariance))
    r, J_g, J_d = residuals(state.base, state.tilt, state.planar, stations, floor)
    r, J_g, J_d = (W @ r[..., None])[..., 0], (W @ J_g)[:, :, columns], W @ J_d
    H = np.linalg.inv(np.swapaxes(J_d, 1, 2) @ J_d)
    d0, D = -(H @ np.swapaxes(J_d, 1, 2) @ r[..., None])[..., 0], H @ np.swapaxes(J_d, 1, 2) @ J_g
    left_r, left_J = (r + (J_d @ d0[..., None])[..., 0]).ravel(), (J_g - J_d @ D).reshape(-1, columns.sum())
    tied = ties(stations, state.planar)
    c, X = tied.c + np.einsum("mnk,nk->m", tied.C, d0), -np.einsum("mnk,nkg->mg", tied.C, D)
    gain = np.einsum("mnk,nkl->mnl", tied.C, H)
    V = np.einsum("mnl,pnl->mp", gain, tied.C)
    Q, R = np.linalg.qr(left_J)
    v = _wander(np.concatenate([c, Q.T @ left_r]), np.vstack([X, R]), V, tied.trial, v)
    V_inv = np.linalg.inv(V + np.diag(v[tied.trial]))
    information = X.T @ V_inv @ X + R.T @ R
    covariance = np.linalg.inv(information)
    g = -covariance @ (X.T @ V_inv @ c + R.T @ (Q.T @ left_r))
    slip = V_inv @ (c + X @ g)
    d = d0 - D @ g - np.einsum("mnl,m->nl", gain, slip)
    common = np.zeros(8)
    common[columns] = g
    padded = np.zeros((8, 8))
    padded[np.ix_(columns, columns)] = covariance
    chi2 = float(slip @ (c + X @ g) + ((left_r + left_J @ g) ** 2).sum()) / max(1, r.size - 3 * len(r) + len(c) - len(g))
    step = float(max(np.abs(common).max(), np.abs(d).max()))
    grown = BaseFrame(
        state.base + common[_BASE], state.tilt + common[_TILT], state.planar + d, np.sqrt(v), padded, chi2, False
    )
    return grown, v, step


def residuals(
    base: np.ndarray, tilt: np.ndarray, planar: np.ndarray, stations: Stations, floor: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals (n, 6) [m, rad], R_meas' (p - p_meas) and log3(R_meas' R), with derivatives.

    Returns:
        r (n, 6); by base and tilt (n, 6, 8); by the planar poses (n, 6, 3).
    """
    T_base_B, turn = from_vector(base), np.array([tilt[0], tilt[1], 0.0])
    E = from_planar(planar)
    T = compose(pin.exp3(turn), floor) @ E @ T_base_B
    R_t = np.swapaxes(stations.T[:, :3, :3], 1, 2)
    error = R_t @ T[:, :3, :3]
    r = np.concatenate([(R_t @ (T[:, :3, 3] - stations.T[:, :3, 3])[..., None])[..., 0], rotation_vector(error)], axis=1)
    twist_d = np.zeros((len(E), 6, 3))
    twist_d[:, :3, :2], twist_d[:, 5, 2] = np.swapaxes(E[:, :3, :3], 1, 2)[:, :, :2], 1.0
    twist_tilt = np.vstack([np.zeros((3, 2)), pin.Jexp3(turn)[:, :2]])
    local = np.concatenate(
        [
            np.broadcast_to(local_twist(base), (len(E), 6, 6)),
            adjoint(inverse(E @ T_base_B)) @ twist_tilt,
            adjoint(inverse(T_base_B)) @ twist_d,
        ],
        axis=2,
    )
    J_log = np.array([pin.Jlog3(R) for R in error])
    J = np.concatenate([error @ local[:, :3], J_log @ local[:, 3:]], axis=1)
    return r, J[:, :, :8], J[:, :, 8:]


def from_planar(planar: np.ndarray) -> np.ndarray:
    """E (n, 4, 4) of x, y [m] and heading [rad] (n, 3)."""
    zeros = np.zeros(len(planar))
    return from_vector(np.column_stack([planar[:, :2], zeros, zeros, zeros, planar[:, 2]]))


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


def _wander(y: np.ndarray, X: np.ndarray, V: np.ndarray, trial: np.ndarray, v: np.ndarray) -> np.ndarray:
    """s^2 of each trial [m2]: restricted likelihood of y = -X g + n, n ~ N(0, diag(V + v, 1)), by Fisher scoring.

    y and X hold the m ties first, then what the postures say alone, whitened.
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
        still = np.abs(new - v) <= _TOWARDS_REST * new
        v = new
        if still.all():
            break
    return v
