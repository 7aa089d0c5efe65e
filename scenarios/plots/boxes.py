"""Boxplot of absolute errors, a box a row, along a logarithmic axis.

Box: quartiles and median. Whiskers: 5 % and 95 %. Dot: root mean square.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from scenarios.plots.style import TRUTH

_SHARES = (5.0, 25.0, 50.0, 75.0, 95.0)
_HEIGHT = 0.56  # of a box, as a share of the distance between rows [-]


@dataclass(frozen=True)
class Sample:
    """Errors of one row.

    Attributes:
        label: Its name.
        values: (n,) absolute errors, without NaN.
        colour: Of its box.
        hollow: Draw the outline only.
    """

    label: str
    values: np.ndarray
    colour: str
    hollow: bool = False


def error_boxes(samples: Sequence[Sample], quantity: str, floor: float | None, ax: Axes) -> Axes:
    """Draw samples from top to bottom.

    Args:
        samples: The rows.
        quantity: What is along x, with its unit in brackets.
        floor: Root mean square of the instruments alone, in the unit of the samples; None where not known.
        ax: Where to draw.
    """
    _boxes(samples, ax)
    if floor is not None:
        ax.axvline(floor, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.0, zorder=0.9)
    ax.set_yticks(range(len(samples)), [s.label for s in samples])
    ax.set_ylim(len(samples) - 0.45, -0.55)
    ax.set_xscale("log")
    ax.set_xlim(*_limits(samples, floor))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(quantity)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    return ax


def _limits(samples: Sequence[Sample], floor: float | None) -> tuple[float, float]:
    """From what is worth showing, a thousandth of the largest error at least, to a little above the largest."""
    high = max(float(np.percentile(s.values, _SHARES[-1])) for s in samples)
    low = min(float(np.percentile(s.values, _SHARES[1])) for s in samples)
    low = min(low, floor) if floor else low
    return 0.8 * max(low, 1e-3 * high), 1.3 * high


def _boxes(samples: Sequence[Sample], ax: Axes) -> None:
    low, first, median, third, high = np.array([np.percentile(s.values, _SHARES) for s in samples]).T
    y, half, colours = np.arange(len(samples)), _HEIGHT / 2.0, [s.colour for s in samples]
    ax.hlines(y, low, high, colors=colours, linewidth=1.0)
    ends = np.tile(y, 2)
    ax.vlines(np.append(low, high), ends - half / 2, ends + half / 2, colors=2 * colours, linewidth=1.0)
    ax.barh(
        y,
        third - first,
        _HEIGHT,
        left=first,
        facecolor=["white" if s.hollow else s.colour for s in samples],
        edgecolor=colours,
        linewidth=1.1,
        zorder=2,
    )
    inside = [s.colour if s.hollow else "white" for s in samples]
    ax.vlines(median, y - half, y + half, colors=inside, linewidth=1.6, zorder=3)
    rms = [float(np.sqrt((s.values**2).mean())) for s in samples]
    ax.plot(rms, y, "o", color="black", markersize=3.2, markeredgecolor="white", markeredgewidth=0.6, zorder=4)
