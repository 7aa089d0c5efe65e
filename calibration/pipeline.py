"""From recordings to an estimate: the stages, in their order.

    clocks -> registration -> base_frame -> arm_tool -> suspension -> geometry -> joints

A stage that needs another runs it. Only calibration trials are opened. Spins and drives, where the base moves on
purpose, are for `base_frame` alone; all other stages see the trials in which it stands.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from calibration.checks.recordings import implausible_inputs
from calibration.context import Work, postures_of, with_postures
from calibration.design.next_motions import drive_next, sweeps_next, swings_next
from calibration.design.next_postures import record_next
from calibration.errors import InputError, NoSuchElement, NotEnoughData
from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.rows import MAIN
from calibration.inference.parameters import Model
from calibration.mocap.labels import relabelled_trials
from calibration.options import Options
from calibration.recording.dataset import Dataset
from calibration.robot.chain import chain_of
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.clocks.stage import synchronise
from calibration.stages.frames.arm_tool_stage import locate_arm
from calibration.stages.frames.base_rests import MOVES, read_stations
from calibration.stages.frames.base_stage import locate_base
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.model_of_fit import hand_of
from calibration.stages.geometry.registration import register
from calibration.stages.geometry.stage import calibrate_geometry
from calibration.stages.joints.stage import fit_joint_models, joints_model
from calibration.stages.suspension.stage import Form, fit_suspension, suspension_model
from calibration.stages.wrist_load import weighed
from calibration.verdict import Verdict

Progress = Callable[[str, float], None]
STAGES = ("clocks", "registration", "base_frame", "arm_tool", "suspension", "geometry", "joints")
_FRAMES = ("base_frame", "arm_tool")  # run where there is a spin; alone where the arm only ever posed
_NEEDS = {"joints": "geometry", "arm_tool": "base_frame"}
_NO_CLOCKS = (Verdict("clocks", "missing", "posture means only: there is no time, and no clock to tell"),)


def calibrate(
    dataset: Dataset,
    stages: Sequence[str] | None = None,
    progress: Progress | None = None,
    options: Options | None = None,
) -> Estimate:
    """Run the stages (all the data are for, where none is named) on the calibration trials, as the options say.

    The result says itself whether it may be used: `status` and `verdicts`.

    Raises:
        NoSuchElement: A stage of that name does not exist.
        InputError: There is no calibration trial.
        NotEnoughData: There is none from which the clocks can be told.
    """
    wanted = _wanted(_usual(dataset) if stages is None else stages)
    tell = progress or (lambda stage, share: None)
    chain = chain_of(dataset.urdf, dataset.description)
    tell("reading", 0.0)
    pairs, means = tuple(relabelled_trials(dataset, "calibration")), tuple(m for _, m in dataset.means("calibration"))
    trials = tuple(trial for _, trial in pairs)
    if not trials and not means:
        raise InputError(
            dataset.folder / "dataset.json",
            "trials: no calibration trial; record static postures and one moving trial with that role",
        )
    empty = _empty(dataset, options or Options())
    refused = [
        Verdict("reading", "refused", m) for m in implausible_inputs(dataset.description, chain, (*trials, *means))
    ]
    if refused:
        return replace(empty, verdicts=tuple(refused))
    tell("clocks", 0.2)
    standing = tuple((entry, trial) for entry, trial in pairs if entry.kind not in MOVES)
    if not standing and not means:
        raise NotEnoughData("in every calibration trial the base moves; record static postures of the arm too")
    trials = tuple(trial for _, trial in standing)
    clocks, said = synchronise(dataset.urdf, dataset.description, trials) if trials else ((), _NO_CLOCKS)
    estimate = replace(empty, verdicts=tuple(said), clocks=clocks)
    fits = [name for name in STAGES[1:] if name in wanted]
    if not fits:
        return estimate
    tell("postures", 0.5)
    work = with_postures(Work(dataset, chain, trials, clocks, None, None, estimate), standing, means)
    for k, name in enumerate(fits):
        tell(name, 0.55 + 0.45 * k / len(fits))
        absent = lacking(work, name)
        work = work.saying(Verdict(name, "missing", absent)) if absent else _RUN[name](work)
    tell("done", 1.0)
    return _concluded(work)


def _usual(dataset: Dataset) -> tuple[str, ...]:
    """The stages a dataset was recorded for."""
    kinds = {entry.kind for entry in dataset.entries("calibration")}
    if "spin" not in kinds:
        return tuple(name for name in STAGES if name not in _FRAMES)
    return STAGES if kinds & {"sweep", "swing"} else ("clocks", "registration", *_FRAMES)


def _wanted(stages: Sequence[str]) -> set[str]:
    wanted = set(stages)
    for name in sorted(wanted):
        if name not in STAGES:
            raise NoSuchElement("stage", name, STAGES)
    return wanted | {_NEEDS[name] for name in wanted & _NEEDS.keys()}


def _register(work: Work) -> Work:
    postures = postures_of(work)
    data = postures if work.passing is None else postures.joined(work.passing)
    return work.with_model(*register(work.chain, work.description, data))


def _locate_base(work: Work) -> Work:
    moves = [(entry.kind, trial) for entry, trial in relabelled_trials(work.dataset, "calibration", *MOVES)]
    if not moves:
        work = work.saying(Verdict("base_frame", "missing", "no trial of kind spin: T_base_B stays as drawn"))
        return work.suggesting(*drive_next(work.chain, work.description, None, None))
    stations = read_stations(work.description, moves)
    model, said = locate_base(work.chain, work.description, stations)
    work = work.saying(*said) if model is None else work.with_model(model, said)
    return work.suggesting(*drive_next(work.chain, work.description, stations, model))


def _locate_arm(work: Work) -> Work:
    base_frame = next((m for m in work.estimate.models if m.name == "base_frame"), None)
    return work.with_model(*locate_arm(work.chain, work.description, postures_of(work), base_frame))


def _suspend(work: Work) -> Work:
    form = Form(full=work.estimate.options.suspension == "full")
    robot, plate = work.clock("robot"), work.clock("plate")
    found, said = fit_suspension(work.dataset.urdf, work.description, work.trials, robot, plate, form=form)
    if found is None:
        return work.saying(*said)
    return work.with_model(suspension_model(found), said, suspension=found).suggesting(*swings_next(found))


def _calibrate_geometry(work: Work) -> Work:
    chain, description, postures = work.chain, work.description, postures_of(work)
    model, said = calibrate_geometry(chain, description, postures)
    refused = any(v.verdict == "refused" for v in said)
    suggested = record_next(work.dataset.urdf, chain, description, postures, model, refused)
    work = work.with_model(model, said).suggesting(*suggested)
    work = work.saying(*_weighed(work, model))
    if refused:
        return work
    soft, more = calibrate_gears(chain, description, postures)
    wrong = [v.message for v in more if v.verdict == "refused"]
    if wrong and _moving(work.dataset):
        return work.saying(Verdict("geometry", "warning", f"no row `full`: {'; '.join(wrong)}"))
    return work.with_model(soft, [v for v in more if v not in said])


def _moving(dataset: Dataset) -> bool:
    return any(entry.kind in ("sweep", "swing") for entry in dataset.entries("calibration"))


def _weighed(work: Work, model: Model) -> tuple[Verdict, ...]:
    """What hangs on the wrist's sensor in the trials with the declared payload."""
    declared = {entry.id for entry in work.dataset.entries("calibration") if entry.payload is None}
    trials = [trial for trial in work.trials if trial.id in declared]
    hand = hand_of(model, work.chain, nominal_frames(work.chain, work.description))
    return weighed(work.dataset.urdf, work.description, trials, work.clock("robot"), hand, postures_of(work))


def _calibrate_joints(work: Work) -> Work:
    if any(v.verdict == "refused" for v in work.estimate.verdicts):
        return work
    geometry = work.estimate.model("model_2")
    hand = hand_of(geometry, work.chain, nominal_frames(work.chain, work.description))
    robot = work.clock("robot")
    if robot is None:
        raise NotEnoughData("no robot clock")
    found, said = fit_joint_models(
        work.dataset.urdf, work.description, work.trials, robot, hand, work.estimate.options.terms
    )
    model = joints_model(geometry, found.models)
    grown = replace(
        work.estimate,
        models=(*work.estimate.models, model),
        verdicts=(*work.estimate.verdicts, *said),
        joint_models=found.models,
        link_zero=tuple(map(float, found.zero)),
    )
    if not found.models:
        return work.saying(*said)
    return replace(work, estimate=grown).suggesting(*sweeps_next(found.models))


_RUN: dict[str, Callable[[Work], Work]] = {
    "registration": _register,
    "base_frame": _locate_base,
    "arm_tool": _locate_arm,
    "suspension": _suspend,
    "geometry": _calibrate_geometry,
    "joints": _calibrate_joints,
}


def _concluded(work: Work) -> Estimate:
    """Whether it may be used, and by which row."""
    estimate = work.estimate
    names = [m.name for m in estimate.models]
    rows = MAIN[1:] if _moving(work.dataset) else MAIN  # joint models go with the geometry they were fitted beside
    main = next((name for name in rows if name in names), names[-1] if names else "")
    usable = bool(names) and all(v.verdict != "refused" for v in estimate.verdicts)
    return replace(estimate, main=main, status="calibrated" if usable else "not_calibrated")


def _empty(dataset: Dataset, options: Options) -> Estimate:
    """Nothing to be used so far."""
    d = dataset.description
    names = RobotNames(d.joint_names, d.base_frame, d.tool_frame)
    return Estimate("not_calibrated", (), (), (), "", dataset.urdf, names, options=options, laboratory=d.alone)


def lacking(work: Work, stage: str) -> str:
    """What a stage would need that the dataset does not have; empty where it has it."""
    if stage == "base_frame":
        return ""
    if stage == "suspension":
        return "" if work.trials else "no suspension: posture means show no motion; record base and plate continuously"
    if work.postures is None:
        return f"no {stage}: it takes joint readings with base and hand markers in static postures"
    if stage == "joints" and work.clock("robot") is None:
        return "no joint models: posture means have no link encoders; record motor and link readings continuously"
    return ""
