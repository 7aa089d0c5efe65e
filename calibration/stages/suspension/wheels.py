"""The suspension as Nguyen et al. (Humanoids 2024) print it, as a matrix of its parameters.

    F_i = Kt_i dr_i + Ct_i d(dr_i)/dt,            dr_i = t + theta x r_i
    M_i = Ktheta_i theta + Ctheta_i dtheta/dt + r_i x F_i
    w = sum_i (F_i, M_i)

(t, theta) displacement of the base frame from static rest, small; w change since then of the robot's ACTION on the
floor: a robot that presses down harder (Fz < 0) sinks (t_z < 0), so stiffnesses are positive. All in frame 0, the base
frame at rest, about its origin. r_i: centres of the wheels' hubs, or their contact points. Hence w = K x + C dx/dt,

    K = sum_i A_i' Kt_i A_i + diag(0, Ktheta_i) = sum_p k_p E_p,      A_i = [1, -[r_i]x],      C alike

Six wheels have 36 diagonal stiffnesses; one total wrench identifies at most rank(E) = 14 of their combinations (hubs at
two heights), 11 with all r_i in the floor. The same holds for damping.

Fitted as its authors' public code did: displacement -> wrench, no negative stiffness or damping.

    min sum |W^-1/2 (w - G x - sum_p k_p E_p x - sum_p c_p E_p dx/dt)|^2        k, c >= 0

W: datasheet variances of force and moment. Both signals are low-passed at 2.5 Hz here, as in that code: the rate of the
displacement is noise above. Noise of the displacement, which this direction takes for exact, makes stiffnesses too
small, and where wheels slip there is no spring to find; so the result is checked before anybody uses it.
Reference: Lawson, Hanson, Solving Least Squares Problems, 1974, ch. 23.

Names, uncertainty and status of what a suspension fit found.

    suspension.{K,C}.<i><j>      elements about the base frame's origin, i <= j, 1 to 6 for x y z rx ry rz
    suspension.<wheel>.{kx,...}  of the printed form: one total wrench identifies only combinations of them

Base markers are placed on the base with a tolerance, so where frame 0 is in the floor's plane is uncertain by
xi = (dx, dy, dpsi), which adds  dK = K ad(xi) + ad(xi)' K.  An element is `estimated` if its standard deviation, over
the geometric mean of its diagonal pair, is below 0.3 and the springs explain the motion of both its axes; where wheels
slip the number found is of no spring.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import nnls

from calibration.inference.identifiability import Identifiability, identifiability
from calibration.inference.parameters import Combination, Parameter, ParameterSet, Status
from calibration.numerics.lie import skew
from calibration.numerics.signals import RATE, Signal, low_passed
from calibration.recording.schema import Sigmas, Tolerances, Wheel
from calibration.stages.suspension.base_response import BaseResponse

Point = Literal["centre", "contact"]
AXES = ("x", "y", "z")
_PAIRS = tuple((i, j) for i in range(3) for j in range(i, 3))
_LEVER = 0.2  # [m] by which stiffnesses to rotation and to translation are compared
_CUTOFF = 2.5  # [Hz]
_STRIDE = 10  # every so many samples count
_ZERO = 1e-13  # eigenvalues of the scaled normal matrix below this share of the largest are none
_BOUND = 0.01  # share of the residual that the bounds may cost [-]
_ROUNDING = 1e-9  # of the squares to explain [-]
KNOWN = 0.3  # sigma over the geometric mean of the diagonal pair [-]


@dataclass(frozen=True)
class WheelModel:
    """The printed form for a set of wheels.

    Attributes:
        names: Of the stiffnesses, `suspension.<wheel>.{kx,...,krz}`, length p; those of the dampings have c for k.
        units: Of the stiffnesses.
        E: (p, 6, 6) derivative of K by each stiffness, and of C by each damping.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    E: np.ndarray

    def matrix(self, values: np.ndarray) -> np.ndarray:
        """K (6, 6) of stiffnesses (p,), or C of dampings."""
        return np.tensordot(values, self.E, axes=1)

    def regressor(self, x: np.ndarray) -> np.ndarray:
        """Derivative (n, 6, p) of the wrench by the stiffnesses at displacements x (n, 6); by the dampings at rates."""
        return np.asarray(np.einsum("pij,nj->nip", self.E, x))

    @property
    def structure(self) -> Identifiability:
        """What the richest motion could identify of the stiffnesses: rank and combinations."""
        scale = np.array([1.0] * 3 + [_LEVER] * 3)
        rows = (self.E / np.outer(scale, scale)).reshape(len(self.E), 36).T
        return identifiability(rows, self.parameters("k"))

    @property
    def couples(self) -> np.ndarray:
        """(6, 6) whether a wrench along j can move the base along i, through however many elements of K."""
        linked = (np.abs(self.E).max(axis=0) > 0.0).astype(int)
        return np.linalg.matrix_power(linked + np.eye(6, dtype=int), 6) > 0

    def parameters(self, letter: Literal["k", "c"]) -> ParameterSet:
        """Names, units and scales of the stiffnesses or dampings; no nominal value, no prior."""
        renamed = tuple(_renamed(n, letter) for n in self.names)
        units = tuple(u if letter == "k" else u.replace("/m", ".s/m").replace("/rad", ".s/rad") for u in self.units)
        scale = np.array([1.0 if u == "N/m" else _LEVER**2 for u in self.units])
        return ParameterSet(renamed, units, np.zeros(len(scale)), scale)


def wheel_model(wheels: Sequence[Wheel], point: Point = "centre", full: bool = False) -> WheelModel:
    """The printed form: Kt, Ct, Ktheta, Ctheta diagonal, or symmetric where `full`."""
    pairs = _PAIRS if full else tuple((i, i) for i in range(3))
    names, units, E = [], [], []
    for wheel in wheels:
        A = np.hstack([np.eye(3), -skew(np.array(getattr(wheel, point)))])
        turning = np.hstack([np.zeros((3, 3)), np.eye(3)])
        for prefix, unit, B in (("k", "N/m", A), ("kr", "N.m/rad", turning)):
            for i, j in pairs:
                names.append(f"suspension.{wheel.name}.{prefix}{AXES[i]}{AXES[j] if full else ''}")
                units.append(unit)
                E.append(np.outer(B[i], B[j]) if i == j else np.outer(B[i], B[j]) + np.outer(B[j], B[i]))
    return WheelModel(tuple(names), tuple(units), np.array(E).reshape(-1, 6, 6))


def _renamed(name: str, letter: str) -> str:
    head, last = name.rsplit(".", 1)
    return f"{head}.{letter}{last[1:]}"


def element_parameters(
    letter: str, matrix: np.ndarray, sigma: np.ndarray, couples: np.ndarray, slips: np.ndarray
) -> tuple[Parameter, ...]:
    """Upper triangle of K or C (6, 6), elements that the wheels couple; `slips` (6,) axes that no spring explains."""
    root = np.sqrt(np.abs(np.diag(matrix)))
    found = []
    for i in range(6):
        for j in range(i, 6):
            if not couples[i, j]:
                continue
            known = sigma[i, j] < KNOWN * root[i] * root[j] and not (slips[i] or slips[j])
            status: Status = "estimated" if known else "not_identifiable"
            name = f"suspension.{letter}.{i + 1}{j + 1}"
            found.append(Parameter(name, _unit(letter, i, j), 0.0, float(matrix[i, j]), float(sigma[i, j]), status))
    return tuple(found)


def wheel_parameters(
    wheels: WheelModel, values: np.ndarray, others: np.ndarray, offset: int
) -> tuple[tuple[Parameter, ...], tuple[Combination, ...]]:
    """Stiffnesses and dampings (2 p,) with their combinations, after `offset` other parameters.

    `others` (n, 2 p): the fits without one trial each; their scatter, as a jackknife, is the uncertainty.
    """
    known, p = wheels.structure, len(wheels.names)
    covariance = jackknife(others)
    sigma = np.sqrt(np.diag(covariance))
    parameters: list[Parameter] = []
    combinations: list[Combination] = []
    for k, letter in enumerate(("k", "c")):
        own = slice(k * p, k * p + p)
        names = wheels.parameters("k" if letter == "k" else "c")
        rows = zip(names.names, names.units, values[own], sigma[own], known.status, strict=True)
        parameters += [Parameter(n, u, 0.0, float(v), float(s), status) for n, u, v, s, status in rows]
        for c in known.combinations(names, values[own], covariance[own, own]):
            padded = np.zeros(offset + 2 * p)
            padded[offset + k * p : offset + k * p + p] = c.coefficients
            combinations.append(Combination(c.name, padded, c.value, c.sigma))
    return tuple(parameters), tuple(combinations)


def jackknife(others: np.ndarray) -> np.ndarray:
    """Covariance (p, p) of a value from the n values (n, p) without one trial each: (n - 1) / n sum d d'."""
    d = others - others.mean(axis=0)
    return np.asarray((len(others) - 1) / len(others) * d.T @ d)


def frame_sigma(matrix: np.ndarray, tolerances: Tolerances) -> np.ndarray:
    """Standard deviations (6, 6) of K or C by the tolerance of frame 0 in the floor's plane."""
    variance = np.zeros((6, 6))
    for axis, sigma in (
        (0, tolerances.body_translation),
        (1, tolerances.body_translation),
        (5, tolerances.body_rotation),
    ):
        xi = np.zeros(6)
        xi[axis] = sigma
        ad = np.zeros((6, 6))
        ad[:3, :3] = ad[3:, 3:] = skew(xi[3:])
        ad[:3, 3:] = skew(xi[:3])
        variance += (matrix @ ad + ad.T @ matrix) ** 2
    return np.sqrt(variance)


def _unit(letter: str, i: int, j: int) -> str:
    unit = ("N/m", "N", "N.m/rad")[(i >= 3) + (j >= 3)]
    return unit if letter == "K" else {"N/m": "N.s/m", "N": "N.s", "N.m/rad": "N.m.s/rad"}[unit]


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
