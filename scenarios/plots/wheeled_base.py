"""Diagram of the base on its wheels: springs and dampers of each wheel, the frame they are about, and the wrench.

F_i = K_i dr_i + C_i d(dr_i)/dt,   dr_i = t + theta x r_i        M_i = K_theta,i theta + C_theta,i dtheta/dt + r_i x F_i
"""

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from scenarios.plots.strokes import FILL, INK, arrow, box, canvas, damper, line, name, spiral, spring, word

WHEELED_BASE = 10.0, 4.0  # [inch] width and height
_FLOOR, _HUB, _BASE = 0.75, 1.02, 2.15  # heights
_WHEELS = (2.9, 5.0, 7.1)
_WRENCH, _FRAME = "#c2410c", "#1b7f3b"


def wheeled_base(ax: Axes) -> Axes:
    """Draw base, wheels, springs, frame and wrench, seen from the side."""
    canvas(ax, *WHEELED_BASE)
    line(ax, (0.6, _FLOOR), (9.4, _FLOOR), width=2.0)
    box(ax, (5.0, _FLOOR - 0.14), (7.4, 0.2))
    word(ax, (2.6, _FLOOR - 0.15), "force plate, or floor")
    ax.add_patch(
        Polygon([(2.2, _BASE), (7.8, _BASE), (7.6, _BASE + 0.5), (2.4, _BASE + 0.5)], fc=FILL, ec=INK, linewidth=1.0)
    )
    word(ax, (3.4, _BASE + 0.25), "base", colour=INK)
    for x in _WHEELS:
        _wheel(ax, x)
    _frame(ax)
    _wrench(ax)
    name(ax, (0.75, 1.95), "suspension.<wheel>.\n{kx,ky,kz}", ha="left")
    name(ax, (0.75, 1.5), "suspension.<wheel>.\n{cx,cy,cz}", ha="left")
    name(ax, (7.95, 1.62), "suspension.<wheel>.\n{krx,kry,krz}\n{crx,cry,crz}", ha="left")
    name(ax, (0.75, 1.05), "contact.<wheel>.\n{kn,bn,mu}", ha="left")
    return ax


def _wheel(ax: Axes, x: float) -> None:
    """A wheel on the floor; above its hub spring, damper and torsional spring."""
    ax.add_patch(Circle((x, _HUB), _HUB - _FLOOR, facecolor="white", edgecolor=INK, linewidth=1.4, zorder=3))
    ax.plot(x, _HUB, "o", color=INK, markersize=3.0, zorder=4)
    line(ax, (x - 0.28, 1.36), (x + 0.36, 1.36))
    line(ax, (x, _HUB), (x, 1.36))
    spring(ax, (x - 0.2, 1.36), (x - 0.2, _BASE))
    damper(ax, (x + 0.06, _BASE), (x + 0.06, 1.36))
    line(ax, (x + 0.36, 1.36), (x + 0.36, 1.55))
    spiral(ax, (x + 0.36, 1.7), 0.14)
    line(ax, (x + 0.36, 1.84), (x + 0.36, _BASE))


def _frame(ax: Axes) -> None:
    """base_footprint on the floor between the wheels, and the way r_i to a hub."""
    origin = (5.75, _FLOOR)
    arrow(ax, origin, (6.45, _FLOOR), _FRAME)
    arrow(ax, origin, (5.75, _FLOOR + 0.7), _FRAME)
    word(ax, (6.55, _FLOOR - 0.15), "x", colour=_FRAME)
    word(ax, (5.87, _FLOOR + 0.68), "z", colour=_FRAME)
    arrow(ax, origin, (_WHEELS[2] - 0.05, _HUB), INK, width=0.9)
    word(ax, (6.4, 1.03), "$r_i$", colour=INK)
    word(ax, (5.75, 0.28), "base_footprint at rest: frame 0", colour=_FRAME)


def _wrench(ax: Axes) -> None:
    """What the robot does to its base, and what the base does."""
    arrow(ax, (5.0, 3.75), (5.0, _BASE + 0.52), _WRENCH)
    arrow(ax, (5.35, 2.95), (4.65, 2.95), _WRENCH, bend=0.7)
    word(ax, (5.5, 3.5), "wrench w = (F, M), change since rest: plate or inverse dynamics", "left", _WRENCH)
    arrow(ax, (2.35, 3.0), (3.05, 3.0))
    arrow(ax, (2.35, 3.0), (2.35, 3.55))
    arrow(ax, (3.3, 2.95), (3.3, 3.5), bend=0.6)
    word(ax, (0.75, 3.72), "displacement x = (t, θ) of the base", "left", INK)
