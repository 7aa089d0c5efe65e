"""Names, uncertainty and status of what a suspension fit found.

    suspension.{K,C}.<i><j>      elements about the base frame's origin, i <= j, 1 to 6 for x y z rx ry rz
    suspension.<wheel>.{kx,...}  of the printed form: one total wrench tells only combinations of them

Base markers are placed on the base with a tolerance, so where frame 0 is in the floor's plane is uncertain by
xi = (dx, dy, dpsi), which adds  dK = K ad(xi) + ad(xi)' K.  An element is `estimated` if its standard deviation, over
the geometric mean of its diagonal pair, is below 0.3 and the springs explain the motion of both its axes; where wheels
slip the number found is of no spring.
"""

import numpy as np

from calibration.estimate import Parameter
from calibration.identifiability import Combination, Status
from calibration.schema import Tolerances
from calibration.se3 import skew
from calibration.suspension_wheels import WheelModel

KNOWN = 0.3  # sigma over the geometric mean of the diagonal pair [-]


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
