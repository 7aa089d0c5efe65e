"""The discrepancy of each arm joint on held-out moving trials, and what its model says of the same samples.

Trials with a payload of their own or a push are left out where there are others: one load, one picture.

y = q_motor - q_link - zero [mrad]  against  theta [rad], while |dq| > 0.02 rad/s; forth dq > 0, back dq < 0
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.errors import NotEnoughData
from calibration.prediction.predictor import predictor
from calibration.recording import Trial
from calibration.stages.joints import JointModel, JointModels, Samples, pooled, samples_of
from scenarios.plots import BACK, FORTH, Flank, drawing, figure, hysteresis
from scenarios.report.results.formatting import fixed
from scenarios.report.results.run_results import Results
from scenarios.report.sections.payload import PUSH

_MOVING = 0.02  # [rad/s]
_COLUMNS = 4
_HEIGHT = 2.0  # [inch] of a panel


@dataclass(frozen=True)
class Loop:
    """One joint; all (n,).

    Attributes:
        joint: Its name.
        corrected: Whether the estimate corrects it.
        t: [s].
        theta: [rad].
        velocity: [rad/s].
        measured: Motor minus link reading, the zero removed [mrad].
        model: Predicted [mrad].
    """

    joint: str
    corrected: bool
    t: np.ndarray
    theta: np.ndarray
    velocity: np.ndarray
    measured: np.ndarray
    model: np.ndarray

    @property
    def before(self) -> float:
        """Rms of the discrepancy [mrad]."""
        return float(np.sqrt((self.measured**2).mean()))

    @property
    def after(self) -> float:
        """Rms of what the model leaves [mrad]."""
        return float(np.sqrt(((self.measured - self.model) ** 2).mean()))

    @property
    def flanks(self) -> tuple[Flank, ...]:
        """Forth and back."""
        up = self.velocity > 0.0
        ways = (("angle growing", FORTH, up), ("angle falling", BACK, ~up))
        return tuple(
            Flank(label, colour, self.t[k], self.theta[k], self.measured[k], self.model[k] if self.corrected else None)
            for label, colour, k in ways
        )


def loops(results: Results) -> tuple[tuple[Loop, ...], str]:
    """A loop for each joint with both encoders; or none, and why."""
    estimate, dataset = results.estimate, results.dataset
    if dataset is None:
        return (), "the dataset is not in the run folder"
    if not any("link" in joint.encoders for joint in dataset.description.joints):
        return (), "no joint has a link-side encoder"
    if estimate is None or not estimate.calibrated or not estimate.joint_models:
        return (), "no joint model was identified"
    moving = [e for e in dataset.entries("validation") if e.kind != "static"]
    entries = [e for e in moving if e.payload is None and PUSH not in e.motion] or moving
    if not entries:
        return (), "no held-out trial moves"
    joints = predictor(estimate, dataset).joints
    if joints is None:
        return (), "no joint model was identified"
    try:
        return tuple(_loops(joints, [dataset.read(e) for e in entries])), ""
    except NotEnoughData as error:
        return (), str(error)


def _loops(joints: JointModels, trials: Sequence[Trial]) -> Iterator[Loop]:
    of_trials = [samples_of(joints.of_trial(t.id).inputs, t, joints.zero) for t in trials]
    for joint, column in zip(joints.inputs.measured, zip(*of_trials, strict=True), strict=True):
        model = next((m for m in joints.models if m.joint == joint), None)
        moving = [s.part(np.abs(s.velocity) > _MOVING) for s in column if s is not None]
        if model is not None and any(map(len, moving)):
            yield _loop(model, pooled(moving))


def _loop(model: JointModel, s: Samples) -> Loop:
    predicted = model.discrepancy(s.theta, s.tau, s.velocity)
    return Loop(model.joint, model.degree is not None, s.t, s.theta, s.velocity, 1e3 * s.y, 1e3 * predicted)


def drawn(found: Sequence[Loop]) -> Figure | None:
    """A panel for each joint; the legend stands where a panel is left over, or above."""
    if not found:
        return None
    rows = -(-(len(found) + 1) // _COLUMNS)
    with drawing():
        page = figure(10.0, rows * _HEIGHT + 0.1)
        axes = page.subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
        page.subplots_adjust(0.055, 0.42 / (rows * _HEIGHT), 0.995, 1.0 - 0.22 / (rows * _HEIGHT), 0.26, 0.46)
        for loop, ax in zip(found, axes, strict=False):
            hysteresis(loop.flanks, ax).set_title(_title(loop), fontweight="normal")
            ax.set_xlabel("position [rad]")
        for ax in axes[::_COLUMNS]:
            ax.set_ylabel("motor − link [mrad]")
        for ax in axes[len(found) :]:
            ax.set_axis_off()
        _legend(axes[: len(found)], axes[len(found)])
    return page


def _title(loop: Loop) -> str:
    after = f"→ {fixed(loop.after, 1)} mrad" if loop.corrected else "mrad, not corrected"
    return f"{loop.joint.removesuffix('_joint')}: {fixed(loop.before, 1)} {after}"


def _legend(panels: Sequence[Axes], ax: Axes) -> None:
    """One entry for each kind of artist that is drawn in any panel, dots as strong as they look in a crowd."""
    entries = {label: h for panel in panels for h, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    drawn = ax.legend(entries.values(), entries.keys(), loc="center left", bbox_to_anchor=(0.0, 0.5), markerscale=2.0)
    for handle in drawn.legend_handles:
        if handle is not None:
            handle.set_alpha(1.0)
