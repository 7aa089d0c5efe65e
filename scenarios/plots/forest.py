"""Forest plot: estimates with their 95 % intervals, about what they are compared with."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from scenarios.plots.style import ESTIMATE, MISSED, NOMINAL, TRUTH

Z95 = 1.959964


@dataclass(frozen=True)
class Interval:
    """One estimate.

    Attributes:
        label: Its name.
        error: Estimate minus what it is compared with, in the unit of the axis.
        sigma: Its standard deviation, in the unit of the axis.
    """

    label: str
    error: float
    sigma: float

    @property
    def covers(self) -> bool:
        """Whether the 95 % interval contains what it is compared with."""
        return abs(self.error) <= Z95 * self.sigma


def intervals(found: Sequence[Interval], quantity: str, against_truth: bool, ax: Axes) -> Axes:
    """Draw intervals from top to bottom about zero: the truth, or the nominal value where no truth is known.

    Args:
        found: The estimates.
        quantity: What is along x, with its unit in brackets.
        against_truth: Zero is the truth; intervals that miss it have another colour.
        ax: Where to draw.
    """
    ax.axvline(0.0, color=TRUTH if against_truth else NOMINAL, linestyle=(0, (4, 2)) if against_truth else "-", lw=1.0)
    for y, one in enumerate(found):
        colour = MISSED if against_truth and not one.covers else ESTIMATE
        ax.hlines(y, one.error - Z95 * one.sigma, one.error + Z95 * one.sigma, color=colour, linewidth=1.4)
        ax.plot(one.error, y, marker="o", color=colour, markersize=3.4, linestyle="none")
    ax.set_yticks(range(len(found)), [one.label for one in found])
    ax.set_ylim(len(found) - 0.4, -0.6)
    ax.set_xlabel(quantity)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    return ax
