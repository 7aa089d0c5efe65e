"""How much of each class of defect the others swallow where it is left out.

    share_ij = 1 - |N_i - A_j x|^2 / |N_i|^2,     x = (A_j'A_j + P_j)^-1 A_j' N_i           whitened, over the data

N_i are the directions of class i, A_j and P_j the directions and the prior information of the parameters of class j.
A share of 1 hides a class from every residual; what it does is then in the wrong parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Absorption:
    """Shares of squares.

    Attributes:
        classes: (c,) defects; those that are parameters first.
        absorbers: (k,) of them those that are parameters, and last all of them together.
        share: (c, k + 1) of class i swallowed by absorber j, by all others together in the last column; 0 by itself.
    """

    classes: tuple[str, ...]
    absorbers: tuple[str, ...]
    share: np.ndarray


def absorption(
    directions: Mapping[str, np.ndarray], parameters: Mapping[str, np.ndarray], precision: np.ndarray
) -> Absorption:
    """Of classes by their whitened directions (rows, m).

    Args:
        directions: Of every class, those of `parameters` among them.
        parameters: Columns in `precision` of the classes that are parameters.
        precision: (p,) information of the priors.
    """
    known = {name: (directions[name], precision[columns]) for name, columns in parameters.items()}
    classes = (*known, *(name for name in directions if name not in known))
    share = np.zeros((len(classes), len(known) + 1))
    for i, name in enumerate(classes):
        others = [one for other, one in known.items() if other != name]
        for j, other in enumerate(known):
            share[i, j] = 0.0 if other == name else _swallowed(directions[name], *known[other])
        A, P = (np.concatenate(parts, axis=-1) for parts in zip(*others, strict=True))
        share[i, -1] = _swallowed(directions[name], A, P)
    return Absorption(classes, (*known, "all others"), share)


def _swallowed(N: np.ndarray, A: np.ndarray, precision: np.ndarray) -> float:
    prior, none = np.diag(np.sqrt(precision)), np.zeros((len(precision), N.shape[1]))
    x = np.linalg.lstsq(np.vstack([A, prior]), np.vstack([N, none]), rcond=None)[0]
    whole = float((N**2).sum())
    return 1.0 - float(((N - A @ x) ** 2).sum()) / whole if whole > 0.0 else 0.0
