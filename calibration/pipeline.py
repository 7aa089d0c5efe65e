"""From recordings to an estimate: the stages, in their order.

    clocks -> registration -> suspension -> geometry -> joints

A stage that needs another runs it. Only calibration trials are opened.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from calibration.clock import Clock
from calibration.clocks import synchronise
from calibration.dataset import Dataset
from calibration.errors import InputError, NoSuchElement
from calibration.estimate import Estimate, Model, RobotNames
from calibration.estimate_parts import joints_model, suspension_model
from calibration.geometry import calibrate_geometry
from calibration.joint_fit import fit_joint_models
from calibration.options import Options
from calibration.parameters import nominal_frames
from calibration.plausibility import implausible_inputs
from calibration.postures import Postures, read_passing, read_postures
from calibration.recording import Trial
from calibration.registration import register
from calibration.robot import Chain, chain_of
from calibration.schema import Description
from calibration.suspension_fit import Form, fit_suspension
from calibration.verdict import Verdict

Progress = Callable[[str, float], None]

STAGES = ("clocks", "registration", "suspension", "geometry", "joints")
MAIN = ("model_2", "registration")  # rows an estimate can stand for, the best first
_NEEDS = {"joints": "geometry"}
_SPACING = 0.5  # [s] of the swings' postures the registration sees beside the static ones


@dataclass(frozen=True)
class Work:
    """What the stages have in common, and what they have found so far.

    Attributes:
        dataset: The recordings.
        chain: The nominal chain.
        trials: All calibration trials.
        clocks: Of the instruments, the robot's first.
        postures: The static ones.
        passing: Those of the swings, None where there is no swing.
        estimate: So far.
    """

    dataset: Dataset
    chain: Chain
    trials: tuple[Trial, ...]
    clocks: tuple[Clock, ...]
    postures: Postures
    passing: Postures | None
    estimate: Estimate

    @property
    def description(self) -> Description:
        """Of the dataset."""
        return self.dataset.description

    def with_model(self, model: Model, said: Sequence[Verdict], **parts: object) -> "Work":
        """With one more model."""
        e = self.estimate
        grown = replace(e, models=(*e.models, model.with_clocks(self.clocks)), verdicts=(*e.verdicts, *said), **parts)  # type: ignore[arg-type]
        return replace(self, estimate=grown)


def calibrate(
    dataset: Dataset,
    stages: Sequence[str] | None = None,
    progress: Progress | None = None,
    options: Options | None = None,
) -> Estimate:
    """Run the stages (all where none is named) on the calibration trials of a dataset, as the options say.

    The result says itself whether it may be used: `status` and `verdicts`.

    Raises:
        NoSuchElement: A stage of that name does not exist.
        InputError: There is no calibration trial.
        NotEnoughData: There is none from which the clocks can be told.
    """
    wanted = _wanted(stages)
    tell = progress or (lambda stage, share: None)
    chain = chain_of(dataset.urdf, dataset.description)
    tell("reading", 0.0)
    trials = tuple(trial for _, trial in dataset.trials("calibration"))
    if not trials:
        raise InputError(
            dataset.folder / "dataset.json",
            "trials: no calibration trial; record static postures and one moving trial with that role",
        )
    empty = _empty(dataset, options or Options())
    refused = [Verdict("reading", "refused", m) for m in implausible_inputs(dataset.description, chain, trials)]
    if refused:
        return replace(empty, verdicts=tuple(refused))
    tell("clocks", 0.2)
    clocks, said = synchronise(dataset.urdf, dataset.description, trials)
    estimate = replace(empty, verdicts=tuple(said), clocks=clocks)
    fits = [name for name in STAGES[1:] if name in wanted]
    if not fits:
        return estimate
    tell("postures", 0.5)
    postures = read_postures(dataset.description, trials, clocks[0])
    work = Work(dataset, chain, trials, clocks, postures, _passing(dataset, trials, clocks[0]), estimate)
    for k, name in enumerate(fits):
        tell(name, 0.55 + 0.45 * k / len(fits))
        work = _RUN[name](work)
    tell("done", 1.0)
    return _concluded(work.estimate)


def _wanted(stages: Sequence[str] | None) -> set[str]:
    wanted = set(STAGES if stages is None else stages)
    for name in sorted(wanted):
        if name not in STAGES:
            raise NoSuchElement("stage", name, STAGES)
    return wanted | {_NEEDS[name] for name in wanted & _NEEDS.keys()}


def _passing(dataset: Dataset, trials: Sequence[Trial], robot: Clock) -> Postures | None:
    pairs = zip(dataset.entries("calibration"), trials, strict=True)
    swings = [trial for entry, trial in pairs if entry.kind == "swing"]
    return read_passing(dataset.description, swings, robot, _SPACING) if swings else None


def _register(work: Work) -> Work:
    data = work.postures if work.passing is None else work.postures.joined(work.passing)
    return work.with_model(*register(work.chain, work.description, data))


def _suspend(work: Work) -> Work:
    robot, plate = work.clocks[0], next((c for c in work.clocks if c.instrument == "plate"), None)
    form = Form(full=work.estimate.options.suspension == "full")
    found, said = fit_suspension(work.dataset.urdf, work.description, work.trials, robot, plate, form=form)
    if found is None:
        return replace(work, estimate=replace(work.estimate, verdicts=(*work.estimate.verdicts, *said)))
    return work.with_model(suspension_model(found), said, suspension=found)


def _calibrate_geometry(work: Work) -> Work:
    return work.with_model(*calibrate_geometry(work.chain, work.description, work.postures))


def _calibrate_joints(work: Work) -> Work:
    if any(v.verdict == "refused" for v in work.estimate.verdicts):
        return work
    geometry = work.estimate.model("model_2")
    hand = geometry.hand(work.chain, nominal_frames(work.chain, work.description))
    terms = work.estimate.options.terms
    found, said = fit_joint_models(work.dataset.urdf, work.description, work.trials, work.clocks[0], hand, terms)
    model = joints_model(geometry, found.models)
    grown = replace(
        work.estimate,
        models=(*work.estimate.models, model),
        verdicts=(*work.estimate.verdicts, *said),
        joint_models=found.models,
        link_zero=tuple(map(float, found.zero)),
    )
    if not found.models:
        grown = replace(work.estimate, verdicts=(*work.estimate.verdicts, *said))
    return replace(work, estimate=grown)


_RUN: dict[str, Callable[[Work], Work]] = {
    "registration": _register,
    "suspension": _suspend,
    "geometry": _calibrate_geometry,
    "joints": _calibrate_joints,
}


def _concluded(estimate: Estimate) -> Estimate:
    """Whether it may be used, and by which row."""
    names = [m.name for m in estimate.models]
    main = next((name for name in MAIN if name in names), names[-1] if names else "")
    usable = bool(names) and all(v.verdict != "refused" for v in estimate.verdicts)
    return replace(estimate, main=main, status="calibrated" if usable else "not_calibrated")


def _empty(dataset: Dataset, options: Options) -> Estimate:
    """Nothing to be used so far."""
    d = dataset.description
    names = RobotNames(d.joint_names, d.base_frame, d.tool_frame)
    return Estimate("not_calibrated", (), (), (), "", dataset.urdf, names, options=options)
