"""Things that happen to a recording now and then: a Poisson process of short events."""

import numpy as np


def windows(t: np.ndarray, per_minute: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """Start and stop (k, 2) [s] of events within t (n,) [s]; none while an earlier one lasts."""
    n = int(rng.poisson(per_minute * (t[-1] - t[0]) / 60.0))
    starts = np.sort(rng.uniform(t[0], t[-1] - duration, n))
    kept = [start for k, start in enumerate(starts) if k == 0 or start - starts[k - 1] > 2.0 * duration]
    return np.array([(start, start + duration) for start in kept]).reshape(-1, 2)


def within(t: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Whether each t (n,) lies in one of the spans (k, 2)."""
    return np.asarray(((t[:, None] >= spans[:, 0]) & (t[:, None] < spans[:, 1])).any(axis=1))
