"""Motor minus link reading of each arm joint on held-out moving trials, and what its models predict.

Trials with a payload of their own or a push are left out where there are others: one load, one picture.

y = q_motor - q_link - zero [mrad]  against  theta [rad], while |dq| > 0.02 rad/s; forth dq > 0, back dq < 0
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.prediction import JointSamples
from calibration.stages.joints import JointModel, limit_of
from scenarios.plots.hysteresis import BACK, FORTH, Flank, hysteresis
from scenarios.plots.style import drawing, figure
from scenarios.report.results.formatting import error, fixed, significant
from scenarios.report.results.result_files import Regime
from scenarios.report.results.run_results import Results
from scenarios.report.results.section import Drawn, RunView
from scenarios.report.results.traces import PUSH

REGIMES = {
    "repetition": "The same motions again, settled, by models fitted to other repetitions",
    "start_stop": "Starts and stops of those motions",
    "unseen_motion": "Other motions, held out",
    "static": "Static postures, held out",
}
_HELPS = 10.0  # [%] of the RMS
_DIAGRAM = Path(__file__).parents[1] / "joint_chain.svg"
_MOVING = 0.02  # [rad/s]
_SAMPLED = ("t", "theta", "velocity", "discrepancy", "predicted", "train", "low", "high")
_COLUMNS = 4
_HEIGHT = 2.0  # [inch] of a panel


@dataclass(frozen=True)
class Loop:
    """One joint; all (n,).

    Attributes:
        joint: Its name.
        corrected: Whether the estimate's printed model corrects it.
        t: [s].
        theta: [rad].
        velocity: [rad/s].
        measured: Motor minus link reading, the zero removed [mrad].
        printed: Predicted by the printed model [mrad].
        train: By the drive train; NaN without one.
        low: On the lower flank of its gap.
        high: On the upper one.
    """

    joint: str
    corrected: bool
    t: np.ndarray
    theta: np.ndarray
    velocity: np.ndarray
    measured: np.ndarray
    printed: np.ndarray
    train: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def geared(self) -> bool:
        """Whether its drive train was identified."""
        return bool(np.isfinite(self.train).all())

    @property
    def model(self) -> np.ndarray | None:
        """What is drawn [mrad]: by the drive train, else by the printed model; None where nothing corrects it."""
        return self.train if self.geared else self.printed if self.corrected else None

    @property
    def before(self) -> float:
        """Rms of the discrepancy [mrad]."""
        return _rms(self.measured)

    @property
    def after(self) -> float:
        """Rms of what the drawn model leaves [mrad]."""
        return self.before if self.model is None else _rms(self.measured - self.model)

    @property
    def after_printed(self) -> float:
        """Rms of what the printed model leaves [mrad]."""
        return _rms(self.measured - self.printed)

    @property
    def gap(self) -> float:
        """Distance of the flanks [mrad]."""
        return float((self.high - self.low).mean())

    @property
    def flanks(self) -> tuple[Flank, ...]:
        """Forth and back."""
        up, model = self.velocity > 0.0, self.model
        ways = (("angle growing", FORTH, up), ("angle falling", BACK, ~up))
        return tuple(
            Flank(label, colour, self.t[k], self.theta[k], self.measured[k], None if model is None else model[k])
            for label, colour, k in ways
        )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt((x**2).mean()))


@dataclass(frozen=True)
class JointLine:
    """What the joint model of one joint is: degree (none: no correction), rho [s/rad], R2, discrepancy rms [mrad].

    `rho` is marked where the search for it ended at a limit.
    """

    joint: str
    degree: str
    rho: str
    rms: float
    r2: float
    r2_out: float


@dataclass(frozen=True)
class RegimeRows:
    """One regime: what it is, its rows by joint, and where the model helps in a sentence."""

    meaning: str
    rows: tuple[Regime, ...]
    sentence: str


@dataclass(frozen=True)
class Joints:
    """The drive chain, measured and modelled hysteresis, the models and where they help."""

    view: RunView
    title: ClassVar[str] = "Joints: backlash, compliance, hysteresis"
    template: ClassVar[str] = "joints.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """The diagram, and the loops of every joint."""
        return {"joint": _DIAGRAM, "loops": drawn(self._loops[0])}

    def context(self) -> Mapping[str, Any]:
        """Loops or why there are none, models, regimes."""
        found, why = self._loops
        return {
            "loops": found,
            "why_no_loops": why,
            "joint_lines": joint_lines(self.view.results),
            "regimes": by_regime(self.view.results.evaluation.regimes),
        }

    @cached_property
    def _loops(self) -> tuple[tuple[Loop, ...], str]:
        return loops(self.view.results)


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
    corrected = {model.joint: model.degree is not None for model in estimate.joint_models}
    found = [joint for e in entries if e.id in results.predicted for joint in results.predicted[e.id].joints]
    return tuple(_loops(found, corrected)), "" if found else "no predictions are saved; evaluate again"


def _loops(found: Sequence[JointSamples], corrected: Mapping[str, bool]) -> Iterator[Loop]:
    """A joint's samples of all trials, while it moves."""
    for joint, corrects in corrected.items():
        rows = [np.stack([getattr(s, name) for name in _SAMPLED]) for s in found if s.joint == joint]
        both = np.concatenate(rows, axis=1) if rows else np.zeros((len(_SAMPLED), 0))
        t, theta, velocity, *readings = both[:, np.abs(both[2]) > _MOVING]
        if len(t):
            yield Loop(joint, corrects, t, theta, velocity, *(1e3 * x for x in readings))


def drawn(found: Sequence[Loop]) -> Figure | None:
    """A panel for each joint; the legend is where a panel is left over, or above."""
    if not found:
        return None
    rows = -(-(len(found) + 1) // _COLUMNS)
    with drawing():
        page = figure(10.0, rows * _HEIGHT + 0.1)
        axes = page.subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
        page.subplots_adjust(0.055, 0.42 / (rows * _HEIGHT), 0.995, 1.0 - 0.22 / (rows * _HEIGHT), 0.26, 0.46)
        for loop, ax in zip(found, axes, strict=False):
            edges = (loop.t, loop.theta, loop.low, loop.high) if loop.geared else ()
            hysteresis(loop.flanks, ax, edges).set_title(_title(loop), fontweight="normal")
            ax.set_xlabel("position [rad]")
        for ax in axes[::_COLUMNS]:
            ax.set_ylabel("motor − link [mrad]")
        for ax in axes[len(found) :]:
            ax.set_axis_off()
        _legend(axes[: len(found)], axes[len(found)])
    return page


def _title(loop: Loop) -> str:
    after = "mrad, not corrected" if loop.model is None else f"→ {error(loop.after)} mrad"
    return f"{loop.joint.removesuffix('_joint')}: {error(loop.before)} {after}"


def _legend(panels: Sequence[Axes], ax: Axes) -> None:
    """One entry for each kind of artist that is drawn in any panel, dots as strong as they look in a crowd."""
    entries = {label: h for panel in panels for h, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    drawn = ax.legend(entries.values(), entries.keys(), loc="center left", bbox_to_anchor=(0.0, 0.5), markerscale=2.0)
    for handle in drawn.legend_handles:
        if handle is not None:
            handle.set_alpha(1.0)


def joint_lines(results: Results) -> tuple[JointLine, ...]:
    """The joint models of an estimate."""
    models = results.estimate.joint_models if results.estimate else ()
    return tuple(
        JointLine(
            m.joint,
            "none" if m.degree is None else str(m.degree),
            _rho(m),
            1e3 * m.quality.rms,
            m.quality.r2,
            m.quality.r2_out,
        )
        for m in models
    )


def _rho(model: JointModel) -> str:
    if model.degree is None:
        return fixed(None, 0)
    at = {"lowest": "≤ ", "highest": "≥ ", None: ""}[limit_of(model.rho)]
    return at + significant(model.rho)


def by_regime(regimes: Sequence[Regime]) -> tuple[RegimeRows, ...]:
    """The regimes there are, the model's own first; others than ours by their name."""
    names = dict.fromkeys((*REGIMES, *(r.regime for r in regimes)))
    groups = ((REGIMES.get(name, name), tuple(r for r in regimes if r.regime == name)) for name in names)
    return tuple(RegimeRows(meaning, rows, _sentence(meaning, rows)) for meaning, rows in groups if rows)


def _sentence(meaning: str, rows: Sequence[Regime]) -> str:
    cuts = [r.cut_percent for r in rows if r.cut_percent >= _HELPS]
    harmed, as_it_was, hardly = (
        ", ".join(r.joint.removesuffix("_joint") for r in rows if chosen(r))
        for chosen in (
            lambda r: r.cut_percent < 0.0,
            lambda r: r.cut_percent == 0.0,
            lambda r: 0.0 < r.cut_percent < _HELPS,
        )
    )
    text = f"{meaning}: the rms falls by 10 % or more in {len(cuts)} of {len(rows)} joints"
    if cuts:
        text += f" (by {min(cuts):.0f} to {max(cuts):.0f} %)" if len(cuts) > 1 else f" (by {cuts[0]:.0f} %)"
    text += f", by less in {hardly}" if hardly else ""
    text += f", grows in {harmed}" if harmed else ""
    return text + (f", is unchanged in {as_it_was}." if as_it_was else ".")
