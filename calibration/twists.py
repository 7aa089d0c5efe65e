"""Exponential and logarithm of rigid transforms with their derivatives, closed form, for any number of them at once.

    exp6(v, w) = (exp3(w), V v)              V      = I + (1 - cos t) / t^2 [w]x + (t - sin t) / t^3 [w]x^2
    log6(R, p) = (V^-1 p, log3(R))           V^-1   = I - [w]x / 2 + d [w]x^2,      d = (1 - (t/2) cot(t/2)) / t^2
    log6(T exp6(x)) = log6(T) + Jlog6 x      Jlog6  = [[Jlog3, D Jlog3], [0, Jlog3]],   D = d(V^-1 p) / dw

t = |w|. Twists are linear then angular, perturbations are on the right. Series take over below half a radian.
References: Sola, Deray, Atchuthan, A micro Lie theory, 2018; Bernoulli numbers for the series of t cot t.
"""

import numpy as np

from calibration.se3 import compose, rotation_vector, skew

_SMALL = 0.25  # t^2 below which series are used [rad^2]
_D = np.array([1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600])
_INVERSE_FACTORIALS = 1.0 / np.cumprod(np.maximum(np.arange(22.0), 1.0))
_NEAR_PI = 3.0  # rotations beyond this angle [rad] have no reliable axis in R - R'


def exp6(twist: np.ndarray) -> np.ndarray:
    """Transforms (..., 4, 4) of twists (..., 6) [m, rad]."""
    w = twist[..., 3:]
    sin, b, c = _sines((w * w).sum(axis=-1))
    W = skew(w)
    W2, eye = W @ W, np.eye(3)
    V = eye + b * W + c * W2
    return compose(eye + sin * W + b * W2, (V @ twist[..., :3, None])[..., 0])


def log6(T: np.ndarray) -> np.ndarray:
    """Twists (..., 6) of transforms (..., 4, 4) that turn by less than pi."""
    w, p = log3(T[..., :3, :3]), T[..., :3, 3]
    d, _ = _d_and_slope((w * w).sum(axis=-1, keepdims=True))
    wp = _cross(w, p)
    return np.concatenate([p - 0.5 * wp + d * _cross(w, wp), w], axis=-1)


def log3(R: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) of rotations (..., 3, 3) [rad]."""
    axis = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sin = np.sqrt((axis * axis).sum(axis=-1))
    cos = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sin, cos)
    w = axis * np.where(sin > 1e-8, angle / np.maximum(sin, 1e-300), 1.0)[..., None]
    far = angle > _NEAR_PI
    if far.any():
        w[far] = rotation_vector(R[far])
    return w


def jexp6(twist: np.ndarray) -> np.ndarray:
    """Right derivatives of exp6 (..., 6, 6) at twists (..., 6): exp6(x + dx) = exp6(x) exp6(Jexp6 dx)."""
    return np.linalg.inv(jlog6(twist))


def jlog6(twist: np.ndarray) -> np.ndarray:
    """Right derivatives of log6 (..., 6, 6) at the transforms whose logarithms are `twist` (..., 6)."""
    v, w = twist[..., :3], twist[..., 3:]
    t2 = (w * w).sum(axis=-1, keepdims=True)
    d, slope = (x[..., None] for x in _d_and_slope(t2))
    _, b, c = _sines(t2[..., 0])
    W, eye = skew(w), np.eye(3)
    W2 = W @ W
    J3 = eye + 0.5 * W + d * W2
    p = ((eye + b * W + c * W2) @ v[..., None])[..., 0]
    w_p = w[..., :, None] * p[..., None, :]
    dot = (w * p).sum(axis=-1)[..., None, None]
    D = 0.5 * skew(p) + slope * (W2 @ p[..., None]) * w[..., None, :] + d * (w_p + dot * eye)
    D -= 2.0 * d * np.swapaxes(w_p, -1, -2)
    J = np.zeros((*twist.shape[:-1], 6, 6))
    J[..., :3, :3] = J[..., 3:, 3:] = J3
    J[..., :3, 3:] = D @ J3
    return J


def _sines(t2: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """sin t / t, (1 - cos t) / t^2, (t - sin t) / t^3 of squared angles, with two axes appended."""
    small = t2 < _SMALL
    x = np.where(small, 1.0, t2)
    t = np.sqrt(x)
    closed = np.sin(t) / t, (1.0 - np.cos(t)) / x, (t - np.sin(t)) / (x * t)
    y = np.where(small, t2, 0.0)
    series = [np.zeros_like(y) for _ in range(3)]
    for n in range(9, -1, -1):
        for k in range(3):
            series[k] = _INVERSE_FACTORIALS[2 * n + 1 + k] - y * series[k]
    a, b, c = (np.where(small, s, f)[..., None, None] for s, f in zip(series, closed, strict=True))
    return a, b, c


def _d_and_slope(t2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The d of V^-1 and its derivative by t over t, of squared angles."""
    small = t2 < _SMALL
    x = np.where(small, 1.0, t2)
    t = np.sqrt(x)
    half = 0.5 * t
    cot = 1.0 / np.tan(half)
    d = (1.0 - half * cot) / x
    slope = ((half / np.sin(half) ** 2 - cot) * 0.5 / t - 2.0 * d) / x
    y = np.where(small, t2, 0.0)
    powers = np.arange(len(_D))
    d_series = np.polynomial.polynomial.polyval(y, _D)
    slope_series = np.polynomial.polynomial.polyval(y, 2.0 * (powers * _D)[1:])
    return np.where(small, d_series, d), np.where(small, slope_series, slope)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of vectors (..., 3), faster than numpy's own on many."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
