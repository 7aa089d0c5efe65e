"""The printed model of a joint: motor-side reading minus link angle, from angle, gravity torque and direction.

    dtheta_hat = C_r S + C_l (1 - S)            S = 1 / (1 + exp(-rho dq))
    C_r = sum_ij A_ij theta^i tau^j             C_l = sum_ij B_ij theta^i tau^j                      [rad]

theta is the joint angle [rad], tau the nominal gravity torque at it [N.m], dq the motor-side velocity [rad/s], rho
[s/rad] says how fast the sign of dq chooses a flank. Memoryless: at rest S = 1/2, the mean of both flanks. Outside the
box of (theta, tau) it was fitted in, a polynomial says nothing: the nearest value inside is used, and flagged.

    terms:   printed   i = 1..n, j = 1..n        tensor   i = 0..n, j = 0..n        total   i + j <= n

Reference: Nguyen, Bonnet, Fernbach, Flayols, Lamiraux, Humanoids 2024, pp. 965-972.

The monomials of a joint model, conditioned for a fit, and their coefficients in printed units.

    u = (theta - theta_0) / theta_s,  w = (tau - tau_0) / tau_s    in [-1, 1]
    sum a_ij u^i w^j = sum A_ij theta^i tau^j

Terms without a constant are not closed under a shift: for them theta_0 = tau_0 = 0.
"""

from dataclasses import dataclass, field
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from calibration.errors import ShapeError
from calibration.options import Terms

Exponent = tuple[int, int]
_ZERO = 1e-6  # a gravity torque below this is none: the joint's axis is vertical [N.m]


def exponents(terms: Terms, degree: int) -> tuple[Exponent, ...]:
    """Powers (i, j) of (theta, tau) of the terms up to a degree."""
    low = 1 if terms == "printed" else 0
    square = [(i, j) for i in range(low, degree + 1) for j in range(low, degree + 1)]
    return tuple((i, j) for i, j in square if terms != "total" or i + j <= degree)


def monomials(theta: np.ndarray, tau: np.ndarray, powers: tuple[Exponent, ...]) -> np.ndarray:
    """theta^i tau^j (n, k) at theta (n,) [rad] and tau (n,) [N.m]."""
    i, j = np.array(powers, dtype=int).reshape(-1, 2).T
    return np.asarray(theta[:, None] ** i * tau[:, None] ** j)


class Quality(NamedTuple):
    """How well a joint's model explains its discrepancy.

    Attributes:
        rms: Of the discrepancy itself, its zero removed [rad].
        residual: Rms left in-sample [rad].
        r2: In-sample share of the variance explained [-].
        r2_out: The same on trials left out, one at a time [-].
    """

    rms: float = 0.0
    residual: float = 0.0
    r2: float = 0.0
    r2_out: float = 0.0


@dataclass(frozen=True)
class JointModel:
    """The printed model of one joint; without exponents it says zero.

    Attributes:
        joint: Name of the joint.
        terms: Which terms its degree means.
        degree: None is the choice "none", no correction.
        powers: (i, j) of the k terms kept.
        dropped: Exponents that were left out because their term is zero throughout.
        rho: [s/rad].
        A: (k,) coefficients of C_r [rad / (rad^i (N.m)^j)].
        B: (k,) coefficients of C_l, alike.
        domain: (2, 2) lowest and highest theta [rad], lowest and highest tau [N.m].
        zero: Motor minus link reading, mean over the static calibration postures, taken off before the fit [rad].
        covariance: (1 + 2 k, 1 + 2 k) of rho, A, B; empty where there is none.
        quality: What it explains.
        blocks: Stretches of its samples that counted as independent for the covariance; 0: not known.
    """

    joint: str
    terms: Terms
    degree: int | None
    powers: tuple[Exponent, ...]
    dropped: tuple[Exponent, ...]
    rho: float
    A: np.ndarray
    B: np.ndarray
    domain: np.ndarray
    zero: float
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    quality: Quality = field(default_factory=Quality)
    blocks: int = 0

    def __post_init__(self) -> None:
        for name, value in (("A", self.A), ("B", self.B)):
            if value.shape != (len(self.powers),):
                raise ShapeError(f"{self.joint}: {name}", value.shape, (len(self.powers),))
        if self.domain.shape != (2, 2):
            raise ShapeError(f"{self.joint}: domain", self.domain.shape, (2, 2))

    def discrepancy(self, theta: np.ndarray, tau: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Predicted motor minus link reading (n,) [rad], its zero removed, at theta, tau and motor velocity (n,)."""
        if not self.powers:
            return np.zeros(len(theta))
        M = monomials(*self.inside(theta, tau), self.powers)
        S = expit(self.rho * velocity)
        return (M @ self.A) * S + (M @ self.B) * (1.0 - S)

    def variance(self, theta: np.ndarray, tau: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Of the predicted discrepancy (n,) [rad2]: of the side the gear is on, and of what left-out trials kept.

        S is the chance of the right flank, so the side adds S (1 - S) (C_r - C_l)^2: half the backlash at rest.
        """
        M = monomials(*self.inside(theta, tau), self.powers)
        S = expit(self.rho * velocity)
        kept = self.quality.rms**2 * (1.0 - self.quality.r2_out)
        return S * (1.0 - S) * (M @ (self.A - self.B)) ** 2 + kept

    def inside(self, theta: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest angle and torque in the domain."""
        return np.clip(theta, *self.domain[0]), np.clip(tau, *self.domain[1])

    def is_outside(self, theta: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Where (n,) the model had to be asked at its domain's border; nowhere for the choice "none"."""
        inside = self.inside(theta, tau)
        moved = (inside[0] != theta) | (inside[1] != tau)
        return moved if self.powers else np.zeros(len(theta), dtype=bool)


@dataclass(frozen=True)
class Basis:
    """Scaled monomials.

    Attributes:
        powers: (i, j) of the k terms.
        centre: (2,) theta_0 [rad], tau_0 [N.m].
        scale: (2,) theta_s [rad], tau_s [N.m].
    """

    powers: tuple[Exponent, ...]
    centre: np.ndarray
    scale: np.ndarray

    def __call__(self, theta: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """u^i w^j (n, k)."""
        return monomials((theta - self.centre[0]) / self.scale[0], (tau - self.centre[1]) / self.scale[1], self.powers)

    def to_printed(self) -> np.ndarray:
        """P (k, k) with A = P a."""
        P = np.zeros((len(self.powers), len(self.powers)))
        row = {power: r for r, power in enumerate(self.powers)}
        for column, (i, j) in enumerate(self.powers):
            for p in range(i + 1):
                for q in range(j + 1):
                    c = _shifted(i, p, self.centre[0], self.scale[0]) * _shifted(j, q, self.centre[1], self.scale[1])
                    if c != 0.0:
                        P[row[p, q], column] = c
        return P


def _shifted(n: int, k: int, centre: float, scale: float) -> float:
    """Coefficient of x^k in ((x - centre) / scale)^n."""
    return comb(n, k) * (-centre) ** (n - k) / scale**n


def basis_of(powers: tuple[Exponent, ...], domain: np.ndarray) -> Basis:
    """The basis scaled to a domain (2, 2), shifted to its middle where the terms allow it."""
    closed = all((p, q) in powers for i, j in powers for p in range(i + 1) for q in range(j + 1))
    centre = domain.mean(axis=1) if closed else np.zeros(2)
    reach = np.abs(domain - centre[:, None]).max(axis=1)
    return Basis(powers, centre, np.where(reach > 0.0, reach, 1.0))


def not_zero(powers: tuple[Exponent, ...], theta: np.ndarray, tau: np.ndarray) -> tuple[Exponent, ...]:
    """The powers whose monomial is not zero throughout, at theta (n,) [rad] and tau (n,) [N.m]."""
    gone = (not np.any(theta), float(np.abs(tau).max(initial=0.0)) < _ZERO)
    return tuple((i, j) for i, j in powers if not (i and gone[0]) and not (j and gone[1]))
