"""Published figures of the paper's models (Nguyen et al. 2024): medians read off its boxplots, RMSE from its text.

Real robot, measured base, link encoders, constants removed per axis: another protocol than ours.
"""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes

from calibration.prediction import LADDER, NOMINAL
from scenarios.report.results.ladder import Step

MODELS = tuple(row.name for row in LADDER if row.published is not None)
MEDIANS = ((12.7, 8.4, 4.6, 2.8), (5.1, 2.9, 2.6, 1.3), (18.4, 14.3, 6.8, 5.4))
"""Median of |x|, |y|, |z| [mm], a value a model."""

ORIENTATION = {NOMINAL: 8.57, "model_3": 2.71}
"""RMSE of the angle [deg]."""

_LOOK: dict[str, Any] = {
    "color": "#b5179e",
    "markersize": 5,
    "markerfacecolor": "none",
    "linestyle": "none",
    "zorder": 5,
}


def paper_steps(steps: Sequence[Step]) -> tuple[Step, ...]:
    """One predictive row a model: motor encoders, the best source of the base's motion there is."""
    found = []
    for row in LADDER:
        mine = {s.base: s for s in steps if (s.model, s.encoder) == (row.name, "motor")}
        base = row.predictive_base(mine)
        found += [mine[base]] if base is not None and row.published is not None else []
    return tuple(found)


def add_medians(steps: Sequence[Step], axis: int, ax: Axes) -> None:
    """Mark the published medians along an axis (0 to 2) in a boxplot of these rows."""
    for y, step in enumerate(steps):
        if step.model in MODELS:
            _mark(MEDIANS[axis][MODELS.index(step.model)], y, "D", ax)


def add_orientation(steps: Sequence[Step], ax: Axes) -> None:
    """Mark the published RMSE of orientation in a boxplot of these rows."""
    for y, step in enumerate(steps):
        if step.model in ORIENTATION:
            _mark(ORIENTATION[step.model], y, "s", ax)


def _mark(x: float, y: float, marker: str, ax: Axes) -> None:
    """A mark that is within the axis, which is made longer for it."""
    low, high = ax.get_xlim()
    ax.plot(x, y, marker=marker, **_LOOK)
    ax.set_xlim(min(low, 0.8 * x), max(high, 1.2 * x))
