"""What may be wrong with submitted poses: rejected where they cannot be a prediction, else a warning with its size.

e_k = p_k - p_measured,k [m, lab]        share of it that c explains: 1 - sum |e - c|^2 / sum |e|^2 [-]

c_k = b  or  R_k b    an offset in the axes of lab or hand        c_k = (s - 1) p_k    a scale
c_k = p_k - p_measured(t_k + lag)                                                      another clock
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from calibration.errors import InputError
from calibration.evaluation.pose_errors import PoseErrors, pose_errors
from calibration.numerics.lie import compose, inverse, mean

_FAR, _TURNED = 0.3, 1.0  # [m], [rad] errors that are no prediction's
_SMALL, _SLIGHT, _EXPLAINED = 5e-3, 0.05, 0.8  # [m], [rad], [-] errors, and share of them, whose cause is named
_NEAR = 50  # samples about the lag of highest correlation
_ALIKE = 0.1  # [-] share of the error that an explanation may leave
_FRAMES, _APART = 100, 0.1  # [-], [s] samples whose lag is looked for, and the largest distance between them
_ORDER = "the order of the quaternions is not the one that is named (w, x, y, z or x, y, z, w)"


def check_clock(path: Path, trial: str, t: np.ndarray, t_mocap: np.ndarray) -> None:
    """Raise InputError unless the times [s] are those of the motion capture."""
    overlap = min(t[-1], t_mocap[-1]) - max(t[0], t_mocap[0])
    if overlap < 0.5 * min(t[-1] - t[0], t_mocap[-1] - t_mocap[0]):
        ours, theirs = (f"{x[0]:.2f} to {x[-1]:.2f} s" for x in (t_mocap, t))
        raise InputError(path, f"{trial}: times {theirs} are on another clock; the motion capture's are {ours}")


def check_poses(path: Path, trial: str, t: np.ndarray, T: np.ndarray, T_measured: np.ndarray) -> None:
    """Raise InputError where most poses (n, 4, 4) err more than a prediction can, with what explains them."""
    both = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(T_measured).all(axis=(1, 2))
    if not both.any():
        return
    far, turned = _medians(T[both], T_measured[both])
    if far < _FAR and turned < _TURNED:
        return
    unknown = f"median errors of {far:.2f} m and {np.degrees(turned):.0f} deg are no prediction's"
    raise InputError(
        path,
        f"{trial}: {_reason(_explanations(t[both], T[both], T_measured[both]), T[both], T_measured[both]) or unknown}",
    )


def doubts(t: np.ndarray, T: np.ndarray, errors: PoseErrors) -> Iterator[str]:
    """Causes that explain nearly all of the errors of poses T (n, 4, 4) at t (n,) [s], with their size."""
    good = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(np.hstack([errors.position, errors.rotation])).all(axis=1)
    t, T, e, phi = t[good], T[good], errors.position[good], errors.rotation[good]
    true = compose(Rotation.from_rotvec(-phi).as_matrix() @ T[:, :3, :3], T[:, :3, 3] - e)
    wrong = (np.linalg.norm(e, axis=1) > _FAR) | (np.linalg.norm(phi, axis=1) > _TURNED)
    if wrong.any():
        reason = _reason(_conversions(T[wrong]), T[wrong], true[wrong])
        limits = f"err by more than {_FAR:g} m or {_TURNED:g} rad"
        yield f"{100.0 * wrong.mean():.1f} % of the poses {limits}{': there, ' + reason if reason else ''}"
    R = T[:, :3, :3]
    yield from _cause(e, _SMALL, [*_offsets(R, e, 1e3, "mm"), *_scale(true[:, :3, 3], e), *_delay(t, T, true)])
    yield from _cause(phi, _SLIGHT, [*_offsets(R, phi, np.degrees(1.0), "deg")])


def _cause(e: np.ndarray, least: float, causes: list[tuple[float, str]]) -> Iterator[str]:
    """The one of the causes (mean square that it leaves, words) that leaves least of the errors e (n, 3)."""
    total = float((e**2).sum(axis=1).mean()) if len(e) else 0.0
    left, words = min(causes) if causes else (np.inf, "")
    if total > least**2 and left < (1.0 - _EXPLAINED) * total:
        yield f"{words} explains most of the error"


def _offsets(R: np.ndarray, e: np.ndarray, factor: float, unit: str) -> Iterator[tuple[float, str]]:
    for axes, seen in (("lab", e), ("hand", (np.swapaxes(R, 1, 2) @ e[..., None])[..., 0])):
        if len(e):
            b = seen.mean(axis=0)
            size = ", ".join(f"{x:.1f}" for x in np.round(factor * b, 1) + 0.0)
            yield _square(seen - b), f"a constant offset ({size}) {unit} in the axes of the {axes}"


def _scale(p: np.ndarray, e: np.ndarray) -> Iterator[tuple[float, str]]:
    if len(e):
        s = float((p * e).sum() / (p**2).sum())
        yield _square(e - s * p), f"a scale of {1.0 + s:.4f}"


def _delay(t: np.ndarray, T: np.ndarray, true: np.ndarray) -> Iterator[tuple[float, str]]:
    if k := _lag(t, T, true):
        left = _square(_apart(T[:, :3, 3], true[:, :3, 3], k))
        yield left, f"a delay of {_seconds(t, k):.2f} s (another clock?)"


def _lag(t: np.ndarray, T: np.ndarray, true: np.ndarray) -> int:
    """Samples that poses T are late by, where their positions are most alike; 0 of too few or too distant samples."""
    if len(t) < _FRAMES or np.median(np.diff(t)) > _APART:
        return 0
    p, q = (x[:, :3, 3] - x[:, :3, 3].mean(axis=0) for x in (T, true))
    alike = sum(scipy.signal.correlate(p[:, i], q[:, i], method="fft") for i in range(3))
    near = int(scipy.signal.correlation_lags(len(p), len(q))[np.argmax(alike)]) + np.arange(-_NEAR, _NEAR + 1)
    return int(min(near[np.abs(near) < len(p) // 2], key=lambda k: _square(_apart(p, q, k)), default=0))


def _apart(p: np.ndarray, q: np.ndarray, k: int) -> np.ndarray:
    """p_i - q_(i - k) where both are there."""
    return p[max(k, 0) : len(p) + min(k, 0)] - q[max(-k, 0) : len(q) - max(k, 0)]


def _seconds(t: np.ndarray, k: int) -> float:
    return k * float(np.median(np.diff(t)))


def _reason(explanations: Iterable[tuple[str, np.ndarray]], T: np.ndarray, true: np.ndarray) -> str:
    """The first that explains poses T (n, 4, 4); empty where none does."""
    far, turned = _medians(T, true)
    for words, other in explanations:
        left, still = _medians(other, true)
        if left < max(_ALIKE * far, 0.02) and still < max(_ALIKE * turned, 0.1):
            return words
    return ""


def _explanations(t: np.ndarray, T: np.ndarray, true: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """What may be wrong with all poses (n, 4, 4), and the poses without it."""
    yield from _conversions(T)
    if k := _lag(t, T, true):
        yield f"times are {_seconds(t, k):.2f} s late: they are on another clock", np.roll(T, -k, axis=0)
    yield "poses are in another frame: a constant transform to the lab explains them", mean(true @ inverse(T)) @ T
    yield "poses are of another frame of the hand: a constant transform explains them", T @ mean(inverse(T) @ true)


def _conversions(T: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Poses (n, 4, 4) in other units, orders or directions."""
    for unit, factor in (("mm", 1e-3), ("cm", 1e-2)):
        yield f"positions are in {unit}; they must be in m", compose(T[:, :3, :3], factor * T[:, :3, 3])
    q = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    for order in ((3, 0, 1, 2), (1, 2, 3, 0)):
        yield _ORDER, compose(Rotation.from_quat(q[:, order], scalar_first=True).as_matrix(), T[:, :3, 3])
    yield "poses are those of the lab in the hand; they must be of the hand in the lab", inverse(T)


def _medians(T: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Median distance [m] and angle [rad]."""
    found = pose_errors(T, true)
    far, turned = (float(np.median(np.linalg.norm(x, axis=1))) for x in (found.position, found.rotation))
    return far, turned


def _square(e: np.ndarray) -> float:
    return float((e**2).sum(axis=1).mean())
