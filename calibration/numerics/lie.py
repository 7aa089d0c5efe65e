"""Exponential and logarithm of rigid transforms with their derivatives, closed form, for any number of them at once.

    exp6(v, w) = (exp3(w), V v)              V      = I + (1 - cos t) / t^2 [w]x + (t - sin t) / t^3 [w]x^2
    log6(R, p) = (V^-1 p, log3(R))           V^-1   = I - [w]x / 2 + d [w]x^2,      d = (1 - (t/2) cot(t/2)) / t^2
    log6(T exp6(x)) = log6(T) + Jlog6 x      Jlog6  = [[Jlog3, D Jlog3], [0, Jlog3]],   D = d(V^-1 p) / dw

t = |w|. Twists are linear then angular, perturbations are on the right. Series take over below half a radian.
References: Sola, Deray, Atchuthan, A micro Lie theory, 2018; Bernoulli numbers for the series of t cot t.

Rigid transforms as arrays, time or posture first.

T is (n, 4, 4), a twist (n, 6) is linear then angular, local: T exp6(xi) perturbs on the right.

    T_a_c = T_a_b T_b_c
    Ad(T) = [[R, [p]x R], [0, R]]       maps a twist of b in a when T = T_a_b

A hand seen as a point: a body of one or two markers, whose mean is a place and no pose.

    p = t + R c         c the markers' mean in the body's frame [m], (R, t) the body's pose
    dp = R (v - [c]x w)  of a local twist (v, w)

Its turns are not seen. What they do to the geometry is: 33 of the 36 combinations that poses identify, see `tests`.
"""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from calibration.numerics.compiled import njit

_SMALL = 0.25  # t^2 below which series are used [rad^2]
_D = np.array([1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600, 0.0])
_TERMS = len(_D)
_INVERSE_FACTORIALS = 1.0 / np.cumprod(np.maximum(np.arange(2.0 * _TERMS + 2.0), 1.0))
_ALTERNATING = (-1.0) ** np.arange(_TERMS)
_SERIES = np.stack(  # of sin t / t, (1 - cos t) / t^2, (t - sin t) / t^3, d and its slope, by powers of t^2
    [
        *(_ALTERNATING * _INVERSE_FACTORIALS[k : k + 2 * _TERMS : 2] for k in (1, 2, 3)),
        _D,
        np.append(2.0 * (np.arange(_TERMS) * _D)[1:], 0.0),
    ],
    axis=1,
)
_NEAR_PI = 3.0  # rotations beyond this angle [rad] have no reliable axis in R - R'


def exp6(twist: np.ndarray) -> np.ndarray:
    """Transforms (..., 4, 4) of twists (..., 6) [m, rad]."""
    w = twist[..., 3:]
    sin, b, c, _, _ = _coefficients((w * w).sum(axis=-1))
    W = skew(w)
    W2, eye = W @ W, np.eye(3)
    V = eye + b * W + c * W2
    return compose(eye + sin * W + b * W2, (V @ twist[..., :3, None])[..., 0])


def log6(T: np.ndarray) -> np.ndarray:
    """Twists (..., 6) of transforms (..., 4, 4) that turn by less than pi."""
    w, p = log3(T[..., :3, :3]), T[..., :3, 3]
    d = _coefficients((w * w).sum(axis=-1))[3][..., 0]
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
    _, b, c, d, slope = _coefficients((w * w).sum(axis=-1))
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


def _coefficients(t2: np.ndarray) -> tuple[np.ndarray, ...]:
    """sin t / t, (1 - cos t) / t^2, (t - sin t) / t^3, d of V^-1 and its derivative by t over t.

    Of squared angles (...,), with two axes appended.
    """
    small = t2 < _SMALL
    y = np.where(small, t2, 0.0)
    powers = np.empty((*t2.shape, _TERMS))
    powers[..., 0] = 1.0
    powers[..., 1:] = y[..., None]
    table = np.multiply.accumulate(powers, axis=-1, out=powers) @ _SERIES
    if not small.all():
        table[~small] = _closed(t2[~small])
    return tuple(np.moveaxis(table, -1, 0)[..., None, None])


def _closed(t2: np.ndarray) -> np.ndarray:
    """The coefficients (n, 5) of squared angles (n,) that are not small."""
    t = np.sqrt(t2)
    half, sin, cos = 0.5 * t, np.sin(t), np.cos(t)
    cot = 1.0 / np.tan(half)
    d = (1.0 - half * cot) / t2
    slope = ((half / np.sin(half) ** 2 - cot) * 0.5 / t - 2.0 * d) / t2
    return np.stack([sin / t, (1.0 - cos) / t2, (t - sin) / (t2 * t), d, slope], axis=1)


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


def inverse(T: np.ndarray) -> np.ndarray:
    """T_b_a of T_a_b, (..., 4, 4)."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    return compose(R_t, -(R_t @ T[..., :3, 3:])[..., 0])


def compose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Homogeneous transforms of rotations (..., 3, 3) and translations (..., 3) [m]."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def from_vector(value: np.ndarray) -> np.ndarray:
    """Transforms (..., 4, 4) whose translation [m] and rotation vector [rad] are `value` (..., 6)."""
    flat = np.array(value, dtype=float, order="C").reshape(-1, 6)
    T = np.zeros((len(flat), 4, 4))
    from_vectors(flat, T)
    return T.reshape(*value.shape[:-1], 4, 4)


@njit(cache=True, error_model="numpy")
def from_vectors(x: np.ndarray, T: np.ndarray) -> None:
    """`from_vector` into zeros T (n, 4, 4): R = I + sin t / t [w]x + (1 - cos t) / t^2 [w]x^2."""
    for n in range(len(x)):
        w, R = x[n, 3:], T[n]
        square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
        t = np.sqrt(square)
        if t > 1e-3:
            a, b = np.sin(t) / t, 2.0 * (np.sin(0.5 * t) / t) ** 2
        else:
            a, b = 1.0 - square / 6.0 * (1.0 - square / 20.0), 0.5 - square / 24.0 * (1.0 - square / 30.0)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            R[i, i] = 1.0 - b * (w[j] * w[j] + w[k] * w[k])
            R[i, j] = b * w[i] * w[j] - a * w[k]
            R[j, i] = b * w[i] * w[j] + a * w[k]
            R[i, 3] = x[n, i]
        R[3, 3] = 1.0


def to_vector(T: np.ndarray) -> np.ndarray:
    """Translation [m] and rotation vector [rad] of T, (..., 6)."""
    return np.concatenate([T[..., :3, 3], rotation_vector(T[..., :3, :3])], axis=-1)


def rotation_vector(R: np.ndarray) -> np.ndarray:
    """log3 of rotations (..., 3, 3), (..., 3) [rad]; NaN where R is NaN."""
    flat = np.ascontiguousarray(R, dtype=float).reshape(-1, 3, 3)
    out = np.full((len(flat), 3), np.nan)
    if not _vectors(flat, out):  # some are no rotations: their nearest ones, or an error
        finite = np.isfinite(flat).all(axis=(1, 2))
        out[finite] = Rotation.from_matrix(flat[finite]).as_rotvec()
    return out.reshape(*R.shape[:-2], 3)


@njit(cache=True, error_model="numpy")
def _is_rotation(A: np.ndarray) -> bool:
    """Whether the rows of A (3, 3) are orthonormal and right-handed."""
    for i in range(3):
        for j in range(i, 3):
            dot = A[i, 0] * A[j, 0] + A[i, 1] * A[j, 1] + A[i, 2] * A[j, 2]
            if abs(dot - (i == j)) > (1e-5 if i == j else 1e-12):
                return False
    x = A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1]
    y = A[1, 2] * A[2, 0] - A[1, 0] * A[2, 2]
    z = A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0]
    return A[0, 0] * x + A[0, 1] * y + A[0, 2] * z > 0.0


@njit(cache=True, error_model="numpy")
def _vectors(R: np.ndarray, out: np.ndarray) -> bool:
    """`rotation_vector` of finite R (n, 3, 3) into `out` (n, 3), by quaternions; False where one is no rotation."""
    q = np.empty(4)
    for n in range(len(R)):
        A = R[n]
        if not np.isfinite(A.sum()):
            continue
        if not _is_rotation(A):
            return False
        trace, i = A[0, 0] + A[1, 1] + A[2, 2], 0
        for j in range(1, 3):
            i = j if A[j, j] > A[i, i] else i
        i = 3 if trace > A[i, i] else i
        j, k = (i + 1) % 3, (i + 2) % 3
        if i == 3:
            q[0], q[1], q[2], q[3] = A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1], 1.0 + trace
        else:
            q[i], q[j], q[k] = 1.0 - trace + 2.0 * A[i, i], A[j, i] + A[i, j], A[k, i] + A[i, k]
            q[3] = A[k, j] - A[j, k]
        q /= np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2) * (-1.0 if q[3] < 0.0 else 1.0)
        angle = 2.0 * np.arctan2(np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2), q[3])
        if angle > 1e-3:
            scale = angle / np.sin(0.5 * angle)
        else:
            scale = 2.0 + angle**2 / 12.0 + 7.0 * angle**4 / 2880.0
        out[n, 0], out[n, 1], out[n, 2] = scale * q[0], scale * q[1], scale * q[2]
    return True


def skew(v: np.ndarray) -> np.ndarray:
    """[v]x of vectors (..., 3): [v]x w = v x w."""
    S = np.zeros((*v.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return S - np.swapaxes(S, -1, -2)


def adjoint(T: np.ndarray) -> np.ndarray:
    """Ad(T), (..., 6, 6): twist in b -> twist in a for T = T_a_b."""
    R, p = T[..., :3, :3], T[..., :3, 3]
    Ad = np.zeros((*T.shape[:-2], 6, 6))
    Ad[..., :3, :3] = Ad[..., 3:, 3:] = R
    Ad[..., :3, 3:] = skew(p) @ R
    return Ad


def mean(T: np.ndarray) -> np.ndarray:
    """Mean pose (4, 4) of poses close to each other (n, 4, 4), samples with NaN left out."""
    T = T[np.isfinite(T).all(axis=(1, 2))]
    return compose(Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix(), T[:, :3, 3].mean(axis=0))


def local_twist(vector: np.ndarray) -> np.ndarray:
    """L (6, 6): change of translation and rotation vector -> local twist of that frame."""
    L = np.zeros((6, 6))
    L[:3, :3], L[3:, 3:] = pin.exp3(vector[3:]).T, pin.Jexp3(vector[3:])
    return L


def places(T: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Where the point c (3,) of bodies at T (n, 4, 4) is, (n, 3) [m]."""
    return np.asarray(T[:, :3, :3] @ c + T[:, :3, 3])


def moved(R: np.ndarray, twists: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Derivatives (n, 3, m) of the place of c (3,) from those of the pose, local twists (n, 6, m), R (n, 3, 3)."""
    return np.asarray(R @ (twists[:, :3] - skew(c) @ twists[:, 3:]))
