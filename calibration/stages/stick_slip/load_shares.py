"""Shares of the vertical load by type of wheel, as the stiffness of heave and tilt has them.

    K = sum_i k_i a_i a_i',   a_i = (1, y_i, -x_i)   of (z, rx, ry),      k_i of wheel i's type, front casters' is 1

Wheels share the load as their vertical springs do. Sizes k_t are logarithms, fitted to K_zz, K_rx, K_ry and K_z,ry each
relative to sqrt(K_ii K_jj); ratios to front casters have the wide prior as well, which decides where a type is missing.
"""

import numpy as np
from scipy.optimize import least_squares

from calibration.stages.stick_slip.wheels import NAMES, PRIOR, PRIOR_SIGMA, Prior, WheelSet

_ELEMENTS = ((0, 0), (1, 1), (2, 2), (0, 2))
_KNOWN = np.array([0.3, 0.03, 0.05, 0.04])  # sigmas of the elements: heave hardly moves
_MODEL = 0.05  # of a logarithm: loads are shared by more than springs
_TYPES = ("drive", "front", "back")
_LOADS = [NAMES.index("drive_load"), NAMES.index("back_load")]


def prior_by_tilt(wheels: WheelSet, K: np.ndarray) -> Prior:
    """The wide prior, its shares of the load by the stiffness K (3, 3) of z, rx, ry [N/m, N, N.m/rad]."""
    a = np.column_stack([np.ones(len(wheels.position)), wheels.position[:, 1], -wheels.position[:, 0]])
    rows, columns = np.transpose(_ELEMENTS)
    size = np.sqrt(np.diag(K))
    size = size[rows] * size[columns]
    own = [a[[kind == one for one in wheels.types]] for kind in _TYPES]
    A = np.stack([(part.T @ part)[rows, columns] for part in own], axis=1) / (size * _KNOWN)[:, None]
    b = K[rows, columns] / (size * _KNOWN)
    ratios = np.array([[1.0, -1.0, 0.0], [0.0, -1.0, 1.0]])
    weighted = ratios / PRIOR_SIGMA[_LOADS][:, None]

    def residuals(log_k: np.ndarray) -> np.ndarray:
        return np.concatenate([A @ np.exp(log_k) - b, weighted @ log_k])

    def jacobian(log_k: np.ndarray) -> np.ndarray:
        return np.concatenate([A * np.exp(log_k), weighted])

    start = np.full(3, np.log(K[0, 0] / len(wheels.types)))
    found = least_squares(residuals, start, jac=jacobian, method="lm")
    covariance = ratios @ np.linalg.pinv(found.jac.T @ found.jac) @ ratios.T
    mean, sigma = PRIOR.copy(), PRIOR_SIGMA.copy()
    mean[_LOADS], sigma[_LOADS] = ratios @ found.x, np.sqrt(np.diag(covariance) + _MODEL**2)
    return Prior(mean, sigma)
