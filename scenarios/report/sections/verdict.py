"""The verdict of a run in plain sentences, and what has to be known before its figures are used."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from calibration.prediction import BASELINE, NOMINAL
from scenarios.report.results.formatting import count, error, significant
from scenarios.report.results.ladder import BASES, Step, floor, headline_model, oracle_base, predictive
from scenarios.report.results.result_files import Row
from scenarios.report.results.run_results import Results

CLAIM = (
    "All figures are of a synthetic twin. They are predictive unless a row says oracle, and no bias is removed. The "
    "published ones (Nguyen et al. 2024) are of a real robot, evaluated by public code with the measured base, link "
    "encoders, and constants removed per axis. The two must not stand side by side without these sentences."
)
CLAIM_REAL = (
    "No truth is known here: errors are against the motion capture, whose own noise counts. They are predictive unless "
    "a row says oracle, and no bias is removed. The published figures (Nguyen et al. 2024) were evaluated by public "
    "code with the measured base, link encoders, and constants removed per axis."
)
_NBSP = "\N{NO-BREAK SPACE}"
_MIN_COVERAGE = 0.85  # [-] below which 95 % intervals are called too narrow
CONVENTIONS = (
    "Per component is the square root of the mean of all squared components, as published; norm is the root mean "
    "square distance, √3 times larger. Orientation is the angle of the rotation between predicted and measured hand."
)


@dataclass(frozen=True)
class Change:
    """One figure before and after calibration."""

    name: str
    unit: str
    before: str
    after: str


@dataclass(frozen=True)
class Notice:
    """Something to know: `level` is `refused`, `missing` or `warning`."""

    level: str
    stage: str
    message: str


def changes(before: Row, after: Row) -> tuple[Change, ...]:
    """The main figures, nominal and calibrated."""
    figures = (
        ("position, per component", "mm", "position_rmse_component_mm"),
        ("position, norm", "mm", "position_rmse_norm_mm"),
        ("orientation", "°", "orientation_rmse_deg"),
    )
    return tuple(Change(n, u, error(getattr(before, f)), error(getattr(after, f))) for n, u, f in figures)


def sentences(results: Results, steps: Sequence[Step]) -> Iterator[str]:
    """The verdict: what calibration brought, what is left, and against what it holds."""
    model = headline_model(results, steps)
    nominal, best = predictive(steps, NOMINAL), predictive(steps, model)
    if best is None or best.mocap is None:
        yield "No row predicts from motor encoders alone; see the ladder."
        return
    how = f"On held-out {best.trials} trials, motor encoders and the {BASES.get(best.base, best.base)},"
    n = f"over {count(best.mocap.n)} poses"
    if nominal is None or nominal.mocap is None or nominal is best:
        yield f"{how} {model} predicts the hand to {_figures(best.mocap)} RMSE {n}."
    else:
        gain = "down from" if _better(best.mocap, nominal.mocap) else "no better than"
        ours, theirs = _figures(best.mocap), _figures(nominal.mocap)
        yield f"{how} {model} predicts the hand to {ours} RMSE, {gain} {theirs} with the nominal robot, {n}."
    yield from _compared(steps, model, best.mocap)
    yield from _against_truth(steps, best)


def _compared(steps: Sequence[Step], model: str, best: Row) -> Iterator[str]:
    baseline, oracle = predictive(steps, BASELINE), oracle_base(steps, model)
    if baseline is not None and baseline.mocap is not None and model != BASELINE:
        verb = "leaves" if _better(best, baseline.mocap) else "does as well:"
        yield f"Fitting the marker frames alone (registration) {verb} {_figures(baseline.mocap)}."
    if oracle is not None and oracle.mocap is not None:
        yield f"Given the measured base as well (an oracle), {model} reaches {_figures(oracle.mocap)}."


def _against_truth(steps: Sequence[Step], best: Step) -> Iterator[str]:
    lowest = floor(steps)
    if best.truth is None:
        return
    skill = "" if best.truth.skill is None else f", skill {significant(best.truth.skill, 2)}"
    under = "" if lowest is None else f"; the floor is {_figures(lowest)}"
    yield f"Against the true hand pose {best.model} is off by {_figures(best.truth)}{skill}{under}."


def notices(results: Results, steps: Sequence[Step], covered: tuple[int, int]) -> tuple[Notice, ...]:
    """What has to be known before the figures are used, the worst first.

    Args:
        results: The run.
        steps: Its ladder.
        covered: How many 95 % intervals hold the truth, and of how many; (0, 0) where no truth is known.
    """
    found = (*(results.estimate.verdicts if results.estimate else ()), *results.evaluation.verdicts)
    said = [Notice(v.verdict, v.stage, v.message) for v in found if v.verdict != "ok"]
    said += [*_no_gain(steps, headline_model(results, steps)), *_too_narrow(*covered)]
    return tuple(sorted(said, key=lambda notice: ("refused", "missing", "warning").index(notice.level)))


def _no_gain(steps: Sequence[Step], model: str) -> Iterator[Notice]:
    best, baseline = predictive(steps, model), predictive(steps, BASELINE)
    if best is None or baseline is None or best is baseline or model == "arm_tool":
        return  # arm_tool and registration place the same hand; they differ in what they call its frames
    if best.mocap is not None and baseline.mocap is not None and not _better(best.mocap, baseline.mocap):
        message = f"{model} predicts no better than fitting the marker frames alone; do not use its geometry."
        yield Notice("warning", "evaluation", message)


def _too_narrow(held: int, judged: int) -> Iterator[Notice]:
    if held < _MIN_COVERAGE * judged:
        message = (
            f"the 95 % intervals are too narrow, {held} of {judged} hold the truth: the robot does what the model "
            "leaves out, and the sigmas do not know that. Trust the predictions, whose error is measured, more than "
            "single parameters."
        )
        yield Notice("warning", "uncertainty", message)


def _better(ours: Row, theirs: Row) -> bool:
    return ours.position_rmse_norm_mm < theirs.position_rmse_norm_mm


def _figures(row: Row) -> str:
    component, norm = error(row.position_rmse_component_mm), error(row.position_rmse_norm_mm)
    turned = "" if row.orientation_rmse_deg is None else f" and {error(row.orientation_rmse_deg)}°"
    return f"{component}{_NBSP}mm per component ({norm}{_NBSP}mm norm){turned}"
