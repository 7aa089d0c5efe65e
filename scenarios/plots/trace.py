"""Quantities over time, errors or measured beside predicted, thinned so that every peak stays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

_COLUMNS = 450  # smallest and largest value are kept in each of so many parts of the time
_DOTS = 300  # measured samples drawn, beside the extremes


@dataclass(frozen=True)
class Line:
    """Error of one row.

    Attributes:
        label: Its name.
        t: (n,) [s].
        values: (n,), NaN where unknown.
        colour: Of the line.
        width: Of the line [pt].
    """

    label: str
    t: np.ndarray
    values: np.ndarray
    colour: str
    width: float = 1.0


def error_traces(lines: Sequence[Line], quantity: str, ax: Axes) -> Axes:
    """Draw lines over time; `quantity` is along y, with its unit in brackets."""
    ax.axhline(0.0, color="#555555", linewidth=0.6)
    for line in lines:
        t, values = thinned(line.t, line.values)
        ax.plot(t, values, color=line.colour, linewidth=line.width, label=line.label)
    ax.set_ylabel(quantity)
    ax.margins(x=0.0)
    return ax


def measured_beside(measured: Line, predicted: Sequence[Line], quantity: str, ax: Axes) -> Axes:
    """Draw a measured quantity as dots over time, and what predicts it as lines on top."""
    t, values = _dotted(measured.t, measured.values)
    ax.plot(t, values, "o", color=measured.colour, markersize=1.3, markeredgewidth=0.0, label=measured.label)
    for line in predicted:
        t, values = thinned(line.t, line.values)
        ax.plot(t, values, color=line.colour, linewidth=line.width, label=line.label)
    ax.set_ylabel(quantity)
    ax.margins(x=0.0)
    return ax


def _dotted(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples evenly spread, and the extremes."""
    even = slice(None, None, max(1, len(t) // _DOTS))
    extreme_t, extremes = thinned(t, values, _DOTS // 10)
    t, rows = np.unique(np.append(t[even], extreme_t), return_index=True)
    return t, np.append(values[even], extremes)[rows]


def thinned(t: np.ndarray, values: np.ndarray, columns: int = _COLUMNS) -> tuple[np.ndarray, np.ndarray]:
    """The samples (n,) that hold the smallest and the largest value of each part of the time, in order."""
    if len(t) <= 2 * columns:
        return t, values
    kept = [0, len(t) - 1]
    for part in np.array_split(np.arange(len(t)), columns):
        known = part[np.isfinite(values[part])]
        kept += [known[np.argmin(values[known])], known[np.argmax(values[known])]] if len(known) else [part[0]]
    order = np.unique(kept)
    return t[order], values[order]
