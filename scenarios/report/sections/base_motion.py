"""The base's motion in one held-out trial: measured by its markers, predicted by the suspension.

x = (t, theta)  displacement of the base frame since the first second [mm, mrad], axes of the base at rest
R2_a = 1 - sum (x - x_hat)_a^2 / sum x_a^2         zero is a base that does not move; the first second does not count
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure

from calibration import prediction
from calibration.numerics.signals import CUTOFF, even, low_passed
from calibration.stages.suspension import REST, Suspension
from scenarios.plots.style import ESTIMATE, OTHER, drawing, figure
from scenarios.plots.trace import Line, measured_beside
from scenarios.report.results import suspension
from scenarios.report.results.formatting import fixed
from scenarios.report.results.run_results import Results
from scenarios.report.results.section import Drawn, RunView

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
UNITS = ("mm", "mm", "mm", "mrad", "mrad", "mrad")
_UNIT = 1e3  # mm in a metre, mrad in a radian
_LINES = {"plate": (ESTIMATE, 1.7), "dynamics": (OTHER, 0.7)}
_HEIGHT = 5.2  # [inch] of the figure
_DIAGRAM = Path(__file__).parents[1] / "wheeled_base.svg"


@dataclass(frozen=True)
class Predicted:
    """The base as one source of the wrench predicts it.

    Attributes:
        source: `plate` or `dynamics`.
        x: (n, 6) [mm, mrad].
        r2: (6,) over all that counts.
        r2_middle: (6,) over the middle half of the trial, away from the jolts of start and stop.
        moves: (6,) axes that are moved.
    """

    source: str
    x: np.ndarray
    r2: np.ndarray
    r2_middle: np.ndarray
    moves: np.ndarray


@dataclass(frozen=True)
class TrialMotion:
    """The base in one trial.

    Attributes:
        trial: Its name.
        t: (n,) [s from the trial's start].
        measured: (n, 6) [mm, mrad], NaN where not seen.
        predicted: By source of the wrench.
    """

    trial: str
    t: np.ndarray
    measured: np.ndarray
    predicted: tuple[Predicted, ...]

    @property
    def scored(self) -> np.ndarray:
        """(n,) what counts."""
        return np.asarray((self.t > REST) & np.isfinite(self.measured).all(axis=1))

    @property
    def middle(self) -> np.ndarray:
        """(n,) the middle half of the trial."""
        return np.asarray(self.scored & (np.abs(self.t / self.t[-1] - 0.5) < 0.25))

    @property
    def spread(self) -> np.ndarray:
        """Peak to peak of the measured motion (6,) [mm, mrad]."""
        return np.ptp(self.measured[self.scored], axis=0)

    @property
    def shifted(self) -> np.ndarray:
        """Displacement of the base in the last second (6,) [mm, mrad]; it began at zero."""
        return np.asarray(np.nanmean(self.measured[self.t > self.t[-1] - REST], axis=0))

    @property
    def noise(self) -> np.ndarray:
        """Rms (6,) [mm, mrad] of the markers' noise, by the first second at rest."""
        return np.asarray(np.nanstd(self.measured[self.t <= REST], axis=0))

    def left(self, predicted: Predicted) -> np.ndarray:
        """Rms (6,) [mm, mrad] that a prediction leaves."""
        return np.sqrt(((self.measured - predicted.x)[self.scored] ** 2).mean(axis=0))


@dataclass(frozen=True)
class AxisMotion:
    """One axis of one trial.

    Attributes:
        axis: Its name.
        unit: Of what follows.
        spread: Peak to peak of what was measured.
        shifted: Measured displacement at the end.
        noise: Rms of the markers' noise.
        found: By source of the wrench: R2 and that of the middle half, None where the axis is not predicted, and the
            rms that is left.
    """

    axis: str
    unit: str
    spread: float
    shifted: float
    noise: float
    found: tuple[tuple[float | None, float | None, float], ...]


@dataclass(frozen=True)
class BaseMotion:
    """The base on its wheels: measured and predicted motion, springs and dampers."""

    view: RunView
    title: ClassVar[str] = "Motion of the base"
    template: ClassVar[str] = "base_motion.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """The diagram, and the motion of the base in one trial."""
        found, _ = self._trial_motion
        return {"wheels": _DIAGRAM, "trial_motion": drawn(found) if found else None}

    def context(self) -> Mapping[str, Any]:
        """Motion of the base or why there is none; its springs and dampers."""
        results = self.view.results
        found, why = self._trial_motion
        fitted = results.estimate.suspension if results.estimate else None
        return {
            "trial_motion": found,
            "motion_axes": lines(found) if found else (),
            "why_no_motion": why,
            "base_scores": results.score.base if results.score else (),
            "axis_lines": suspension.axis_lines(results),
            "suspension_sources": suspension.sources(results),
            "held_out_yaw": suspension.held_out_yaw(results),
            "suspension_form": fitted.form if fitted else "",
            "suspension_messages": suspension.messages(results),
            "elements": suspension.elements(results, "K"),
            "damping": suspension.elements(results, "C"),
            "structures": suspension.structures(results.description),
            "wheel_combinations": suspension.combinations(results),
        }

    @cached_property
    def _trial_motion(self) -> tuple[TrialMotion | None, str]:
        return trial_motion(self.view.results)


def trial_motion(results: Results) -> tuple[TrialMotion | None, str]:
    """The first held-out moving trial; or none, and why."""
    estimate, dataset = results.estimate, results.dataset
    if dataset is None:
        return None, "the dataset is not in the run folder"
    if estimate is None or not estimate.calibrated or estimate.suspension is None:
        return None, "no suspension was identified"
    entry = next((e for e in dataset.entries("validation") if e.kind != "static"), None)
    if entry is None:
        return None, "no held-out trial moves"
    trial = results.predicted.get(entry.id)
    if trial is None:
        return None, "no predictions are saved; evaluate again"
    if trial.base is None or not trial.base.predicted:
        return None, f"trial {entry.id} has no wrench of a source the suspension was tried with"
    return _of_trial(trial.trial_id, trial.t, trial.base, estimate.suspension), ""


def _of_trial(trial: str, t: np.ndarray, base: prediction.BaseMotion, suspension: Suspension) -> TrialMotion:
    smooth = low_passed(even(t, base.measured), CUTOFF)
    measured = np.where(smooth.valid[:, None], _UNIT * smooth.x, np.nan)
    alone = TrialMotion(trial, smooth.t - t[0], measured, ())
    predicted = []
    for source, at_mocap in base.predicted:
        x = np.stack([np.interp(smooth.t, t, _UNIT * column) for column in at_mocap.T], axis=1)
        whole, middle = (_r2(measured, x, rows) for rows in (alone.scored, alone.middle))
        predicted.append(Predicted(source, x, whole, middle, suspension.moves(source)))
    return replace(alone, predicted=tuple(predicted))


def lines(found: TrialMotion) -> tuple[AxisMotion, ...]:
    """The axes in order."""
    spread, noise, left = found.spread, found.noise, {p.source: found.left(p) for p in found.predicted}
    return tuple(
        AxisMotion(
            AXES[k],
            UNITS[k],
            float(spread[k]),
            float(found.shifted[k]),
            float(noise[k]),
            tuple((*_moved(p, k), float(left[p.source][k])) for p in found.predicted),
        )
        for k in range(6)
    )


def _moved(p: Predicted, k: int) -> tuple[float | None, float | None]:
    return (float(p.r2[k]), float(p.r2_middle[k])) if p.moves[k] else (None, None)


def _r2(measured: np.ndarray, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
    error, motion = (((a)[rows] ** 2).sum(axis=0) for a in (measured - x, measured))
    return np.asarray(1.0 - error / np.maximum(motion, np.finfo(float).tiny))


def drawn(found: TrialMotion) -> Figure:
    """Measured and predicted motion, translation on the left, rotation on the right."""
    with drawing():
        page = figure(10.0, _HEIGHT)
        axes = page.subplots(3, 2, sharex=True)
        page.subplots_adjust(0.06, 0.45 / _HEIGHT, 0.99, 1.0 - 0.45 / _HEIGHT, hspace=0.34)
        for k, (axis, unit) in enumerate(zip(AXES, UNITS, strict=True)):
            ax = axes[k % 3, k // 3]
            lines = [Line(f"predicted from {p.source}", found.t, p.x[:, k], *_LINES[p.source]) for p in found.predicted]
            measured_beside(Line("measured", found.t, found.measured[:, k], "black"), lines, f"{axis} [{unit}]", ax)
            ax.set_title("R2 " + ", ".join(f"{p.source} {_worth(p, k)}" for p in found.predicted), fontweight="normal")
        for ax in axes[2]:
            ax.set_xlabel("time since the start of the trial [s]")
        page.align_ylabels(axes)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        page.legend(handles, labels, loc="upper left", bbox_to_anchor=(0.05, 1.0), ncols=len(labels))
    return page


def _worth(p: Predicted, k: int) -> str:
    return fixed(float(max(p.r2[k], -9.99)), 2) if p.moves[k] else "not predicted"
