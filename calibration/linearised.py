"""A calibration problem at one value of its parameters, and what is believed of them beforehand."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Linearised:
    """Residuals of n postures with d components each.

    Attributes:
        theta: (p,).
        r: (n, d) residuals [m, rad].
        J: (n, d, p) their derivatives.
        J_joint: (n, d, k) by joint position.
    """

    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray
    J_joint: np.ndarray

    def rows(self, chosen: np.ndarray) -> "Linearised":
        """Some of the postures."""
        return Linearised(self.theta, self.r[chosen], self.J[chosen], self.J_joint[chosen])

    def moved(self, change: np.ndarray) -> "Linearised":
        """The same linear problem at theta + change."""
        return Linearised(self.theta + change, self.r + self.J @ change, self.J, self.J_joint)


@dataclass(frozen=True)
class Prior:
    """Independent Gaussian priors.

    Attributes:
        nominal: (p,).
        tolerance: (p,) standard deviations; inf where there is none.
        group: (p,) parameters whose tolerances share a factor decided by the data; -1: as it stands.
    """

    nominal: np.ndarray
    tolerance: np.ndarray
    group: np.ndarray

    @property
    def scale(self) -> np.ndarray:
        """(p,) finite scale of each parameter: its tolerance, else 1 mm or 1 mrad [m, rad]."""
        return np.where(np.isfinite(self.tolerance), self.tolerance, 1e-3)

    @property
    def n_groups(self) -> int:
        """Number of groups with a factor."""
        return int(self.group.max(initial=-1)) + 1

    def factor(self, f: np.ndarray) -> np.ndarray:
        """(p,) factor on each squared tolerance, 1 where the group is -1."""
        return np.append(f, 1.0)[self.group]

    def precision(self, f: np.ndarray) -> np.ndarray:
        """(p,) inverse variances with factors f (h,) on the squared tolerances."""
        return 1.0 / (self.factor(f) * self.tolerance**2)

    def held(self, f: np.ndarray, strength: float) -> float:
        """Minus twice the logarithm of the priors' own constant, and of what holds f near 1."""
        sizes = np.bincount(self.group[self.group >= 0], minlength=len(f))
        return float(((sizes + strength) * np.log(f) + strength / f).sum())
