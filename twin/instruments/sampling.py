"""From dense states at the simulation's steps to samples at an instrument's times.

Events of a recording, lost messages or exchanged labels, are a Poisson process.
"""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation


def interpolate(t: np.ndarray, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Linear interpolation (n, ...) of dense values (m, ...) at times t; within a dt^2 / 8, 1 um at 10 m/s^2, 1 ms."""
    i, w = _between(t, grid)
    w = w.reshape(-1, *(1,) * (values.ndim - 1))
    return (1.0 - w) * values[i] + w * values[i + 1]


def _between(t: np.ndarray, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index (n,) of the grid's time before each t, and the share of the way to the next (n,)."""
    i = np.clip(np.searchsorted(grid, t, side="right") - 1, 0, len(grid) - 2)
    return i, (t - grid[i]) / (grid[i + 1] - grid[i])


def interpolate_poses(t: np.ndarray, grid: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Poses (n, 4, 4) at times t from dense poses (m, 4, 4): linear in position, great arcs in rotation."""
    i, w = _between(np.clip(t, grid[0], grid[-1]), grid)
    before, after = (Rotation.from_matrix(T[k, :3, :3]) for k in (i, i + 1))
    rotation = before * Rotation.from_rotvec(w[:, None] * (before.inv() * after).as_rotvec())
    return RigidTransform.from_components(interpolate(t, grid, T[:, :3, 3]), rotation).as_matrix()


def averaged(t: np.ndarray, grid: np.ndarray, values: np.ndarray, width: float) -> np.ndarray:
    """Mean of dense values over [t - width/2, t + width/2], as an integrating instrument samples (n, ...)."""
    step = grid[1] - grid[0]
    integral = np.zeros_like(values)
    integral[1:] = np.cumsum(0.5 * step * (values[1:] + values[:-1]), axis=0)
    low, high = np.clip(t - width / 2, grid[0], grid[-1]), np.clip(t + width / 2, grid[0], grid[-1])
    span = (high - low).reshape(-1, *(1,) * (values.ndim - 1))
    return (interpolate(high, grid, integral) - interpolate(low, grid, integral)) / span


def windows(t: np.ndarray, per_minute: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """Start and stop (k, 2) [s] of events within t (n,) [s]; none while an earlier one lasts."""
    n = int(rng.poisson(per_minute * (t[-1] - t[0]) / 60.0))
    starts = np.sort(rng.uniform(t[0], max(t[0], t[-1] - duration), n))
    kept = [start for k, start in enumerate(starts) if k == 0 or start - starts[k - 1] > 2.0 * duration]
    return np.array([(start, start + duration) for start in kept]).reshape(-1, 2)


def within(t: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Whether each t (n,) lies in one of the spans (k, 2)."""
    return np.asarray(((t[:, None] >= spans[:, 0]) & (t[:, None] < spans[:, 1])).any(axis=1))
