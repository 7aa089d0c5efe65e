"""Content of one trial, in a few lines of figures: rates, holes, hidden markers, the plates' load, missing readings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap import per_coordinate, relabelled_trial, shape_change
from calibration.numerics.wrench import centre_of_pressure
from calibration.recording import Dataset, PostureMeans, Trial, TrialEntry, schema
from scenarios.quicklook.plots import holes

_REST = 1.0  # [s] at both ends of a trial


@dataclass(frozen=True)
class Looked:
    """One trial and what is worth reporting of it.

    Attributes:
        entry: As dataset.json has it.
        trial: What was recorded.
        findings: A line each.
    """

    entry: TrialEntry
    trial: Trial | PostureMeans
    findings: tuple[str, ...]


def looked_at(dataset: Dataset, entry: TrialEntry) -> Looked:
    """Read a trial and state its content.

    Raises:
        InputError: The file cannot be read, or is not what dataset.json says.
    """
    if dataset.has_means(entry):
        means = dataset.read_means(entry)
        return Looked(entry, means, (f"{len(means)} static postures as means, no times", *_markers(means)))
    trial = relabelled_trial(dataset, entry)
    return Looked(
        entry,
        trial,
        (
            *_clocks(trial),
            *_rests(trial),
            *_markers(trial),
            *_shapes(trial, dataset.description.bodies),
            *_plates(trial),
            *_at_rest(trial),
            *_encoders(trial),
            *_pressures(trial),
        ),
    )


def difference(trial: Trial | PostureMeans) -> np.ndarray:
    """Link reading minus motor reading about its mean (n, joint) [rad, m]; NaN where there is no link encoder."""
    if isinstance(trial, PostureMeans) or not len(trial.t_robot):
        return np.full((0, len(trial.joint)), np.nan)
    d = trial.q_link - trial.q_motor
    known = np.isfinite(d)
    mean = np.where(known, d, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.asarray(d - mean)


def pressure_of(trial: Trial) -> np.ndarray:
    """Centre of pressure of each plate (n, plate, 3) [m, lab], NaN while it is not loaded."""
    found = [
        centre_of_pressure(w, c) for w, c in zip(trial.plate_wrench.swapaxes(0, 1), trial.plate_centre, strict=True)
    ]
    return np.stack(found, axis=1) if found else np.zeros((0, 0, 3))


def _clocks(trial: Trial) -> Iterator[str]:
    for name, t in (("markers", trial.t_mocap), ("robot", trial.t_robot), ("plate", trial.t_plate)):
        if len(t) < 2:
            yield f"{name}: not recorded"
            continue
        step = np.diff(t)
        usual = float(np.median(step))
        n = len(holes(t))
        lost = f", {n} hole{'s' if n > 1 else ''} of up to {1e3 * step.max():.0f} ms" if n else ""
        steps = f"steps {1e3 * step.min():.2f}-{1e3 * step.max():.2f} ms"
        yield f"{name}: {t[-1] - t[0]:.1f} s at {1.0 / usual:.4g} Hz, {steps}{lost}"


def _rests(trial: Trial) -> Iterator[str]:
    length = trial.dwell_stop - trial.dwell_start
    if len(length):
        yield f"static postures: {len(length)} of {length.min():.1f}-{length.max():.1f} s"


def _markers(trial: Trial | PostureMeans) -> Iterator[str]:
    if not len(trial.marker_position):
        return
    hidden = ~np.isfinite(trial.marker_position).all(axis=2)
    worst = int(hidden.mean(axis=0).argmax())
    if hidden.any():
        of_it = 100.0 * float(hidden[:, worst].mean())
        yield f"markers: {100.0 * hidden.mean():.2g} % hidden, {trial.marker[worst]} the most, {of_it:.2g} %"
    else:
        yield f"markers: all {len(trial.marker)} seen throughout"


def _shapes(trial: Trial, bodies: Sequence[schema.Body]) -> Iterator[str]:
    """How well the markers of each body keep their places on it."""
    found = []
    for body in bodies:
        try:
            d = shape_change(body, trial).x
        except NotEnoughData:
            continue
        if d.size:
            found.append(f"{body.name} {1e3 * per_coordinate(d):.2g}")
    if found:
        yield f"marker cluster noise [mm per axis]: {', '.join(found)}"


def _plates(trial: Trial) -> Iterator[str]:
    for name, w, cop in zip(
        trial.plate, trial.plate_wrench.swapaxes(0, 1), pressure_of(trial).swapaxes(0, 1), strict=True
    ):
        loaded = np.isfinite(cop[:, 0])
        load = f"mean Fz {w[:, 2].mean():+.1f} N"
        if not loaded.any():
            yield f"{name}: {load}, never loaded"
            continue
        spread = 1e3 * np.ptp(cop[loaded, :2], axis=0)
        unloaded = "" if loaded.all() else f", {100.0 * (1.0 - loaded.mean()):.2g} % not loaded"
        yield f"{name}: {load}, centre of pressure over {spread[0]:.1f} x {spread[1]:.1f} mm{unloaded}"


def _at_rest(trial: Trial) -> Iterator[str]:
    """The weight on all plates in the first and the last second, the same but for drift."""
    t, fz = trial.t_plate, trial.plate_wrench[:, :, 2].sum(axis=1)
    if len(t) < 2 or t[-1] - t[0] < 2.0 * _REST:
        return
    first, last = float(fz[t <= t[0] + _REST].mean()), float(fz[t >= t[-1] - _REST].mean())
    yield f"plates: Fz {first:+.2f} N in the first second, {last:+.2f} N in the last: {last - first:+.2f} N"


def _pressures(trial: Trial) -> Iterator[str]:
    """Efforts of motors, wrench at the wrist."""
    if not len(trial.t_robot):
        return
    known = np.isfinite(trial.effort).any(axis=0)
    if known.any():
        k = int(np.nanargmax(np.abs(np.nan_to_num(trial.effort)).max(axis=0)))
        most = float(np.nanmax(np.abs(trial.effort[:, k])))
        yield f"robot: motor currents of {known.sum()} joints, {trial.joint[k]} the most, {most:.3g} A"
    f = np.linalg.norm(trial.wrist_wrench[:, :3], axis=1)
    if np.isfinite(f).any():
        yield f"wrist: force {np.nanmin(f):.1f}-{np.nanmax(f):.1f} N (zero offset not removed)"


def _encoders(trial: Trial) -> Iterator[str]:
    d = difference(trial)
    if not len(d):
        return
    without = [n for k, n in enumerate(trial.joint) if not np.isfinite(d[:, k]).any()]
    if without:
        yield f"robot: no link readings of {', '.join(without)}"
