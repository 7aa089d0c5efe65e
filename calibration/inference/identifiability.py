"""What the data identify: rank, and the combinations of parameters that are identified.

The whitened Jacobian, its columns divided by their scale, has rank m where its singular values fall off a cliff.
Columns are scanned in one fixed order (zeros of readings, hand, base, then joints base to tip), for those far from the
span of the chosen ones first, then nearer ones: m base parameters; the others fold into those,

    J = J_b [I  B],     beta = theta_b + B theta_d            B by least squares, in the same scaling

so the set depends on the model and the postures, never on the platform or on the order of the data.
Reference: Gautier, Khalil, IEEE TRA 1990 (numerical base parameters).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from calibration.inference.parameters import Combination, ParameterSet, Status

_CLIFF = 1e-6  # singular values below this share of the largest are zero [-]
_GAP = 30.0  # a clear cliff: first kept over last dropped, at least [-]
_PASSES = (0.2, 0.05, 0.01, 1e-3, 1e-4, 1e-5)  # share of a column's length outside the chosen ones' span [-]
_NEGLIGIBLE = 1e-3  # coefficients smaller than this, scaled, are not worth a name [-]
_ALONE = 1e-2  # share of a parameter in the null space below which the data fix it by itself [-]


@dataclass(frozen=True)
class Identifiability:
    """What a set of postures identifies of a set of parameters.

    Attributes:
        rank: Number of identifiable combinations.
        singular_values: (p,) of the scaled whitened Jacobian, largest first [-].
        gap: Last kept over first dropped singular value; inf where none is dropped.
        condition: Largest over smallest kept singular value [-].
        base: Indices of the base parameters, in scan order.
        coefficients: (rank, p) of the combinations, one row a base parameter.
        status: One a parameter.
    """

    rank: int
    singular_values: np.ndarray
    gap: float
    condition: float
    base: tuple[int, ...]
    coefficients: np.ndarray
    status: tuple[Status, ...]

    @property
    def clear(self) -> bool:
        """Whether the rank does not hang on a threshold."""
        return self.gap > _GAP

    def combinations(
        self, parameters: ParameterSet, theta: np.ndarray, covariance: np.ndarray
    ) -> tuple[Combination, ...]:
        """Values at theta (p,) of the combinations of more than one parameter, negligible terms left out.

        What is left out of a combination counts in its sigma, since `covariance` (p, p) holds the priors too.
        """
        found = []
        for lead, row in zip(self.base, self.coefficients, strict=True):
            c = np.where(np.abs(row * parameters.scale) < _NEGLIGIBLE * parameters.scale[lead], 0.0, row)
            if np.count_nonzero(c) > 1:
                sigma = float(np.sqrt(c @ covariance @ c))
                found.append(Combination(parameters.names[lead], c, float(c @ theta), sigma))
        return tuple(found)


def identifiability(J: np.ndarray, parameters: ParameterSet) -> Identifiability:
    """Rank and combinations of the whitened Jacobian J (m, p), and of what was measured of the parameters before."""
    scale = parameters.scale
    measured = np.eye(len(scale))[parameters.indices(parameters.measured)]
    A = np.concatenate([J * scale, measured])
    if len(A) > A.shape[1]:
        A = np.asarray(np.linalg.qr(A, mode="r"))  # the same lengths and angles between columns, fewer rows
    _, values, Vt = np.linalg.svd(A, full_matrices=len(A) < A.shape[1])
    values = np.concatenate([values, np.zeros(max(0, len(scale) - len(values)))])
    rank = int((values > _CLIFF * values[0]).sum())
    tiny = np.finfo(float).eps * values[0]
    gap = float(values[rank - 1] / max(values[rank], tiny)) if rank < len(values) else float("inf")
    base = _base_columns(A, scan_order(parameters.names), rank)
    Q, R = np.linalg.qr(A[:, base])
    B = solve_triangular(R, Q.T @ A)
    B[:, base] = np.eye(len(base))
    return Identifiability(
        rank,
        values,
        gap,
        float(values[0] / values[rank - 1]),
        tuple(base),
        B * scale[base][:, None] / scale,
        _statuses(Vt, rank),
    )


def scan_order(names: tuple[str, ...]) -> list[int]:
    """Zeros of readings first, then hand, base, then what is left in file order."""
    first = ("encoder.", "frame.tool.", "frame.base.")
    return sorted(
        range(len(names)), key=lambda i: (next((k for k, p in enumerate(first) if names[i].startswith(p)), 9), i)
    )


def _base_columns(A: np.ndarray, order: list[int], rank: int) -> list[int]:
    """`rank` columns, each outside the span of those chosen before it (Gram-Schmidt, twice)."""
    chosen: list[int] = []
    Q = np.zeros((len(A), 0))
    length = np.linalg.norm(A, axis=0)
    for i, share in ((i, share) for share in _PASSES for i in order):
        if len(chosen) == rank:
            break
        if i in chosen or length[i] == 0.0:
            continue
        rest = A[:, i] - Q @ (Q.T @ A[:, i])
        rest = rest - Q @ (Q.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > share * length[i]:
            chosen.append(i)
            Q = np.hstack([Q, rest[:, None] / left])
    return chosen


def _statuses(Vt: np.ndarray, rank: int) -> tuple[Status, ...]:
    """By each parameter's share in the null space: none, estimated; all, not identifiable; else combined.

    Vt (p, p): right singular vectors, one a row.
    """
    known = np.sqrt((Vt[:rank] ** 2).sum(axis=0))
    lost = np.sqrt((Vt[rank:] ** 2).sum(axis=0))
    return tuple(
        "estimated" if v < _ALONE else "not_identifiable" if k < _ALONE else "combined"
        for k, v in zip(known, lost, strict=True)
    )
