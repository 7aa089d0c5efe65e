"""The order in which postures are recorded: each followed by the nearest one that can be reached without contact.

Moves are straight in the joints. Where no posture that is left can be reached so, the nearest is taken and the move is
told: somebody has to look, or to put a posture in between.
"""

from dataclasses import dataclass

import numpy as np

from calibration.shapes import Shapes

_STEP = 0.15  # between the postures a move is checked at, largest joint [rad, m]
_TRIED = 8  # nearest ones that are tried


@dataclass(frozen=True)
class Tour:
    """An order of postures.

    Attributes:
        order: (n,) indices.
        contact: Places in the order whose posture is not reached clear of the robot from the one before.
    """

    order: np.ndarray
    contact: tuple[int, ...]


def tour(q: np.ndarray, shapes: Shapes, start: int = 0) -> Tour:
    """Order postures q (n, n_measured)."""
    order, left, contact = [start], set(range(len(q))) - {start}, []
    while left:
        here = q[order[-1]]
        near = sorted(left, key=lambda i: (float(np.abs(q[i] - here).max()), i))
        free = next((i for i in near[:_TRIED] if not shapes.known or clear(here, q[i], shapes)), None)
        if free is None:
            contact.append(len(order))
        order.append(near[0] if free is None else free)
        left.remove(order[-1])
    for i in [order[k] for k in contact]:
        order, contact = _elsewhere(q, shapes, order, contact, i)
    return Tour(np.array(order), tuple(contact))


def _elsewhere(
    q: np.ndarray, shapes: Shapes, order: list[int], contact: list[int], i: int
) -> tuple[list[int], list[int]]:
    """Posture i put where it can be reached and left, if there is such a place and it is not missed where it was."""
    place = order.index(i)
    rest = order[:place] + order[place + 1 :]
    if place < len(rest) and not clear(q[rest[place - 1]], q[rest[place]], shapes):
        return order, contact
    for k in (k for k in range(1, len(rest)) if k != place and k not in contact):
        if clear(q[rest[k - 1]], q[i], shapes) and clear(q[i], q[rest[k]], shapes):
            told = [c - (c > place) for c in contact if c != place]
            return [*rest[:k], i, *rest[k:]], [c + (c >= k) for c in told]
    return order, contact


def clear(a: np.ndarray, b: np.ndarray, shapes: Shapes) -> bool:
    """Whether the straight move between two postures (n_measured,) touches nothing."""
    n = int(np.ceil(np.abs(b - a).max() / _STEP)) + 1
    return not shapes.collides(a + np.linspace(0.0, 1.0, n)[:, None] * (b - a)).any()
