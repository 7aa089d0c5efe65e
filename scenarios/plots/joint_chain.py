"""Diagram of a joint's drive chain: where play and flexibility come between what the two encoders read.

q_motor - q_link = play (the flank the load and the motion choose) + compliance * torque + errors of both encoders
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Wedge

from scenarios.plots.strokes import FILL, INK, SOFT, arrow, box, canvas, line, name, spring, word

JOINT_CHAIN = 10.0, 3.15  # [inch] width and height
_AXIS = 1.75  # height of the shaft


def joint_chain(ax: Axes) -> Axes:
    """Draw motor, motor-side encoder, reducer with play and flexibility, link-side encoder and link, left to right."""
    canvas(ax, *JOINT_CHAIN)
    box(ax, (0.85, _AXIS), (1.1, 0.8), "motor")
    for start, stop in ((1.4, 3.41), (4.0, 4.35), (5.55, 8.25)):
        line(ax, (start, _AXIS), (stop, _AXIS), width=2.2)
    _encoder(ax, 2.2, "motor-side encoder", "q_motor")
    _play(ax)
    spring(ax, (4.35, _AXIS), (5.55, _AXIS), 0.17)
    _encoder(ax, 6.55, "link-side encoder", "q_link")
    _link(ax)
    name(ax, (0.85, 2.55), "friction.<joint>.\n{coulomb,viscous}")
    name(ax, (2.2, 2.55), "gear.<joint>.\nrotor_inertia")
    name(ax, (3.62, 2.55), "backlash.\n<joint>.gap")
    name(ax, (4.95, 2.55), "gear.<joint>.\n{compliance,damping}")
    name(ax, (7.5, 2.72), "geometry.<joint>.{x,y,z,rx,ry,rz}")
    name(ax, (2.2, 0.28), "encoder.<joint>.motor.\n{offset,cos1,sin1,cos2,sin2}")
    name(ax, (6.55, 0.28), "encoder.<joint>.link.\n{offset,cos1,sin1,cos2,sin2}")
    word(ax, (4.25, 1.13), "reducer: play, then flexibility")
    return ax


def _encoder(ax: Axes, x: float, text: str, reading: str) -> None:
    """A slotted disc on the shaft and its reading below."""
    ax.add_patch(Circle((x, _AXIS), 0.3, facecolor=FILL, edgecolor=INK, linewidth=1.0, zorder=3))
    for angle in np.arange(0.0, 360.0, 45.0):
        ax.add_patch(Wedge((x, _AXIS), 0.27, angle, angle + 22.0, width=0.11, color=INK, zorder=4))
    arrow(ax, (x, _AXIS - 0.32), (x, 1.05))
    word(ax, (x, 0.68), f"{text}: {reading}", colour=INK)


def _play(ax: Axes) -> None:
    """A tooth in a fork: the gap is what is left on both sides of it."""
    for way in (1.0, -1.0):
        line(ax, (3.5, _AXIS + 0.36 * way), (4.0, _AXIS + 0.36 * way), width=2.2)
        arrow(ax, (3.65, _AXIS + 0.15 * way), (3.65, _AXIS + 0.35 * way), SOFT, width=0.8)
    line(ax, (4.0, _AXIS - 0.36), (4.0, _AXIS + 0.36), width=2.2)
    box(ax, (3.62, _AXIS), (0.42, 0.26))


def _link(ax: Axes) -> None:
    """The link turned by the shaft, its weight and the torque it asks for."""
    ax.add_patch(Circle((8.4, _AXIS), 0.16, facecolor=FILL, edgecolor=INK, linewidth=1.0, zorder=3))
    line(ax, (8.5, _AXIS + 0.05), (9.55, _AXIS + 0.45), width=6.0)
    ax.add_patch(Circle((9.1, _AXIS + 0.28), 0.07, facecolor="white", edgecolor=INK, linewidth=1.0, zorder=4))
    arrow(ax, (9.1, _AXIS + 0.2), (9.1, 1.1))
    arrow(ax, (7.75, _AXIS + 0.3), (7.75, _AXIS - 0.3), bend=0.6)
    word(ax, (9.3, 2.45), "link", colour=INK)
    word(ax, (7.75, 1.22), "gravity torque", colour=INK)
    name(ax, (9.05, 0.78), "link.<name>.\n{mass,cx,cy,cz}")
