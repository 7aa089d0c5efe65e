"""Bases side by side, as the kernel integrates them: LANES numbers to a row, rows one after the other."""

from typing import NamedTuple

import numpy as np

PLATE = 8  # first of the plate's columns of `drive`
PLANE, HEAVE = (0, 1, 5), (2, 3, 4)  # of x, y, z, rx, ry, yaw
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # elements of a symmetric matrix (3, 3), row by row
STEPS = 3  # of the integration to a sample
COLUMNS = 13  # of `drive`: w (3), -Fz, My, -Mx, rx, ry, plate's force (3), accelerations of rx, ry
TILTS = 11  # first of the last two
LANES = 16  # bases side by side
VECTOR = 8  # lanes that one instruction takes, two of an older processor
WHEEL, E, U = 22, 10, 12  # rows of a wheel: x, y, kx, ky, c, mu, n, G (3), e (2), u (2), and the next ones
MASS, RADIUS, HELD, USUAL, VERTICAL, YIELDS = 14, 15, 16, 17, 19, 20  # m, r, see `deflect_at_rest` (3), kz, `yielding`
FAR = 25.0  # [N.m] from the usual load of wheels, at which half of what they hold there is left
VELOCITY, ACCELERATION = 3, 9  # three rows each of a state
X, V, DX, STICKS, P = 0, VELOCITY, 6, 12, 13  # x, v, correction to come, wheels that stuck plus one, P
D, LOAD, F, SLID, BITS = 19, 22, 25, 28, 29  # of the step: d, -Fz, My, -Mx, force, wheels that slide, which stick
BODY = 30  # dampers of the base [N.s/m, N.m.s/rad], g [1/s] (0: no plate) and l [-]
LEANS, PULL, W = 34, 36, 37  # sum N e (2), sum of N < 0, what wheels that accelerate add to the force (3)
STUCK, NOW = 40, 43  # force of a wheel that sticks (2), its load; v at the time of the load
UNLIKELY, MISSED, NOISE = 46, 47, 50  # see `preloaded`, `informed`; 1 / (2 sigma), 0: not judged
LESS, ROWS = 53, 54  # what wheels bear less as they deflect on a base that leans [N]


class Bases(NamedTuple):
    """k bases of m wheels, LANES to a group; the last ones of the last group repeat the last base.

    Attributes:
        state: (groups, ROWS, LANES), see above.
        wheels: (groups, m, WHEEL, LANES).
        lanes: (groups,) that count, a multiple of VECTOR.
        learnt: (n, n + 1) of the first n of them, see `informed`; (0, 1) where a plate says nothing of parameters.
    """

    state: np.ndarray
    wheels: np.ndarray
    lanes: np.ndarray
    learnt: np.ndarray

    def deflection(self, i: int) -> np.ndarray:
        """Of the wheels (m, 2) of a base [m]."""
        return self.wheels[i // LANES, :, E:U, i % LANES]


def judge(state: np.ndarray, noise: np.ndarray) -> None:
    """Let states (groups, ROWS, LANES) be judged by a plate's force, sigma (3,) [N, N, N.m]."""
    state[:, NOISE:LESS] = 0.5 / noise[:, None]


def at_rest(
    wheels: np.ndarray, bodies: np.ndarray, preload: np.ndarray | None = None, noise: np.ndarray | None = None
) -> Bases:
    """Bases at rest.

    Args:
        wheels: (k, m, 16) x, y, kx, ky, c, mu, n, G, mass, r, held, usual, kz.
        bodies: (k, 4), see BODY.
        preload: (k, m, 2) deflections [m]; None: none.
        noise: sigma (3,) of the plate's force, by which bases are judged; None: they are not.
    """
    k, m = wheels.shape[:2]
    groups = -(-k // LANES)
    own = np.minimum(np.arange(groups * LANES), k - 1)
    e = np.zeros((k, m, 2)) if preload is None else preload
    each = np.concatenate([wheels[..., :E], e, np.zeros_like(e), wheels[..., E:], np.zeros_like(e)], axis=2)[own]
    rows = each.reshape(groups, LANES, m, WHEEL).transpose(0, 2, 3, 1)
    lanes = np.minimum(k - LANES * np.arange(groups), LANES)
    state = np.zeros((groups, ROWS, LANES))
    state[:, BODY:LEANS] = bodies[own].reshape(groups, LANES, 4).transpose(0, 2, 1)
    if noise is not None:
        judge(state, noise)
    return Bases(state, np.ascontiguousarray(rows), -(-lanes // VECTOR) * VECTOR, np.zeros((0, 1)))


def inertia_rows(M: np.ndarray) -> np.ndarray:
    """(n, 15) of M (n, 6, 6), as `integration.advance` takes it: of a base that its own accelerations load."""
    rows = np.empty((len(M), 15))
    rows[:, :6] = np.stack([M[:, PLANE[i], PLANE[j]] for i, j in UPPER], axis=1)
    rows[:, 6:] = (M[:, (2, 4, 3)][:, :, PLANE] * np.array([1.0, -1.0, 1.0])[:, None]).reshape(len(M), 9)
    return rows
