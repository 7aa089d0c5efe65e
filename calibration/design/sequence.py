"""From which side each joint is to come to rest, so that flanks do not pass for geometry.

A joint with friction and a total backlash 2 h stops on the flank it came from, its reading off by s h, s = -1 or 1 the
sign of its last motion (a joint whose load holds it on one flank takes that one from either side). Least squares turns
the flanks of all postures into the error

    x = C sum_i B_i' J_i diag(h) s_i,     x' C^-1 x = | sum_ij s_ij g_ij |^2,     g_ij = L' B_i' J_ij h_j,   C = L L'

Signs are turned one by one, the best first, until none makes the sum shorter: half of the approaches from either side,
and those halves separated by no parameter.

The order in which postures are recorded: each followed by the nearest one that can be reached without contact.

Moves are straight in the joints. Where no posture that is left can be reached so, the nearest is taken and the move is
so: somebody has to look, or to put a posture in between.
"""

from dataclasses import dataclass

import numpy as np

from calibration.design.collisions import Shapes
from calibration.design.information import Prospect

_WORTH = 0.1  # of a posture's noise: flanks that move the hand less are left open [-]
_STEP = 0.15  # between the postures a move is checked at, largest joint [rad, m]
_TRIED = 8  # nearest ones that are tried


@dataclass(frozen=True)
class Sides:
    """Approach directions of chosen postures.

    Attributes:
        approach: (n, k) -1, 1, or 0 where backlash does not matter, of the joints of the chain.
        bias: (e,) how far the flanks then move the predicted hand [m].
        one_sided: (e,) the same if every joint always came from below [m].
    """

    approach: np.ndarray
    bias: np.ndarray
    one_sided: np.ndarray


def sides(prospect: Prospect, chosen: np.ndarray, half_play: np.ndarray, rng: np.random.Generator) -> Sides:
    """Approach directions for the chosen candidates (n,) of joints with half a backlash h (k,) [rad, m]."""
    C = prospect.after(chosen)
    moves = prospect.J_joint[chosen] * half_play
    matters = np.sqrt((moves**2).sum(axis=1).mean(axis=0)) > _WORTH
    pulls = np.einsum("ndr,ndk->nkr", prospect.B[chosen], moves)
    g = (pulls @ np.linalg.cholesky(C))[:, matters]
    signs = np.zeros(moves.shape[::2], dtype=int)
    signs[:, matters] = _balanced(g.reshape(-1, g.shape[2]), rng).reshape(g.shape[:2])
    return Sides(signs, _moved(prospect, C, pulls, signs), _moved(prospect, C, pulls, np.abs(signs)))


def _moved(prospect: Prospect, C: np.ndarray, pulls: np.ndarray, signs: np.ndarray) -> np.ndarray:
    x = C @ np.einsum("nk,nkr->r", signs, pulls)
    return np.asarray(np.linalg.norm(prospect.P @ x, axis=1))


def _balanced(g: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Signs (m,) that make |sum s g| small, g (m, r); each is turned at its best moment until no turn helps."""
    signs = rng.permutation(np.resize([-1, 1], len(g)))
    total, own = signs @ g, (g**2).sum(axis=1)
    for _ in range(20 * len(g)):
        change = 4.0 * (own - signs * (g @ total))
        k = int(change.argmin()) if len(g) else 0
        if not len(g) or change[k] >= -1e-12 * (total @ total):
            break
        signs[k] = -signs[k]
        total = total + 2.0 * signs[k] * g[k]
    return signs


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
            shifted = [c - (c > place) for c in contact if c != place]
            return [*rest[:k], i, *rest[k:]], [c + (c >= k) for c in shifted]
    return order, contact


def clear(a: np.ndarray, b: np.ndarray, shapes: Shapes) -> bool:
    """Whether the straight move between two postures (n_measured,) touches nothing."""
    n = int(np.ceil(np.abs(b - a).max() / _STEP)) + 1
    return not shapes.collides(a + np.linspace(0.0, 1.0, n)[:, None] * (b - a)).any()
