"""What a solver needs to know of data: residuals, their derivatives, and where random errors enter.

    r(theta) = r_0 + J (theta - theta_0) + B e,     e_m ~ N(0, v_g(m) / w)

n rows (postures, samples, rests) of d components each. A source of random errors b_m moves a row by its column of B;
all sources of one group g have one variance v_g. Groups have names: `reading.arm_4_joint`, `hand.position`, `markers`.
A residual is one file: its parameters, `linearise`, `noise`. A `Problem` stacks any number of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

_PADDING = "padding"


@dataclass(frozen=True)
class Linearised:
    """Residuals of n rows with d components each, at one value of the parameters.

    Attributes:
        theta: (p,).
        r: (n, d) residuals [m, rad].
        J: (n, d, p) their derivatives.
        B: (n, d, m) sources of random errors, one a column.
        weight: (n,) of each row [-]; 1 where not given.
    """

    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray
    B: np.ndarray
    weight: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.weight is None:
            object.__setattr__(self, "weight", np.ones(len(self.r)))

    def rows(self, chosen: np.ndarray) -> "Linearised":
        """Some of the rows."""
        return Linearised(self.theta, self.r[chosen], self.J[chosen], self.B[chosen], self.weight[chosen])

    def moved(self, change: np.ndarray) -> "Linearised":
        """The same linear problem at theta + change."""
        return replace(self, theta=self.theta + change, r=self.r + self.J @ change)


@dataclass(frozen=True)
class Noise:
    """Groups of random errors.

    Attributes:
        names: (g,) of the groups.
        group: (m,) which group each source belongs to.
        start: (g,) standard deviation to begin with.
        floor: (g,) smallest standard deviation.
        free: (g,) whether the data decide it.
        common: (g,) groups that may explain the data alone; see `noise_selection`.
    """

    names: tuple[str, ...]
    group: np.ndarray
    start: np.ndarray
    floor: np.ndarray
    free: np.ndarray
    common: np.ndarray

    @classmethod
    def stated(cls, name: str, n_sources: int) -> "Noise":
        """One group of known size, its standard deviations in B."""
        one, no = np.ones(1), np.zeros(1, dtype=bool)
        return cls((name,), np.zeros(n_sources, dtype=int), one, one, no, no)

    def roots(self, B: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """W (n, d, d) with W' W = C^-1 for standard deviations `sizes` (g,), weights not counted."""
        C = (B * sizes[self.group] ** 2) @ np.swapaxes(B, 1, 2)
        return np.linalg.inv(np.linalg.cholesky(C))

    def whitener(self, at: Linearised, sizes: np.ndarray) -> np.ndarray:
        """W (n, d, d) with W' W = w C^-1."""
        return np.sqrt(at.weight)[:, None, None] * self.roots(at.B, sizes)


class Residual(Protocol):
    """Data and what a model predicts of them."""

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters it depends on, the order of theta."""
        ...

    @property
    def noise(self) -> Noise:
        """Groups of its random errors, the order of B's columns."""
        ...

    def linearise(self, theta: np.ndarray) -> Linearised:
        """Residuals and derivatives at theta (p,)."""
        ...


def stacked_noise(noises: Sequence[Noise], d: int) -> Noise:
    """Groups of several residuals, equal names being one group; the last one pads rows of fewer than d components."""
    names = tuple(dict.fromkeys(name for noise in noises for name in noise.names))
    first = {name: (noise, noise.names.index(name)) for noise in reversed(noises) for name in noise.names}
    start, floor, free, common = (
        np.array([getattr(first[name][0], what)[first[name][1]] for name in names] + [end])
        for what, end in (("start", 1.0), ("floor", 1.0), ("free", False), ("common", False))
    )
    group = [names.index(noise.names[g]) for noise in noises for g in noise.group]
    return Noise((*names, _PADDING), np.array([*group, *[len(names)] * d]), start, floor, free, common)


def stacked(parts: Sequence[Linearised], columns: Sequence[np.ndarray], theta: np.ndarray) -> Linearised:
    """One problem of several, each with the columns of theta it depends on; missing components have unit noise."""
    d, n = max(part.r.shape[1] for part in parts), sum(len(part.r) for part in parts)
    sources = sum(part.B.shape[2] for part in parts)
    r, J, B = np.zeros((n, d)), np.zeros((n, d, len(theta))), np.zeros((n, d, sources + d))
    row, source = 0, 0
    for part, mine in zip(parts, columns, strict=True):
        rows, of = slice(row, row + len(part.r)), part.r.shape[1]
        r[rows, :of] = part.r
        J[rows, :of, mine] = part.J
        B[rows, :of, source : source + part.B.shape[2]] = part.B
        for k in range(of, d):
            B[rows, k, sources + k] = 1.0
        row, source = row + len(part.r), source + part.B.shape[2]
    return Linearised(theta, r, J, B, np.concatenate([part.weight for part in parts]))
