"""Parameters with their priors, and models as tables of estimated parameters."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from calibration.inference.absorption import Absorption
from calibration.inference.family import Shown
from calibration.verdict import Direction

Status = Literal["estimated", "combined", "not_identifiable"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Attributes:
        name: As in the contract.
        unit: `m`, `rad`, `s` or `-`.
        nominal: Datasheet value.
        value: Estimate.
        sigma: Standard deviation, priors included.
        status: Whether the data fix it alone, only in combinations, or not at all.
    """

    name: str
    unit: str
    nominal: float
    value: float
    sigma: float
    status: Status


@dataclass(frozen=True)
class Combination:
    """An identifiable combination of parameters.

    Attributes:
        name: Its leading parameter, whose coefficient is 1.
        coefficients: (p,) of all parameters.
        value: [unit of the leading parameter].
        sigma: Its standard deviation.
    """

    name: str
    coefficients: np.ndarray
    value: float
    sigma: float


@dataclass(frozen=True)
class Model:
    """Parameters that were estimated together.

    Attributes:
        name: Row of the ladder: `registration`, `model_2`, ...
        parameters: In a fixed order.
        combinations: Identifiable combinations of more than one parameter; coefficients in the parameters' order.
        covariance: (p, p).
        joints: Joints of the chain, base to tip.
        reading_sigma: (k,) random reading error of each joint, standard deviation [rad, m]; empty where not estimated.
        rank: Number of identifiable combinations; 0 where not known.
        condition: Condition number of the scaled whitened Jacobian [-]; 0 where not known.
        hand_error: (2,) random errors of the hand's position [m] and rotation [rad]; empty where not estimated.
        random: Covariance of the first parameters by random errors alone; empty where there is nothing else.
        absorption: How much of each class of defect its parameters swallow; None where not computed.
        tests: Of effects that it may leave out, see `mismatch`; not saved.
    """

    name: str
    parameters: tuple[Parameter, ...]
    combinations: tuple[Combination, ...] = ()
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    joints: tuple[str, ...] = ()
    reading_sigma: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rank: int = 0
    condition: float = 0.0
    hand_error: np.ndarray = field(default_factory=lambda: np.zeros(0))
    random: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    absorption: Absorption | None = None
    tests: tuple[Shown, ...] = ()

    @property
    def random_covariance(self) -> np.ndarray:
        """(p, p) by random errors alone: what a model leaves out moves parameters and predictions together."""
        found, p = self.covariance.copy(), len(self.random)
        found[:p, :p] = self.random
        return found

    def value(self, name: str, default: float) -> float:
        """Estimate of a parameter, `default` where the model has none of that name."""
        return next((p.value for p in self.parameters if p.name == name), default)


def widened(model: Model, directions: Iterable[Direction]) -> Model:
    """The model with errors that the data do not show: S + sum_d c_d c_d', c_d (p,) one standard deviation of each."""
    index = {p.name: k for k, p in enumerate(model.parameters)}
    S = model.covariance.copy()
    known = [[(index[name], size) for name, size in direction if name in index] for direction in directions]
    if not any(known) or S.shape != (len(index), len(index)):
        return model
    C = np.zeros((len(index), len(known)))
    for k, direction in enumerate(known):
        for i, size in direction:
            C[i, k] += size
    sigma = np.hypot([p.sigma for p in model.parameters], np.linalg.norm(C, axis=1))
    return replace(
        model,
        parameters=tuple(replace(p, sigma=float(s)) for p, s in zip(model.parameters, sigma, strict=True)),
        combinations=tuple(
            replace(c, sigma=float(np.hypot(c.sigma, np.linalg.norm(c.coefficients @ C)))) for c in model.combinations
        ),
        covariance=S + C @ C.T,
        random=model.random if len(model.random) else S,
    )


def scaled(model: Model, factor: float) -> Model:
    """The model with all standard deviations times a factor [-]."""
    return replace(
        model,
        parameters=tuple(replace(p, sigma=factor * p.sigma) for p in model.parameters),
        combinations=tuple(replace(c, sigma=factor * c.sigma) for c in model.combinations),
        covariance=factor**2 * model.covariance,
        reading_sigma=factor * model.reading_sigma,
        hand_error=factor * model.hand_error,
        random=factor**2 * model.random,
    )


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

    def constant(self, f: np.ndarray, strength: float) -> float:
        """Minus twice the logarithm of the priors' own constant, and of the penalty that keeps f near 1."""
        sizes = np.bincount(self.group[self.group >= 0], minlength=len(f))
        return float(((sizes + strength) * np.log(f) + strength / f).sum())


@dataclass(frozen=True)
class ParameterSet:
    """Parameters of a model.

    Attributes:
        names: As in the contract, length p.
        units: `m` or `rad`, length p.
        nominal: (p,) datasheet values.
        tolerance: (p,) standard deviations of the prior; inf where there is none.
        group: Label of the parameters whose tolerances share a factor that the data decide, length p; "": fixed
            tolerance. Empty where all are fixed.
        measured: Names of those whose nominal values were measured on this robot: they count as identified.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nominal: np.ndarray
    tolerance: np.ndarray
    group: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.names)

    @property
    def prior(self) -> Prior:
        """What is believed of them beforehand."""
        return Prior(self.nominal, self.tolerance, self.groups)

    @property
    def groups(self) -> np.ndarray:
        """(p,) number of each one's group in the order of first appearance, -1 where its tolerance is fixed."""
        labels = [label for label in dict.fromkeys(self.group) if label]
        return np.array([labels.index(label) if label else -1 for label in self.group or ("",) * len(self)])

    def indices(self, names: Iterable[str]) -> list[int]:
        """Positions of those of these parameters that are in the set."""
        return [self.names.index(name) for name in names if name in self.names]

    def without(self, names: Iterable[str]) -> "ParameterSet":
        """All but those of these names."""
        dropped = set(self.indices(names))
        kept = [i for i in range(len(self)) if i not in dropped]
        labels, units, group = (
            tuple(x[i] for i in kept) for x in (self.names, self.units, self.group or ("",) * len(self))
        )
        return ParameterSet(labels, units, self.nominal[kept], self.tolerance[kept], group, self.measured)

    def joined(self, other: "ParameterSet") -> "ParameterSet":
        """These parameters, then the other ones."""
        groups = [s.group or ("",) * len(s) for s in (self, other)]
        nominal, tolerance = (np.append(getattr(self, x), getattr(other, x)) for x in ("nominal", "tolerance"))
        names, units, measured = (getattr(self, x) + getattr(other, x) for x in ("names", "units", "measured"))
        return ParameterSet(names, units, nominal, tolerance, sum(groups, ()), measured)

    @property
    def scale(self) -> np.ndarray:
        """(p,) finite scale of each parameter: its tolerance, else 1 mm or 1 mrad [m, rad]."""
        return self.prior.scale
