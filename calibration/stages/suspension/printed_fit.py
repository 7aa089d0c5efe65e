"""The printed form fitted as its authors' public code did: displacement -> wrench, no negative stiffness or damping.

    min sum |W^-1/2 (w - G x - sum_p k_p E_p x - sum_p c_p E_p dx/dt)|^2        k, c >= 0

W: datasheet variances of force and moment. Both signals are low-passed at 2.5 Hz here, as in that code: the rate of the
displacement is noise above. Noise of the displacement, which this direction takes for exact, makes stiffnesses too
small, and where wheels slip there is no spring to find; so the result is checked before anybody uses it.
Reference: Lawson, Hanson, Solving Least Squares Problems, 1974, ch. 23.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from calibration.numerics.signals import RATE, Signal, low_passed
from calibration.recording.schema import Sigmas
from calibration.stages.suspension.base_response import BaseResponse
from calibration.stages.suspension.wheels import WheelModel

_CUTOFF = 2.5  # [Hz]
_STRIDE = 10  # every so many samples count
_ZERO = 1e-13  # eigenvalues of the scaled normal matrix below this share of the largest are none

_BOUND = 0.01  # share of the residual that the bounds may cost [-]
_ROUNDING = 1e-9  # of the squares to explain [-]


@dataclass(frozen=True)
class Normal:
    """Normal equations of a trial: H p = g for p = (k, c), and the squares of what they explain."""

    H: np.ndarray
    g: np.ndarray
    squares: float


def normal_of(wheels: WheelModel, response: BaseResponse, sigmas: Sigmas) -> Normal:
    """Normal equations of one trial."""
    f = response.forcing
    both = Signal(f.t, np.hstack([response.x, f.w]), response.valid)
    smooth = low_passed(both, _CUTOFF).x
    x, w = smooth[:, :6], smooth[:, 6:] - smooth[:, :6] @ f.tangent.T
    rate = np.gradient(x, 1.0 / RATE, axis=0)
    rows = np.flatnonzero(response.valid)[::_STRIDE]
    sigma = np.array([sigmas.plate_force] * 3 + [sigmas.plate_moment] * 3)
    A = np.concatenate([wheels.regressor(x[rows]), wheels.regressor(rate[rows])], axis=2) / sigma[:, None]
    A = A.reshape(-1, 2 * len(wheels.names))
    b = (w[rows] / sigma).ravel()
    return Normal(A.T @ A, A.T @ b, float(b @ b))


def solve(wheels: WheelModel, normals: Sequence[Normal]) -> np.ndarray:
    """Stiffnesses and dampings (2 p,), none negative."""
    A, b, scale = _reduced(normals)
    return np.asarray(nnls(A, b, maxiter=100 * len(scale))[0] / scale)


def bound(wheels: WheelModel, normals: Sequence[Normal], values: np.ndarray) -> str:
    """The stiffness or damping (2 p,) that its bound keeps from a negative value, the worst; empty where none is.

    A zero alone is no bound: of parameters that only combine, many are zero. The bound holds where, without it, the
    residual would be smaller by a hundredth.
    """
    A, b, scale = _reduced(normals)
    r = b - A @ (values * scale)
    free = sum(n.squares for n in normals) - float(b @ b)
    pull = A.T @ r
    if float(r @ r) <= _BOUND * max(free, 0.0) + _ROUNDING * float(b @ b):
        return ""
    names = (*wheels.parameters("k").names, *wheels.parameters("c").names)
    return names[int(np.argmin(np.where(values > 0.0, np.inf, pull)))]


def _reduced(normals: Sequence[Normal]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (r, 2 p), b (r,) with A'A = H, A'b = g in scaled parameters, and their scale (2 p,)."""
    H, g = np.sum([n.H for n in normals], axis=0), np.sum([n.g for n in normals], axis=0)
    scale = np.sqrt(np.maximum(np.diag(H), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(H / np.outer(scale, scale))
    kept = values > _ZERO * values[-1]
    root = np.sqrt(values[kept])
    return root[:, None] * vectors[:, kept].T, (vectors[:, kept].T @ (g / scale)) / root, scale


def matrices(wheels: WheelModel, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """K and C (6, 6) of stiffnesses and dampings (2 p,)."""
    p = len(wheels.names)
    return wheels.matrix(values[:p]), wheels.matrix(values[p:])
