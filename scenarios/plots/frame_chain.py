"""Diagram of the frames of Heins 2022 on our robot, and what each is called here.

T_wt = T_wB T_Bb T_ba T_ae(q) T_et        w laboratory, B base's markers, b base, a arm's base, e end effector, t tool
"""

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from scenarios.plots.strokes import FILL, INK, Point, arrow, box, canvas, line, name, word

FRAME_CHAIN = 10.0, 4.6  # [inch] width and height
_FLOOR = 0.75
_W, _BASE, _MARKERS, _ARM, _END, _TOOL = (1.0, 0.75), (3.2, 0.75), (3.95, 1.72), (3.55, 2.75), (6.1, 3.2), (7.15, 3.55)
_X, _Z, _TOLD, _MEASURED = "#c2410c", "#1b7f3b", "#1a5fa8", "#777777"


def frame_chain(ax: Axes) -> Axes:
    """Draw robot, frames and the transforms between them, seen from the side."""
    canvas(ax, *FRAME_CHAIN)
    line(ax, (0.4, _FLOOR), (9.6, _FLOOR), width=2.0)
    _robot(ax)
    for at, letter, where in (
        (_W, "w", (0.82, 0.5)),
        (_BASE, "b", (3.0, 0.52)),
        (_MARKERS, "B", (4.12, 1.55)),
        (_ARM, "a", (3.36, 2.6)),
        (_END, "e", (5.98, 2.98)),
        (_TOOL, "t", (7.32, 3.38)),
    ):
        _frame(ax, at, letter, where)
    _transforms(ax)
    word(ax, (5.0, 0.25), "grey: measured, or the factory's drawing; blue: what is estimated, by its name", colour=INK)
    return ax


def _robot(ax: Axes) -> None:
    for x in (2.65, 3.75):
        ax.add_patch(Circle((x, _FLOOR + 0.14), 0.14, facecolor="white", edgecolor=INK, linewidth=1.2))
    ax.add_patch(Polygon([(2.4, 1.0), (4.1, 1.0), (4.0, 1.55), (2.5, 1.55)], fc=FILL, ec=INK, linewidth=1.0))
    box(ax, (3.0, 2.2), (0.55, 1.3))
    for start, stop in ((_ARM, (4.6, 2.35)), ((4.6, 2.35), (5.3, 3.15)), ((5.3, 3.15), _END)):
        line(ax, start, stop, colour="#b9c0ca", width=7.0)
    line(ax, (3.25, 2.75), _ARM, colour="#b9c0ca", width=7.0)
    line(ax, _END, (6.75, 3.2), width=2.5)
    for x, y in ((3.75, 1.7), (4.1, 1.85), (6.95, 3.75), (7.3, 3.7)):
        ax.plot(x, y, "o", color=INK, markersize=4.0)
    line(ax, (6.7, 3.25), (6.95, 3.75))
    line(ax, (6.7, 3.25), (7.3, 3.7))


def _frame(ax: Axes, at: Point, letter: str, where: Point) -> None:
    arrow(ax, at, (at[0] + 0.36, at[1]), _X)
    arrow(ax, at, (at[0], at[1] + 0.36), _Z)
    word(ax, where, f"${letter}$", colour=INK)


def _transforms(ax: Axes) -> None:
    """Arrows from frame to frame, and names beside."""
    arrow(ax, _W, (_MARKERS[0] - 0.05, _MARKERS[1]), _MEASURED, bend=-0.25, width=0.9)
    word(ax, (0.5, 1.95), "$T_{wB}$ motion capture\nof body base; w = lab", "left", _MEASURED)
    arrow(ax, _BASE, _MARKERS, _TOLD, bend=0.2, width=0.9)
    name(ax, (4.35, 1.2), "frame.base.base = T_bB\nb = base_footprint", "left")
    arrow(ax, (_BASE[0] + 0.02, _BASE[1]), (_ARM[0], _ARM[1] - 0.02), _TOLD, bend=-0.12, width=0.9)
    name(ax, (1.0, 3.05), "frame.base.arm = T_ba\na = arm_1_joint, lift at 0", "left")
    arrow(ax, _ARM, _END, _MEASURED, bend=-0.35, width=0.9)
    word(ax, (4.0, 4.05), "$T_{ae}(q)$ of the factory's arm, motor encoders", "left", _MEASURED)
    arrow(ax, _END, _TOOL, _TOLD, bend=0.25, width=0.9)
    name(ax, (7.2, 2.9), "frame.tool.hand = T_et\ne = gripper_grasping_frame\nt = body gripper, its markers", "left")
    word(
        ax,
        (6.95, 1.6),
        "eq. 3-4: a spin tells b,\na drive its heading\neq. 5-6: $T_{ba}$, $T_{et}$ from postures",
        "left",
    )
