"""From a robot's room to a design: a coarse choice, then the neighbourhoods of what was chosen.

Candidates are drawn over the whole room, the best are chosen (`design`), and twice more from ever nearer neighbours of
those: the best postures lie at limits that a coarse pool misses.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibration.design import Criterion, choose
from calibration.design_pool import Room
from calibration.information import Prospect

Sample = Callable[[int, np.random.Generator], np.ndarray]
"""So many postures (n, n_measured), drawn."""

_POOL = 500
_WIDTHS = (0.12, 0.05)  # of a joint's range, of the neighbours of the second and third choice [-]
_NEIGHBOURS = 400
_AT = 120  # postures the hand is predicted at


@dataclass(frozen=True)
class Design:
    """Chosen postures.

    Attributes:
        prospect: Candidates of the last choice.
        chosen: (n,) indices of those to record.
    """

    prospect: Prospect
    chosen: np.ndarray

    @property
    def q(self) -> np.ndarray:
        """(n, n_measured) the postures to record [rad, m]."""
        return np.asarray(self.prospect.q[self.chosen])

    @property
    def C(self) -> np.ndarray:
        """Covariance of the identifiable directions once they are recorded."""
        return self.prospect.after(self.chosen)


def search(
    room: Room,
    prospect_at: Callable[[np.ndarray, np.ndarray], Prospect],
    n: int,
    criterion: Criterion,
    rng: np.random.Generator,
    work: Sample | None = None,
) -> Design:
    """Choose n postures in a room; `prospect_at(q, at)` says what candidates tell of the hand at other postures.

    Those are drawn by `work`, anywhere in the room where it is not given; candidates from both.

    Raises:
        NotEnoughData: The room has hardly any postures.
    """
    size = max(_POOL, 5 * n)
    if work is None:
        drawn = room.pool(size + _AT, rng)
        at, pool = drawn[:_AT], drawn[_AT:]
    else:
        at, pool = work(_AT, rng), np.concatenate([room.pool(size // 2, rng), room.admits(work(size // 2, rng))])
    prospect = prospect_at(pool, at)
    chosen = choose(prospect, n, criterion)
    for width in _WIDTHS:
        near = room.near(pool[chosen], max(1, _NEIGHBOURS // n), width, rng)
        pool = np.concatenate([pool[chosen], near])
        prospect = prospect_at(pool, at)
        chosen = choose(prospect, n, criterion, np.arange(n))
    return Design(prospect, chosen)
