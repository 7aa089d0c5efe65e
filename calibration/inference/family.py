"""A family of tests of effects that a model may leave out, together at one level (Holm, Scand. J. Statistics 1979)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEVEL = 0.01


@dataclass(frozen=True)
class Shown:
    """An effect and what residuals show of it.

    Attributes:
        name: Of the effect.
        p: Probability of as much by chance; NaN where it was not excited.
        seen: Whether it is seen, the family of tests together at 1 %.
        size: Root mean square displacement of the hand by it [m].
    """

    name: str
    p: float
    seen: bool = False
    size: float = 0.0


def holm(tests: Sequence[Shown]) -> tuple[Shown, ...]:
    """The tests with those marked that are seen, all of them together at `LEVEL`."""
    order = sorted((k for k, test in enumerate(tests) if np.isfinite(test.p)), key=lambda k: tests[k].p)
    seen: set[int] = set()
    for left, k in zip(range(len(order), 0, -1), order, strict=True):
        if tests[k].p > LEVEL / left:
            break
        seen.add(k)
    return tuple(Shown(t.name, t.p, k in seen, t.size) for k, t in enumerate(tests))
