"""Discrepancy of a joint against its position: one colour for each direction of motion.

Pale dots: measured. Lines: what the model predicts for the same samples, in the order of time. Grey: both flanks of the
gap under the same torque.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from scenarios.plots.style import NOMINAL

FORTH, BACK = "#1a5fa8", "#c2410c"
_PALE = 0.6  # opacity of dots and lines
_DOTS = 140  # drawn of each flank
_GAP = 0.15  # [s] a line goes on for


@dataclass(frozen=True)
class Flank:
    """One direction of motion.

    Attributes:
        label: What it is called.
        colour: Of its dots and its line.
        t: (n,) [s].
        position: (n,).
        measured: (n,).
        model: (n,) predicted, None where there is no model.
    """

    label: str
    colour: str
    t: np.ndarray
    position: np.ndarray
    measured: np.ndarray
    model: np.ndarray | None


def hysteresis(flanks: tuple[Flank, ...], ax: Axes, edges: tuple[np.ndarray, ...] = ()) -> Axes:
    """Draw the directions of one joint; the caller names the axes. `edges`: t, position, both sides of its gap (n,)."""
    for side in edges[2:]:
        ax.plot(*strokes(edges[0], edges[1], side), color=NOMINAL, linewidth=0.4, label="flanks of the gap")
    for f in flanks:
        if f.model is not None:
            ax.plot(
                *strokes(f.t, f.position, f.model),
                color=f.colour,
                alpha=_PALE,
                linewidth=0.7,
                label=f"model, {f.label}",
            )
    for f in flanks:
        rows = slice(None, None, max(1, len(f.position) // _DOTS))
        look: dict[str, Any] = {"color": f.colour, "alpha": _PALE, "markersize": 2.4, "markeredgewidth": 0.0}
        ax.plot(f.position[rows], f.measured[rows], "o", **look, label=f"measured, {f.label}")
    return ax


def strokes(t: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
    """The columns (n,) with a NaN wherever more than 0.15 s pass between samples at t (n,) [s], or time goes back."""
    step = np.diff(t)
    breaks = np.flatnonzero((step > _GAP) | (step < 0.0)) + 1
    return tuple(np.insert(column, breaks, np.nan) for column in columns)
