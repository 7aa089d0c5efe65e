"""Histogram of standardised values against the standard normal distribution."""

import numpy as np
from matplotlib.axes import Axes

from scenarios.plots.style import ESTIMATE, TRUTH

_LIMIT, _STEP = 4.0, 0.5


def z_histogram(
    z: np.ndarray, ax: Axes, quantity: str = "(estimate − truth) / sigma [-]", of: str = "estimates"
) -> Axes:
    """Draw z (n,) [-]; what lies beyond 4 is counted in the outermost bars."""
    edges = np.arange(-_LIMIT, _LIMIT + _STEP / 2, _STEP).tolist()
    ax.hist(np.clip(z, -_LIMIT, _LIMIT), edges, color=ESTIMATE, edgecolor="white", linewidth=0.8, label=of)
    x = np.linspace(-_LIMIT, _LIMIT, 121)
    expected = len(z) * _STEP * np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    ax.plot(x, expected, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.2, label="standard normal")
    ax.set_xlabel(quantity)
    ax.set_ylabel(f"{of} per bin [-]")
    ax.set_xlim(-_LIMIT, _LIMIT)
    ax.legend(loc="upper left", fontsize=7)
    return ax
