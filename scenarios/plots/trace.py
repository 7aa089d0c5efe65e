"""Errors over time: a line a row, thinned so that every peak stays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

_COLUMNS = 450  # smallest and largest value are kept in each of so many parts of the time


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
