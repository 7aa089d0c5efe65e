"""The few strokes our diagrams are made of; lengths are those of the diagram's own axes, whose aspect is equal."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

INK, SOFT, FILL = "#1b1e23", "#565d68", "#eef1f5"
Point = tuple[float, float]


def canvas(ax: Axes, width: float, height: float) -> None:
    """Empty axes of a size, one unit the same in both directions."""
    ax.set_xlim(0.0, width)
    ax.set_ylim(0.0, height)
    ax.set_aspect("equal")
    ax.set_axis_off()


def box(ax: Axes, centre: Point, size: Point, text: str = "") -> None:
    """A part."""
    corner = centre[0] - size[0] / 2, centre[1] - size[1] / 2
    shape = "round,pad=0,rounding_size=0.06"
    ax.add_patch(FancyBboxPatch(corner, *size, boxstyle=shape, facecolor=FILL, edgecolor=INK, linewidth=1.0))
    ax.text(*centre, text, ha="center", va="center", fontsize=8.5)


def line(ax: Axes, start: Point, stop: Point, colour: str = INK, width: float = 1.0, style: str = "-") -> None:
    """A straight stroke."""
    ax.plot([start[0], stop[0]], [start[1], stop[1]], color=colour, linewidth=width, linestyle=style)


def spring(ax: Axes, start: Point, stop: Point, swing: float = 0.09, colour: str = INK) -> None:
    """A spring: a zigzag over the middle of the way."""
    along = np.array([0.0, 0.2, *np.linspace(0.25, 0.75, 6), 0.8, 1.0])
    _bent(ax, start, stop, along, swing * np.array([0, 0, 1, -1, 1, -1, 1, -1, 0, 0]), colour)


def damper(ax: Axes, start: Point, stop: Point, half: float = 0.08, colour: str = INK) -> None:
    """A damper: a piston in a pot that is open towards the start."""
    _bent(ax, start, stop, np.array([0.0, 0.55]), np.zeros(2), colour)
    _bent(ax, start, stop, np.array([0.55, 0.55]), np.array([-0.7, 0.7]) * half, colour)
    _bent(ax, start, stop, np.array([0.38, 0.7, 0.7, 0.38]), np.array([-1.0, -1.0, 1.0, 1.0]) * half, colour)
    _bent(ax, start, stop, np.array([0.7, 1.0]), np.zeros(2), colour)


def spiral(ax: Axes, centre: Point, radius: float, colour: str = INK) -> None:
    """A torsional spring."""
    turn = np.linspace(0.0, 5.0 * np.pi, 90)
    r = radius * (0.15 + 0.85 * turn / turn[-1])
    ax.plot(centre[0] + r * np.cos(turn), centre[1] + r * np.sin(turn), color=colour, linewidth=1.0)


def arrow(ax: Axes, start: Point, stop: Point, colour: str = INK, bend: float = 0.0, width: float = 1.3) -> None:
    """An arrow, bent for a rotation."""
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", stop, start, arrowprops=look | {"connectionstyle": f"arc3,rad={bend}", "mutation_scale": 10})


def name(ax: Axes, at: Point, text: str, ha: str = "center", colour: str = "#1a5fa8") -> None:
    """Names of parameters, in fixed width."""
    ax.text(*at, text, ha=ha, va="center", fontsize=7.2, family="monospace", color=colour, linespacing=1.35)


def word(ax: Axes, at: Point, text: str, ha: str = "center", colour: str = SOFT) -> None:
    """A remark."""
    ax.text(*at, text, ha=ha, va="center", fontsize=8.0, color=colour, linespacing=1.3)


def _bent(ax: Axes, start: Point, stop: Point, along: np.ndarray, aside: np.ndarray, colour: str) -> None:
    """A stroke through points given along the way (share) and aside of it (length)."""
    a, b = np.array(start), np.array(stop)
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
    points = a + along[:, None] * (b - a) + aside[:, None] * normal
    ax.plot(*points.T, color=colour, linewidth=1.0, solid_joinstyle="round")
