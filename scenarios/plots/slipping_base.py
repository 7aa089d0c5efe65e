"""A base that sticks and slips: its motion with a band, the loop of moment and yaw, the friction its wheels use."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from scenarios.plots.style import ESTIMATE
from scenarios.plots.trace import Line, measured_beside, thinned

_TWO_SIDED = 1.96


@dataclass(frozen=True)
class Banded:
    """One axis over time; all (n,).

    Attributes:
        t: [s].
        measured: NaN where it is not seen.
        predicted: Beside it.
        sigma: Of the prediction.
    """

    t: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    sigma: np.ndarray


def banded(axis: Banded, quantity: str, ax: Axes) -> Axes:
    """Draw what was measured, what was predicted and its 95 % band; `quantity` has its unit in brackets."""
    low, high = (axis.predicted + side * _TWO_SIDED * axis.sigma for side in (-1.0, 1.0))
    (t_low, low), (t_high, high) = (thinned(axis.t, edge) for edge in (low, high))
    ax.fill(
        np.append(t_low, t_high[::-1]), np.append(low, high[::-1]), color=ESTIMATE, alpha=0.2, linewidth=0.0,
        label="95 % band",
    )  # fmt: skip
    predicted = Line("predicted", axis.t, axis.predicted, ESTIMATE, 1.0)
    return measured_beside(Line("measured", axis.t, axis.measured, "black"), [predicted], quantity, ax)


def loop(moment: np.ndarray, axis: Banded, ax: Axes) -> Axes:
    """Draw yaw over the moment (n,) about the vertical, measured and predicted; the caller names the axes."""
    rows = slice(None, None, max(1, len(moment) // 1500))
    ax.plot(
        moment[rows], axis.measured[rows], "o", color="black", markersize=1.3, markeredgewidth=0.0, label="measured"
    )
    ax.plot(moment[rows], axis.predicted[rows], color=ESTIMATE, linewidth=0.6, label="predicted")
    return ax


def friction_use(t: np.ndarray, use: np.ndarray, wheels: tuple[str, ...], ax: Axes) -> Axes:
    """Draw for each wheel, a row each, when it needs how much of its friction (n, m) [-]: white none, dark all."""
    columns = np.array_split(np.arange(len(t)), min(len(t), 600))
    most = np.array([use[c].max(axis=0) for c in columns])
    ax.imshow(
        most.T, aspect="auto", cmap="Blues", vmin=0.0, vmax=1.0, extent=(t[0], t[-1], len(wheels) - 0.5, -0.5),
        interpolation="nearest",
    )  # fmt: skip
    ax.set_yticks(range(len(wheels)), wheels)
    ax.grid(False)
    return ax
