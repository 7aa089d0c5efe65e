"""Recordings of one trial: markers and their gaps, channels over time, centres of pressure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from scenarios.plots.style import MISSED, NOMINAL
from scenarios.plots.trace import thinned

COLOURS = ("#1a5fa8", "#b08a4a", "#1b7f3b", "#8a4fa3", "#0f8b8d", "#a8324a")
"""Of the channels of one panel, in order."""
_HOLE = 2.5  # times the usual step of a clock


@dataclass(frozen=True)
class Channel:
    """Something that was sampled.

    Attributes:
        label: Its name.
        t: (n,) [s].
        values: (n,), NaN where nothing was seen.
    """

    label: str
    t: np.ndarray
    values: np.ndarray


def channels(drawn: Sequence[Channel], quantity: str, ax: Axes) -> Axes:
    """Draw channels over time, every peak and hole kept; `quantity` is along y, with its unit in brackets."""
    for channel, colour in zip(drawn, _colours(len(drawn)), strict=True):
        for k, rows in enumerate(np.split(np.arange(len(channel.t)), holes(channel.t) + 1)):
            t, values = thinned(channel.t[rows], channel.values[rows])
            ax.plot(t, values, color=colour, linewidth=0.8, label="" if k else channel.label)
    if len(drawn) > 1:
        ax.legend(loc="upper right", ncols=len(drawn), handlelength=1.2, columnspacing=1.0, borderaxespad=0.1)
    ax.set_ylabel(quantity)
    ax.margins(x=0.0)
    return ax


def holes(t: np.ndarray) -> np.ndarray:
    """Indices of the samples at t (n,) [s] after which others are missing: the next step is 2.5 times the usual one."""
    step = np.diff(t)
    return np.flatnonzero(step > _HOLE * np.median(step)) if len(step) else np.zeros(0, dtype=int)


def sight(t: np.ndarray, seen: np.ndarray, names: Sequence[str], ax: Axes) -> Axes:
    """Draw when each marker was seen (n, m) at t (n,) [s]: a line while it is, a gap in colour while it is not."""
    for row, name in enumerate(names):
        ax.plot(t[[0, -1]], [row, row], color="#d5dae2", linewidth=2.2, solid_capstyle="butt")
        for start, stop in gaps(seen[:, row]):
            ax.plot(t[[start, stop]], [row, row], color=MISSED, linewidth=2.8, solid_capstyle="projecting")
        lost = 100.0 * float(1.0 - seen[:, row].mean())
        ax.text(1.01, row, "" if lost == 0.0 else f"{lost:.2g} %", transform=ax.get_yaxis_transform(), va="center",
                fontsize=6.0, color=MISSED, label=name)  # fmt: skip
    ax.set_yticks(range(len(names)), names, fontsize=6.0)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(visible=False)
    ax.margins(x=0.0)
    return ax


def gaps(seen: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of each run of what was not seen (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[1], seen.astype(np.int8), [1]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def seen_from_above(paths: Sequence[Channel], corners: Sequence[np.ndarray], ax: Axes) -> Axes:
    """Draw where markers went in the plane, t and values being x and y [m], and plates by corners (4, 2) [m]."""
    for corner in corners:
        ax.add_patch(Polygon(corner, closed=True, facecolor="#eef1f5", edgecolor=NOMINAL, linewidth=0.8))
    for path, colour in zip(paths, _colours(len(paths)), strict=True):
        ax.plot(path.t, path.values, ".", color=colour, markersize=1.0, label=path.label)
    ax.legend(loc="upper right", markerscale=6.0, borderaxespad=0.1, handlelength=1.0)
    return _map(ax, "x", "y", "m")


def pressed(paths: Sequence[Channel], ax: Axes) -> Axes:
    """Draw paths of centres of pressure, t and values being x and y [mm]; a ring where each begins."""
    for path, colour in zip(paths, _colours(len(paths)), strict=True):
        ax.plot(path.t, path.values, color=colour, linewidth=0.5, label=path.label)
        first = np.flatnonzero(np.isfinite(path.values))[:1]
        ax.plot(path.t[first], path.values[first], "o", color=colour, markersize=5.0, markerfacecolor="none")
    if len(paths) > 1:
        ax.legend(loc="upper right", borderaxespad=0.1)
    return _map(ax, "x", "y", "mm")


def _map(ax: Axes, x: str, y: str, unit: str) -> Axes:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(f"{x} [{unit}]")
    ax.set_ylabel(f"{y} [{unit}]")
    return ax


def _colours(n: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(n)]
