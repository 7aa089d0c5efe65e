"""Motion capture: marker positions in the lab with white noise per axis.

y_m = T_lab_link (T_link_body p_m) + n,   n ~ N(0, sigma^2 1)
"""

import numpy as np

from twin.defects.sensing import Cluster


def marker_positions(T_lab_link: np.ndarray, cluster: Cluster) -> np.ndarray:
    """True positions (n, n_markers, 3) [m, lab] of a cluster's markers along poses of its link (n, 4, 4)."""
    T = T_lab_link @ cluster.T_link_body
    return np.einsum("nij,kj->nki", T[:, :3, :3], cluster.nominal + cluster.shift) + T[:, None, :3, 3]


def measured(positions: np.ndarray, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """Positions with white noise of sigma [m] per axis."""
    return positions + sigma * rng.normal(size=positions.shape)
