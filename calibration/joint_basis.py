"""The monomials of a joint model, conditioned for a fit, and their coefficients in printed units.

    u = (theta - theta_0) / theta_s,  w = (tau - tau_0) / tau_s    in [-1, 1]
    sum a_ij u^i w^j = sum A_ij theta^i tau^j

Terms without a constant are not closed under a shift: for them theta_0 = tau_0 = 0.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from calibration.joint_model import Exponent, monomials

_ZERO = 1e-6  # a gravity torque below this is none: the joint's axis is vertical [N.m]


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
