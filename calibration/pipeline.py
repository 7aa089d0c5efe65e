"""From recordings to an estimate: the stages, in their order.

    clocks -> registration -> base_frame -> arm_tool -> suspension -> geometry -> wrist_load -> joints

A stage that needs another runs it. Only calibration trials are opened. Spins and drives, where the base moves on
purpose, are for `base_frame` alone; all other stages use the trials in which it stands, geometry and what follows with
the base's markers where `base_frame` has them.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate

from calibration.breakdown import Breakdowns
from calibration.checks.changes import changes, exchanged_sides, wrong_mounts
from calibration.checks.joint_columns import wrong_columns
from calibration.checks.plates import by_scale
from calibration.checks.recordings import judged, listed_twice, unused_plates
from calibration.checks.unexplained import passed, unexplained
from calibration.conclusion import conclusion
from calibration.context import Context, with_postures
from calibration.design.next_motions import drive_next, sweeps_next, swings_next
from calibration.design.next_postures import record_next
from calibration.errors import InputError, NoSuchElement, NotEnoughData
from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.rows import MAIN
from calibration.inference.parameters import scaled, widened
from calibration.mocap.dwells import resting
from calibration.mocap.labels import relabelled_trial
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.options import Options
from calibration.recording.dataset import Dataset
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.bundle.stage import BUNDLE
from calibration.stages.clocks.stage import synchronise
from calibration.stages.frames.arm_tool_stage import ARM_TOOL
from calibration.stages.frames.base_rests import MOVES, read_stations
from calibration.stages.frames.base_stage import BASE_FRAME, with_base_frame
from calibration.stages.geometry.cross_validation import cross_validated
from calibration.stages.geometry.gear_deflection import GEOMETRY
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.registration import REGISTRATION
from calibration.stages.geometry.remounted import remounted
from calibration.stages.joints.correction import JointModels
from calibration.stages.joints.stage import JOINTS
from calibration.stages.stage import Stage, StageInput, StageResult
from calibration.stages.suspension.model import Suspension
from calibration.stages.suspension.stage import SUSPENSION
from calibration.stages.wrist_load import WRIST_LOAD
from calibration.verdict import Verdict

Progress = Callable[[str, float], None]
_STAGES: tuple[Stage, ...] = (REGISTRATION, BASE_FRAME, ARM_TOOL, SUSPENSION, GEOMETRY, WRIST_LOAD, JOINTS, BUNDLE)
STAGES = ("clocks", *(stage.name for stage in _STAGES))
_FRAMES = (BASE_FRAME.name, ARM_TOOL.name)  # run where there is a spin; alone where the arm only ever posed
_LONG = {"bundle": 12.0}  # time of a stage over that of a short one, for its share of the progress [-]
_NO_CLOCKS = (Verdict("clocks", "missing", "posture means only: there is no time, and no clock to estimate"),)


def calibrate(
    dataset: Dataset,
    stages: Sequence[str] | None = None,
    progress: Progress | None = None,
    options: Options | None = None,
    plan_next: bool = False,
    cross_validate: bool = False,
) -> Estimate:
    """Run the stages on the calibration trials.

    Whether the result may be used is in its `status` and `verdicts`.

    Args:
        dataset: The recordings.
        stages: Names of stages; None: all that the dataset was recorded for.
        progress: Called with stage and share done.
        options: What is chosen; None: the defaults.
        plan_next: Whether to search for the experiments that would reduce the uncertainty most.
        cross_validate: Whether to report the hand's error at calibration postures left out in turn, and to deliver the
            row in which it is smallest.

    Raises:
        NoSuchElement: A stage of that name does not exist.
        InputError: There is no calibration trial.
        NotEnoughData: There is none from which the clocks can be estimated.
        NumericalFailure: The numbers of a stage broke down.
    """
    with Breakdowns("reading", progress) as report:
        return _calibrated(dataset, stages, report, options, plan_next, cross_validate)


def _calibrated(
    dataset: Dataset,
    stages: Sequence[str] | None,
    report: Progress,
    options: Options | None,
    plan_next: bool,
    cross_validate: bool,
) -> Estimate:
    wanted = _wanted(_usual(dataset) if stages is None else stages)
    lab = Laboratory(dataset.urdf, dataset.description)
    report("reading", 0.0)
    pairs, means, findings = _read(dataset, lab)
    data = StageInput(
        lab,
        tuple(trial for entry, trial in pairs if entry.kind not in MOVES),
        tuple((entry.kind, trial) for entry, trial in pairs if entry.kind in MOVES),
        options=options or Options(),
    )
    context = Context(data, _empty(dataset, data.options)).with_findings(*findings)
    if context.data.rejected:
        return _explained(context, means).estimate
    report("clocks", 0.1)
    context = _synchronised(context, means)
    if context.data.rejected and not context.data.clocks:
        return context.estimate
    fits = [stage for stage in _STAGES if stage.name in wanted]
    if not fits:
        return context.estimate
    report("postures", 0.15)
    context = replace(context, data=with_postures(context.data, pairs, means))
    parts = list(accumulate((_LONG.get(stage.name, 1.0) for stage in fits), initial=0.0))
    for stage, part in zip(fits, parts[:-1], strict=True):
        report(stage.name, 0.2 + 0.75 * part / parts[-1])
        context = _after(context, stage)
    if context.data.rejected:
        context = _explained(context, means)
    if plan_next:
        report("next experiments", 0.95)
        context = _with_plans(context, wanted)
    estimate = _concluded(context)
    if cross_validate and estimate.calibrated and context.data.postures is not None:
        report("cross-validation", 0.97)
        estimate = _cross_validated(estimate, context.data)
    report("done", 1.0)
    return replace(estimate, verdicts=(*estimate.verdicts, *conclusion(estimate)))


def _usual(dataset: Dataset) -> tuple[str, ...]:
    """The stages a dataset was recorded for."""
    kinds = {entry.kind for entry in dataset.entries("calibration")}
    if "spin" not in kinds:
        return tuple(name for name in STAGES if name not in _FRAMES)
    return STAGES if kinds & {"sweep", "swing"} else ("clocks", REGISTRATION.name, *_FRAMES)


def _wanted(stages: Sequence[str]) -> set[str]:
    wanted = set(stages)
    for name in sorted(wanted):
        if name not in STAGES:
            raise NoSuchElement("stage", name, STAGES)
    return wanted | {stage.needs for stage in _STAGES if stage.name in wanted and stage.needs}


def _read(
    dataset: Dataset, lab: Laboratory
) -> tuple[tuple[tuple[TrialEntry, Trial], ...], tuple[PostureMeans, ...], tuple[Verdict, ...]]:
    """The calibration trials with the dwells in which the hand rests, posture means, and what is wrong with them.

    Raises:
        InputError: There are none.
    """
    entries = [entry for entry in dataset.entries("calibration") if not dataset.has_means(entry)]
    read = tuple(zip(entries, side_by_side(lambda entry: relabelled_trial(dataset, entry), entries), strict=True))
    means = tuple(m for _, m in dataset.means("calibration"))
    if not read and not means:
        raise InputError(
            dataset.folder / "dataset.json",
            "trials: no calibration trial; record static postures and one moving trial with that role",
        )
    twice = (Verdict("reading", "refused", m) for m in listed_twice(dataset.entries("calibration")))
    findings = (*twice, *judged(lab, (*(trial for _, trial in read), *means), calibrated=True))
    return tuple((entry, resting(trial)) for entry, trial in read), means, findings


def _after(context: Context, stage: Stage) -> Context:
    """The context after a stage, with the advice that follows from its covariance."""
    absent = stage.lacks(context.data)
    if absent:
        return context.with_findings(Verdict(stage.name, "missing", f"not estimated: {absent}"))
    if stage is GEOMETRY:  # the suspension, before it, takes the markers as drawn, as its predictions do
        context = replace(context, data=with_base_frame(context.data))
    result = stage.run(context.data)
    context = _advised(context.with_result(result), result)
    return context.with_findings(*_changed(context.data)) if stage is GEOMETRY else context


def _synchronised(context: Context, means: Sequence[PostureMeans]) -> Context:
    """With the clocks, or refused for the columns that hide them.

    Raises:
        NotEnoughData: There is nothing to estimate them from.
    """
    data = context.data
    if not data.trials and not means:
        raise NotEnoughData("in every calibration trial the base moves; record static postures of the arm too")
    try:
        clocks, findings = synchronise(data.lab, data.trials) if data.trials else ((), _NO_CLOCKS)
    except NotEnoughData:
        context = _explained(context, means)
        if context.data.rejected:
            return context
        raise
    if not any(clock.instrument == "plate" for clock in clocks):
        findings = (*findings, *unused_plates(data.lab, data.trials))
    return Context(replace(data, clocks=clocks), replace(context.estimate, clocks=clocks)).with_findings(*findings)


def _explained(context: Context, means: Sequence[PostureMeans]) -> Context:
    """With the joints whose columns are swapped or reversed, where these are why the recordings cannot be used."""
    lab, trials = context.data.lab, context.data.trials
    return context.with_findings(*wrong_columns(lab.description, lab.chain, (*trials, *means)))


def _changed(data: StageInput) -> Iterator[Verdict]:
    """What changed in the course of the trials, by the calibrated geometry."""
    model, robot = data.model("model_2"), data.clock("robot")
    trials = [MeasuredTrial.of(data.lab.description, t) for t in data.trials if len(t.t_robot)]
    if model is None or robot is None or data.rejected or data.lab.description.hand_body.is_point:
        return
    hand = hand_of(model, data.lab.chain, data.lab.nominal_frames)
    yield from wrong_mounts(hand, model, data.lab.description)
    samples = passed(trials, robot)
    if not len(samples.t):
        return
    left = unexplained(hand, model, samples)
    changed = [*changes(left, data.lab.description, [t.id for t in trials])]
    yield from changed or remounted(hand, model, data.static, data.lab.description)
    yield from exchanged_sides(left, data.lab.description)


def _advised(context: Context, result: StageResult) -> Context:
    if isinstance(result.quantity, Suspension):
        return context.with_plan(*swings_next(result.quantity))
    if isinstance(result.quantity, JointModels):
        return context.with_plan(*sweeps_next(result.quantity.models))
    return context


def _with_plans(context: Context, wanted: set[str]) -> Context:
    """With postures, spins and drives that would reduce what is uncertain; a search over experiments."""
    data, lab = context.data, context.data.lab
    if BASE_FRAME.name in wanted:
        stations = read_stations(lab.description, data.moves) if data.moves else None
        context = context.with_plan(*drive_next(lab, stations, data.model(BASE_FRAME.name)))
    model = data.model("model_2")
    if model is not None and data.postures is not None:
        rejected = any(v.verdict == "refused" for v in context.estimate.verdicts if v.stage == GEOMETRY.name)
        found = record_next(lab.urdf, lab.chain, lab.description, data.postures, model, rejected)
        context = context.with_plan(*found)
    return context


def _concluded(context: Context) -> Estimate:
    """Whether the estimate may be used, and by which row; intervals include what its findings say may have moved."""
    estimate = context.estimate
    moved = [direction for v in estimate.verdicts if v.verdict != "refused" for direction in v.moves]
    if moved:
        estimate = replace(estimate, models=tuple(widened(m, by_scale(m, moved)) for m in estimate.models))
    names = [m.name for m in estimate.models]
    rows = (
        MAIN if _bundled(estimate) or not context.data.moving else MAIN[1:]
    )  # joint models go with the geometry of model_2
    main = next((name for name in rows if name in names), names[-1] if names else "")
    usable = bool(names) and not context.data.rejected
    return replace(estimate, main=main, status="calibrated" if usable else "not_calibrated")


def _cross_validated(estimate: Estimate, data: StageInput) -> Estimate:
    """With the errors at postures left out; its main row the best by those, where it can be fitted to postures."""
    row, lab = _refitted(estimate), data.lab
    found = cross_validated(lab.chain, lab.description, data.static, estimate.models, row)
    main = estimate.main if found.best in ("", row) else found.best
    models = tuple(scaled(m, found.excess) if m.name == "full" and m.name == row else m for m in estimate.models)
    return replace(estimate, models=models, verdicts=(*estimate.verdicts, *found.verdicts), main=main)


def _bundled(estimate: Estimate) -> bool:
    """Whether row `full` has drive trains."""
    return estimate.bundle is not None and bool(estimate.bundle.trains)


def _refitted(estimate: Estimate) -> str:
    """Row that is fitted again without postures: drive trains are fitted to whole trials, and not again without one."""
    return "model_2" if _bundled(estimate) else estimate.main


def _empty(dataset: Dataset, options: Options) -> Estimate:
    """An estimate without models."""
    d = dataset.description
    names = RobotNames(d.joint_names, d.base_frame, d.tool_frame)
    return Estimate("not_calibrated", (), (), (), "", dataset.urdf, names, options=options, laboratory=d.alone)
