"""Force plate: the wrench averaged over each sample, with white noise.

Action of the robot on the plate, lab axes, about the plate's surface centre [N, N.m].
"""

import numpy as np

from twin.instruments.sampling import averaged


def measured(
    t: np.ndarray, grid: np.ndarray, wrench: np.ndarray, rate: float, sigma: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Samples (n, 6) at true times t of the dense wrench (m, 6); sigma (6,) per sample [N, N.m]."""
    samples = averaged(t, grid, wrench, 1.0 / rate)
    return samples + sigma * rng.normal(size=samples.shape)
