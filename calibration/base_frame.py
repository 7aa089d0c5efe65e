"""The base frame from yaw spins and drives: where the robot turns, and which way it goes.

    T_lab_B(i) = T_lab_floor  E(x_i, y_i, phi_i)  T_base_B  exp6(e_i),     e_i ~ N(0, S_i)

    floor    through a known height, tilted by (a, b) about the lab's x and y; the base stands upright on it
    E        pose of the base frame on the floor, a nuisance of every rest
    T_base_B the marker body B in the base frame, what is asked for, (x, y, z, rx, ry, rz)

Motion ties the rests of a trial together (`base_ties`), up to a wander of s a step that is estimated, one s a trial
(`base_wander`); s = 0 is the rigid spin of a turntable. Spins give the axis; rz, the forward direction, needs a drive;
z the floor.
Reference: Heins, mobile_manipulation_central, calibration notes, 2022, eq. 3-4, for the question.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.base_motion import Stations
from calibration.base_ties import ties
from calibration.base_wander import wander_of
from calibration.se3 import adjoint, compose, from_vector, inverse, local_twist, rotation_vector

_BASE, _TILT = slice(0, 6), slice(6, 8)  # of the common parameters
_STEPS = 40
_REST = 1e-5  # steps smaller than this, in standard deviations, end the iteration [-]


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


def _reduced(stations: Stations, state: BaseFrame, floor: np.ndarray, columns: np.ndarray) -> Reduced:
    W = np.linalg.inv(np.linalg.cholesky(stations.covariance))
    r, J_g, J_d = residuals(state.base, state.tilt, state.planar, stations, floor)
    r, J_g, J_d = (W @ r[..., None])[..., 0], (W @ J_g)[:, :, columns], W @ J_d
    J_t = np.swapaxes(J_d, 1, 2)
    H = np.linalg.inv(J_t @ J_d)
    d0, D = -(H @ J_t @ r[..., None])[..., 0], H @ J_t @ J_g
    rest = (r + (J_d @ d0[..., None])[..., 0]).ravel()
    Q, R = np.linalg.qr((J_g - J_d @ D).reshape(len(rest), -1))
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


def _step(
    stations: Stations, state: BaseFrame, floor: np.ndarray, columns: np.ndarray, v: np.ndarray
) -> tuple[BaseFrame, np.ndarray, float]:
    """One Gauss-Newton step for all, s^2 = v estimated at the linearisation; its largest entry, in sigmas [-]."""
    p = _reduced(stations, state, floor, columns)
    v = wander_of(np.concatenate([p.c, p.h]), np.vstack([p.X, p.R]), p.V, p.trial, v)
    V_inv = np.linalg.inv(p.V + np.diag(v[p.trial]))
    covariance = np.linalg.inv(p.X.T @ V_inv @ p.X + p.R.T @ p.R)
    g = -covariance @ (p.X.T @ V_inv @ p.c + p.R.T @ p.h)
    slip = V_inv @ (p.c + p.X @ g)
    d = p.d0 - p.D @ g - np.einsum("mnl,m->nl", p.G, slip)
    common, padded = np.zeros(8), np.zeros((8, 8))
    common[columns], padded[np.ix_(columns, columns)] = g, covariance
    squared = p.left + float(slip @ (p.c + p.X @ g) + ((p.h + p.R @ g) ** 2).sum())
    dof = 3 * len(p.d0) + len(p.c) - len(g)
    grown = BaseFrame(
        base=state.base + common[_BASE],
        tilt=state.tilt + common[_TILT],
        planar=state.planar + d,
        wander=np.sqrt(v),
        covariance=padded,
        chi2=squared / max(1, dof),
        converged=False,
    )
    step = max(np.abs(g / np.sqrt(np.diag(covariance))).max(), np.abs(d / p.sigma).max())
    return grown, v, float(step)


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
    r = np.concatenate(
        [(R_t @ (T[:, :3, 3] - stations.T[:, :3, 3])[..., None])[..., 0], rotation_vector(error)], axis=1
    )
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
