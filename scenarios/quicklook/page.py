"""Quick-look pictures of recordings: a page a trial, from the dataset alone, before anything is estimated.

Each instrument is drawn on its own clock from its own first sample; nothing is aligned, filtered or left out, but
centres of pressure of plates that are not loaded.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.recording import Dataset, PostureMeans, Trial, load, schema
from calibration.robot import chain_of
from scenarios.files import output_folder
from scenarios.files.errors import ScenarioError
from scenarios.plots.style import drawing, figure
from scenarios.quicklook.plots import Channel, channels, pressed, seen_from_above, sight
from scenarios.quicklook.summary import Looked, difference, looked_at, pressure_of

_WIDTH, _HEIGHT, _DPI = 11.0, 10.5, 110  # [inch], [1/inch]
_BELOW_TITLE, _LINE = 0.942, 0.013  # where lines begin, height of one, of the page's height
_JOINTS = 4  # panels of encoders in a row
_LINEAR = 10.0  # [mm] below which distances are drawn to a linear scale: a base moves by millimetres, a hand by metres
_AXES = ("x", "y", "z")


def look(
    dataset: Path, out: Path, trials: Sequence[str] = (), progress: Callable[[str, str, float], None] | None = None
) -> tuple[Looked, ...]:
    """Write a picture of each trial as OUT/<trial>.png, and say what it holds.

    Args:
        dataset: A dataset folder.
        out: The folder to write; what else is in it stays.
        trials: Only these; all where none is named.
        progress: Called with "look", the trial and the share that is done.

    Raises:
        ScenarioError: There is no such trial, or `out` cannot be written.
        InputError: The dataset cannot be read.
    """
    source = load(dataset)
    known = {e.id: e for e in source.description.trials}
    unknown = [name for name in trials if name not in known]
    if unknown:
        raise ScenarioError(f"{dataset}: no trial {unknown[0]!r}; its trials are {', '.join(known)}")
    found = []
    with output_folder.updating(out, []) as new:
        names = tuple(trials or known)
        for k, name in enumerate(names):
            if progress is not None:
                progress("look", name, k / len(names))
            one = looked_at(source, known[name])
            with drawing():
                page(source, one).savefig(new / f"{name}.png", dpi=_DPI, metadata={"Software": None})
            found.append(one)
    return tuple(found)


def page(dataset: Dataset, one: Looked) -> Figure:
    """The picture of one trial."""
    drawn, trial, findings = figure(_WIDTH, _HEIGHT), one.trial, _in_columns(one.findings)
    top = _BELOW_TITLE - _LINE * len(findings)
    parts = drawn.add_gridspec(2, 1, height_ratios=(1.85, 1.0), left=0.06, right=0.955, top=top, bottom=0.05)
    grid = parts[0].subgridspec(3, 2, width_ratios=(1.0, 1.35), hspace=0.5, wspace=0.2)
    title = f"{one.entry.id}: {one.entry.role}, {one.entry.kind}"
    drawn.text(0.06, 0.985, title, fontsize=11.0, fontweight="bold", va="top")
    drawn.text(0.06, 0.963, "\n".join(findings), fontsize=7.0, va="top", linespacing=1.35)
    _from_above(dataset.description.plates, trial, drawn.add_subplot(grid[0, 0]))
    _motion(trial, drawn.add_subplot(grid[0, 1]))
    _sight(trial, drawn.add_subplot(grid[1, 1]))
    _pressure(trial, drawn.add_subplot(grid[1, 0]))
    _wrench(trial, 0, drawn.add_subplot(grid[2, 0]))
    _wrench(trial, 3, drawn.add_subplot(grid[2, 1]))
    if isinstance(trial, PostureMeans) or not len(trial.t_robot):
        _nothing("no joint readings over time", drawn.add_subplot(parts[1]))
        return drawn
    joints = parts[1].subgridspec(-(-len(trial.joint) // _JOINTS), _JOINTS, hspace=0.6, wspace=0.28)
    chain = chain_of(dataset.urdf, dataset.description)
    for k, name in enumerate(trial.joint):
        unit = "mm" if chain.is_prismatic(name) else "mrad"
        _encoders(trial, k, unit, drawn.add_subplot(joints[k // _JOINTS, k % _JOINTS]))
    return drawn


def _in_columns(findings: Sequence[str]) -> list[str]:
    half = -(-len(findings) // 2)
    left, right = findings[:half], [*findings[half:], *[""] * (2 * half - len(findings))]
    return [f"{a}    |    {b}" if b else a for a, b in zip(left, right, strict=True)]


def _times(trial: Trial | PostureMeans) -> tuple[np.ndarray, str]:
    """Along which markers are drawn."""
    if isinstance(trial, PostureMeans):
        return np.arange(len(trial), dtype=float), "posture"
    return trial.t_mocap - trial.t_mocap[:1], "time on the markers' clock [s]"


def _bodies(trial: Trial | PostureMeans) -> list[tuple[str, np.ndarray]]:
    """Bodies and where their markers are in the file."""
    names = dict.fromkeys(trial.marker_body)
    return [(name, np.flatnonzero(np.array(trial.marker_body) == name)) for name in names]


def _from_above(plates: Sequence[schema.Plate], trial: Trial | PostureMeans, ax: Axes) -> None:
    ax.set_title("markers from above, plates")
    if not len(trial.marker_position):
        return _nothing("no markers", ax)
    thin = max(1, len(trial.marker_position) // 400)
    paths = [
        Channel(name, trial.marker_position[::thin, rows, 0].ravel(), trial.marker_position[::thin, rows, 1].ravel())
        for name, rows in _bodies(trial)
    ]
    seen_from_above(paths, [_corners(p) for p in plates] if isinstance(trial, Trial) and trial.plate else [], ax)
    return None


def _corners(plate: schema.Plate) -> np.ndarray:
    x, y = (0.5 * plate.size[k] * np.array(plate.axes[k])[:2] for k in range(2))
    return np.asarray(np.array([x + y, -x + y, -x - y, x - y]) + np.array(plate.centre)[:2])


def _motion(trial: Trial | PostureMeans, ax: Axes) -> None:
    ax.set_title("distance of each body's markers from where they first were")
    t, clock = _times(trial)
    if not len(t):
        return _nothing("no markers", ax)
    drawn = []
    for name, rows in _bodies(trial):
        p = trial.marker_position[:, rows]
        seen = np.isfinite(p).all(axis=2)
        first = p[seen.argmax(axis=0), np.arange(len(rows))]
        d = np.linalg.norm(p - first, axis=2)
        count = np.isfinite(d).sum(axis=1)
        mean = np.where(count > 0, np.nansum(d, axis=1) / np.maximum(count, 1), np.nan)
        drawn.append(Channel(name, t, 1e3 * mean))
    largest = max(float(np.nanmax(c.values)) for c in drawn)
    channels(drawn, "distance [mm]", ax).set_yscale("symlog", linthresh=_LINEAR)
    ax.set_ylim(0.0, max(2.0 * largest, 2.0 * _LINEAR))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_xlabel(clock)
    return None


def _sight(trial: Trial | PostureMeans, ax: Axes) -> None:
    ax.set_title("markers and gaps")
    t, clock = _times(trial)
    if not len(t):
        return _nothing("no markers", ax)
    sight(t, np.isfinite(trial.marker_position).all(axis=2), trial.marker, ax).set_xlabel(clock)
    return None


def _pressure(trial: Trial | PostureMeans, ax: Axes) -> None:
    ax.set_title("centre of pressure, a ring where it begins")
    if isinstance(trial, PostureMeans) or not np.isfinite(cop := pressure_of(trial)).any():
        return _nothing("no loaded plate", ax)
    pressed([Channel(n, *(1e3 * cop[:, k, :2]).T) for k, n in enumerate(trial.plate)], ax)
    return None


def _wrench(trial: Trial | PostureMeans, first: int, ax: Axes) -> None:
    """Force or moment of all plates together, about the first one's centre; Fz about its mean."""
    name, unit = ("F", "N") if first == 0 else ("M", "N.m")
    ax.set_title("force on the plates" if first == 0 else "moment on the plates, about the first one's centre")
    if isinstance(trial, PostureMeans) or not len(trial.t_plate):
        return _nothing("no plate", ax)
    lever = trial.plate_centre - trial.plate_centre[0]
    f, m = trial.plate_wrench[..., :3], trial.plate_wrench[..., 3:]
    w = f.sum(axis=1) if first == 0 else (m + np.cross(lever, f)).sum(axis=1)
    rest = w.mean(axis=0) if first else np.array([0.0, 0.0, w[:, 2].mean()])
    t, labels = trial.t_plate - trial.t_plate[0], [f"{name}{a}" for a in _AXES]
    labels = [f"{label} {-r:+.0f} {unit}" if round(r) else label for label, r in zip(labels, rest, strict=True)]
    channels([Channel(n, t, x) for n, x in zip(labels, (w - rest).T, strict=True)], f"{name} [{unit}]", ax)
    ax.set_xlabel("time on the plate's clock [s]")
    return None


def _encoders(trial: Trial, k: int, unit: str, ax: Axes) -> None:
    ax.set_title(f"{trial.joint[k]}: link - motor", fontweight="normal")
    d = difference(trial)[:, k]
    if not np.isfinite(d).any():
        return _nothing("no link encoder", ax)
    channels([Channel(trial.joint[k], trial.t_robot - trial.t_robot[0], 1e3 * d)], f"[{unit}]", ax)
    ax.set_xlabel("time on the robot's clock [s]")
    return None


def _nothing(why: str, ax: Axes) -> None:
    ax.set_axis_off()
    ax.text(0.5, 0.5, why, ha="center", va="center", color="#777777", transform=ax.transAxes)
