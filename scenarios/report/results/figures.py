"""The figures of a report, composed of plots; each is None where the data for it are missing."""

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.prediction import BASELINE
from calibration.prediction import NOMINAL as NOMINAL_ROW
from scenarios.plots.boxes import Sample, error_boxes
from scenarios.plots.forest import intervals
from scenarios.plots.histogram import z_histogram
from scenarios.plots.style import ESTIMATE, NOMINAL, ORACLE, OTHER, drawing, figure
from scenarios.plots.trace import Line, error_traces
from scenarios.report.results.ladder import Step, floor, headline_model, oracle_base, predictive
from scenarios.report.results.parameters import Known, groups
from scenarios.report.results.published import add_medians, add_orientation
from scenarios.report.results.run_results import Results
from scenarios.report.results.traces import Trace

WIDTH = 10.0  # [inch], as wide as the page
_OVERVIEW = 5.6  # [inch], half as wide
_ORIENTATION = "orientation error [deg]"
_MOST_ITEMS = 40  # in one group of the forest plot
_ENOUGH_Z = 20  # for a histogram
_ITEM, _TITLE, _AXIS = 0.165, 0.24, 0.46  # [inch] heights of an item, and of what is above and below a panel
_TRACE = 1.4  # [inch] height of one of the traces
_CHARACTER = 0.062  # [inch] average width of one in a label


def boxes(results: Results, steps: Sequence[Step]) -> Figure | None:
    """Absolute errors of each row: per axis, norm, and orientation."""
    rows = [(s, mine) for s in steps if (mine := _of_step(results.traces, s))]
    if not rows:
        return None
    position = [np.abs(np.concatenate([t.scored_position for t in mine])) for _, mine in rows]
    columns = [[e[:, axis] for e in position] for axis in range(3)]
    columns += [[np.linalg.norm(e, axis=1) for e in position]]
    columns += [[np.concatenate([t.scored_angle for t in mine]) for _, mine in rows]]
    quantities = [*(f"|error along {axis}| [mm]" for axis in "xyz"), "position error, norm [mm]", _ORIENTATION]
    floors = _floors(steps)
    with drawing():
        height = 0.30 * len(rows)
        drawn = figure(WIDTH, height + _AXIS + 0.06)
        left = _width(s.label for s, _ in rows)
        share = (WIDTH - left) / 5
        axes = [_place(drawn, left + share * k, _AXIS, share - 0.12, height) for k in range(5)]
        for ax, column, quantity, low in zip(axes, columns, quantities, floors, strict=True):
            samples = [Sample(s.label, e, *_paint(s)) for (s, _), e in zip(rows, column, strict=True)]
            error_boxes(samples, quantity, low, ax)
            ax.tick_params(axis="y", labelleft=ax is axes[0])
        share_limits(axes[:3])
    return drawn


def overview(results: Results, steps: Sequence[Step]) -> Figure | None:
    """Errors per component and of orientation of the predictive rows, RMSE written beside, published medians marked."""
    rows = [(s, mine) for s in steps if (mine := _of_step(results.traces, s))]
    if not rows:
        return None
    position = [np.abs(np.concatenate([t.scored_position for t in mine]).ravel()) for _, mine in rows]
    angle = [np.concatenate([t.scored_angle for t in mine]) for _, mine in rows]
    shown = [s for s, _ in rows]
    with drawing():
        height = 0.34 * len(rows)
        drawn = figure(_OVERVIEW, height + _AXIS + 0.06)
        left = _width(s.model for s in shown)
        share = (_OVERVIEW - left) / 2
        axes = [_place(drawn, left + share * k, _AXIS, share - 0.42, height) for k in range(2)]
        quantities = ("|error| per component [mm]", _ORIENTATION)
        for ax, errors, quantity in zip(axes, (position, angle), quantities, strict=True):
            samples = [Sample(s.model, e, *_paint(s)) for s, e in zip(shown, errors, strict=True)]
            error_boxes(samples, quantity, None, ax)
            ax.tick_params(axis="y", labelleft=ax is axes[0])
            for y, e in enumerate(errors):
                text = f"{np.sqrt((e**2).mean()):.2f}"
                ax.annotate(text, (1.03, y), xycoords=("axes fraction", "data"), va="center", fontsize=7.5)
        for axis in range(3):
            add_medians(shown, axis, axes[0])
        add_orientation(shown, axes[1])
    return drawn


def share_limits(axes: Sequence[Axes]) -> None:
    """Draw axes along x to one scale."""
    low, high = (pick(ax.get_xlim()[k] for ax in axes) for k, pick in enumerate((min, max)))
    for ax in axes:
        ax.set_xlim(low, high)


def _floors(steps: Sequence[Step]) -> tuple[float | None, ...]:
    low = floor(steps)
    if low is None:
        return (None,) * 5
    axis = low.per_axis_mm
    return axis.x, axis.y, axis.z, low.position_rmse_norm_mm, low.orientation_rmse_deg


def _paint(step: Step) -> tuple[str, bool]:
    """Colour of a row, and whether its box is hollow: an oracle's is."""
    colour = {NOMINAL_ROW: NOMINAL, BASELINE: OTHER}.get(step.model, ESTIMATE)
    return colour, step.kind != "predictive"


def _of_step(traces: Sequence[Trace], step: Step) -> list[Trace]:
    """Traces of a row with something scored."""
    wanted = (step.model, step.base, step.encoder)
    return [
        t
        for t in traces
        if (t.model, t.base, t.encoder) == wanted
        and len(t.scored_angle)
        and step.trials in ("all", "static" if t.kind == "static" else "dynamic")
    ]


def traced_trial(results: Results, steps: Sequence[Step]) -> str | None:
    """The trial drawn over time: the first one that the rows are scored on."""
    return next((t.trial for s in steps for t in _of_step(results.traces, s)), None)


def traces(results: Results, steps: Sequence[Step]) -> Figure | None:
    """Errors over time, or by posture, in one trial: x, y, z, orientation; nominal robot and main model."""
    trial, model = traced_trial(results, steps), headline_model(results, steps)
    wanted = [
        (predictive(steps, NOMINAL_ROW) or oracle_base(steps, NOMINAL_ROW), NOMINAL, 0.9),
        (oracle_base(steps, model), ORACLE, 0.9),
        (predictive(steps, model), ESTIMATE, 1.1),
    ]
    found = [(t, s, c, w) for s, c, w in wanted if s for t in _of_step(results.traces, s) if t.trial == trial]
    if not found:
        return None
    with drawing():
        height = 4 * _TRACE + _AXIS + _TITLE
        drawn = figure(WIDTH, height)
        axes = [_place(drawn, 0.55, _AXIS + _TRACE * k, WIDTH - 0.65, _TRACE - 0.1) for k in (3, 2, 1, 0)]
        for axis, ax in enumerate(axes[:3]):
            lines = [Line(_legend(s), t.t, t.position[:, axis], c, w) for t, s, c, w in found]
            error_traces(lines, f"error along {'xyz'[axis]} [mm]", ax)
        error_traces([Line(_legend(s), t.t, t.angle, c, w) for t, s, c, w in found], _ORIENTATION, axes[3])
        _finish_traces(axes, "posture [-]" if of_means(results, trial) else "time since the start of the trial [s]")
    return drawn


def of_means(results: Results, trial: str | None) -> bool:
    """Whether a trial was recorded as posture means, without time."""
    return any(one.entry.id == trial and one.duration is None for one in results.recorded)


def _legend(step: Step) -> str:
    return f"{step.label} ({step.kind})"


def _finish_traces(axes: Sequence[Axes], along: str) -> None:
    widest = max(abs(bound) for ax in axes[:3] for bound in ax.get_ylim())
    for ax in axes[:3]:
        ax.set_ylim(-widest, widest)
    axes[3].set_ylim(bottom=0.0)
    for ax in axes:
        ax.set_xlim(left=0.0)
        ax.tick_params(axis="x", labelbottom=ax is axes[3])
    axes[3].set_xlabel(along)
    handles, labels = axes[0].get_legend_handles_labels()
    axes[0].legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=len(labels))


def _width(labels: Iterable[str]) -> float:
    """Room for the longest of the labels left of axes [inch]."""
    return 0.15 + _CHARACTER * max(len(label) for label in labels)


def _place(drawn: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place of a figure [inch]."""
    w, h = drawn.get_size_inches()
    return drawn.add_axes((left / w, bottom / h, width / w, height / h))


def forest(found: Sequence[Known], against_truth: bool) -> Figure | None:
    """Every known parameter with its 95 % interval, a panel for each kind and unit, in two columns."""
    panels = [(title, _worst(items)) for title, items in groups(found).items()]
    if not panels:
        return None
    columns = _packed(panels)
    height = max(sum(_height(items) for _, items in column) for column in columns)
    left = _width(k.label for k in found)
    about = "truth" if against_truth else "nominal"
    with drawing():
        drawn = figure(WIDTH, height)
        for place, column in enumerate(columns):
            top = height
            for (kind, unit), items in column:
                size = _ITEM * len(items)
                ax = _place(drawn, WIDTH / 2 * place + left, top - _TITLE - size, WIDTH / 2 - left - 0.2, size)
                intervals([k.interval for k in items], f"estimate − {about} [{unit}]", against_truth, ax)
                ax.set_title(kind)
                top -= _height(items)
    return drawn


def _height(items: Sequence[Known]) -> float:
    return _TITLE + _ITEM * len(items) + _AXIS


def _worst(items: Sequence[Known]) -> list[Known]:
    """All items, or of very many those farthest off in standard deviations."""
    if len(items) <= _MOST_ITEMS:
        return list(items)
    limit = sorted((abs(k.z) for k in items), reverse=True)[_MOST_ITEMS - 1]
    return [k for k in items if abs(k.z) >= limit][:_MOST_ITEMS]


def _packed(panels: list[tuple[tuple[str, str], list[Known]]]) -> list[list[tuple[tuple[str, str], list[Known]]]]:
    """The panels in two columns of about the same height, in reading order."""
    total, left = sum(_height(items) for _, items in panels), 0.0
    for n, (_, items) in enumerate(panels):
        if left + 0.5 * _height(items) > 0.5 * total and n > 0:
            return [panels[:n], panels[n:]]
        left += _height(items)
    return [panels]


def z_scores(found: Sequence[Known], against_truth: bool) -> Figure | None:
    """Histogram of z, where there are enough estimates and a truth."""
    if not against_truth or len(found) < _ENOUGH_Z:
        return None
    with drawing():
        drawn = figure(0.5 * WIDTH, 2.4)
        z_histogram(np.array([k.z for k in found]), _place(drawn, 0.6, _AXIS, 0.5 * WIDTH - 0.7, 2.4 - _AXIS - 0.08))
    return drawn
