"""The result of a run in a few lines: whether it is calibrated, its error on unseen motion, of what, and what next.

    e_base^2 = e(row)^2 - e(row, base measured)^2       e_rest^2 = e(row, base measured)^2 - e(floor)^2

e: position RMSE per component [mm]. Shares add up in squares.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from calibration.prediction import BASELINE, NOMINAL
from scenarios.report.results.formatting import error
from scenarios.report.results.ladder import BASES, FLOOR, Step, floor, headline_model, oracle_base, predictive
from scenarios.report.results.result_files import Cause, Row
from scenarios.report.results.run_results import Results

_NBSP = "\N{NO-BREAK SPACE}"
_BASE, _FLOOR = "motion of the base", "floor of the instruments"
_ADVICE = {
    "arm": "record more postures and swings for the joints, chosen by tiago-twin calibrate DATASET --out DIR --next",
    "base": "measure the base while the robot works, or record more motion on the force plate",
}
_STEPS = 3
_WORTH = 0.05  # of the error, below which a gain is no next step [-]


@dataclass(frozen=True)
class Notice:
    """A finding: `level` is `refused`, `missing` or `warning`."""

    level: str
    stage: str
    message: str


@dataclass(frozen=True)
class Share:
    """A cause of the remaining error and its size [mm]."""

    cause: str
    size: float


@dataclass(frozen=True)
class NextStep:
    """What to do, and by how much it lowers the error [mm]; None where that is not known."""

    text: str
    gain: float | None


@dataclass(frozen=True)
class Headline:
    """What a reader needs first.

    Attributes:
        badge: `calibrated`, `not calibrated` or, of an evaluation without estimate, `evaluated`.
        sentence: The error on unseen motion, before and after.
        shares: What it consists of, the largest first; empty without the rows that show it.
        next_steps: At most three, the largest gain first.
        notices: Every finding, the worst first.
    """

    badge: str
    sentence: str
    shares: tuple[Share, ...]
    next_steps: tuple[NextStep, ...]
    notices: tuple[Notice, ...]


def headline(results: Results, steps: Sequence[Step]) -> Headline:
    """The headline of a run from its saved results; `steps` are the rows it is about."""
    found = _notices(results, steps)
    estimate = results.estimate
    if estimate is None:
        badge = "evaluated"
    else:
        useless = any(n.stage == "evaluation" and n.level == "refused" for n in found)
        badge = "calibrated" if estimate.calibrated and not useless else "not calibrated"
    model = headline_model(results, steps)
    best = predictive(steps, model) or oracle_base(steps, model)
    budget = results.evaluation.budget
    shares = tuple(Share(s.cause, s.size_mm) for s in budget.shares if s.size_mm > 0.0) if budget else ()
    coarse = _shares(steps, best) if best else ()
    shares = shares or coarse
    gains = tuple(_from_budget(budget.next_steps, steps, best)) if budget else ()
    refused = tuple(NextStep(f"{n.stage}: {n.message}", None) for n in found if n.level == "refused")
    others = _next_steps(steps, best, found, gains) or tuple(_worth(steps, best, coarse)) or tuple(to_record(found))
    ranked = (*refused, *others)[:_STEPS]
    return Headline(badge, _sentence(steps, best), shares, ranked, found)


def figures(row: Row) -> str:
    """Position and orientation error of a row in words."""
    component, norm = error(row.position_rmse_component_mm), error(row.position_rmse_norm_mm)
    turned = "" if row.orientation_rmse_deg is None else f", {error(row.orientation_rmse_deg)}°"
    return f"{component}{_NBSP}mm per component ({norm}{_NBSP}mm norm){turned}"


def better(ours: Row, theirs: Row) -> bool:
    """Whether a row's error of position is smaller."""
    return ours.position_rmse_norm_mm < theirs.position_rmse_norm_mm


def _sentence(steps: Sequence[Step], best: Step | None) -> str:
    if best is None:
        return "No row predicts from motor encoders; see the ladder."
    nominal = predictive(steps, NOMINAL) or oracle_base(steps, NOMINAL)
    base = BASES.get(best.base, best.base)
    trials = "moving" if best.trials == "dynamic" else best.trials
    text = f"Error of the hand on unseen {trials} trials: {figures(best.main)}"
    if nominal is not None and nominal is not best:
        verb = "instead of" if better(best.main, nominal.main) else "no better than"
        text += f", {verb} {error(nominal.main.position_rmse_component_mm)}{_NBSP}mm with the nominal robot"
    return f"{text}. Row {best.model}, motor encoders, {base}."


def _shares(steps: Sequence[Step], best: Step) -> tuple[Share, ...]:
    whole, given, low = best.main.position_rmse_component_mm, oracle_base(steps, best.model), floor(steps)
    rest = min(whole, given.main.position_rmse_component_mm) if given else whole
    last = min(rest, low.position_rmse_component_mm) if low else 0.0
    arm = "arm: joints and geometry" if low else "arm: joints, geometry and measurement noise"
    found = (
        Share(_BASE, (whole**2 - rest**2) ** 0.5),
        Share(arm, (rest**2 - last**2) ** 0.5),
        Share(_FLOOR, last),
    )
    return tuple(sorted((share for share in found if share.size > 0.0), key=lambda share: -share.size))


def _from_budget(found: Sequence[Cause], steps: Sequence[Step], best: Step | None) -> Iterator[NextStep]:
    """Remedies of the budget; where the base's markers are no better than its prediction, others are needed."""
    given = None if best is None else oracle_base(steps, best.model)
    for share in found:
        worse = share.cause == "base" and given is not None and best is not None and not better(given.main, best.main)
        yield NextStep(share.remedy + (", more exactly than its markers did here" if worse else ""), share.gain_mm)


def _next_steps(
    steps: Sequence[Step], best: Step | None, notices: Sequence[Notice], gains: Sequence[NextStep]
) -> tuple[NextStep, ...]:
    """The budget's, else rows of the same robot that do better, by gain; then what the stages ask to record."""
    found = list(gains or (_gains(steps, best) if best else ()))
    found.sort(key=lambda step: -(step.gain or 0.0))
    asked = [NextStep(f"{n.stage}: {n.message}", None) for n in notices if "record_next" in n.message]
    return (*found, *asked)


def to_record(notices: Sequence[Notice]) -> Iterator[NextStep]:
    """What the stages that had no data ask for."""
    for text in dict.fromkeys(n.message.rpartition("; ")[2] for n in notices if n.level == "missing"):
        if text.startswith("record "):
            stages = ", ".join(n.stage for n in notices if n.message.endswith(f"; {text}"))
            yield NextStep(f"for {stages}: {text}", None)


def _worth(steps: Sequence[Step], best: Step | None, shares: Sequence[Share]) -> Iterator[NextStep]:
    """What more data on each part could gain at most; of the arm only where the floor is known."""
    for share in shares:
        if best is not None and share.cause != _FLOOR and (share.cause == _BASE or floor(steps) is not None):
            whole = best.main.position_rmse_component_mm
            left = (whole**2 - share.size**2) ** 0.5
            advice = _ADVICE["base" if share.cause == _BASE else "arm"]
            yield NextStep(f"{advice} (at best {error(left)}{_NBSP}mm would be left)", whole - left)


def _gains(steps: Sequence[Step], best: Step) -> Iterator[NextStep]:
    rows = [s for s in steps if s.model != FLOOR and better(s.main, best.main)]
    whole = best.main.position_rmse_component_mm
    ways = (
        ("predict with", [s for s in rows if s.kind in ("predictive", best.kind)]),
        ("measure the base while the robot works, with", [s for s in rows if s.kind == "oracle: base" != best.kind]),
        ("read the link-side encoders, with", [s for s in rows if s.kind == "oracle: encoder"]),
    )
    for verb, possible in ways:
        if possible:
            one = min(possible, key=lambda s: s.main.position_rmse_component_mm)
            after = one.main.position_rmse_component_mm
            if whole - after < _WORTH * whole:
                continue
            base = f", {BASES.get(one.base, one.base)}" if one.base != "measured" else ""
            text = f"{verb} {one.model}{base}: {error(after)}{_NBSP}mm instead of {error(whole)}{_NBSP}mm"
            yield NextStep(text, whole - after)


def _notices(results: Results, steps: Sequence[Step]) -> tuple[Notice, ...]:
    found = (*(results.estimate.verdicts if results.estimate else ()), *results.evaluation.verdicts)
    notices = [Notice(v.verdict, v.stage, v.message) for v in found if v.verdict != "ok"]
    notices += _no_gain(steps, headline_model(results, steps))
    return tuple(sorted(notices, key=lambda notice: ("refused", "warning", "missing").index(notice.level)))


def _no_gain(steps: Sequence[Step], model: str) -> Iterator[Notice]:
    best, baseline = (predictive(steps, m) or oracle_base(steps, m) for m in (model, BASELINE))
    if best is None or baseline is None or best is baseline or model == "arm_tool":
        return  # arm_tool and registration place the same hand; they differ in what they call its frames
    if not better(best.main, baseline.main):
        message = f"{model} predicts no better than fitting the marker frames alone; do not use its geometry"
        yield Notice("refused", "evaluation", message)
