"""From recordings to an estimate: the stages, in their order.

    clocks -> registration -> geometry

A stage that needs another runs it. Only calibration trials are opened.
"""

from collections.abc import Callable, Sequence

from calibration.clock import Clock
from calibration.clocks import synchronise
from calibration.dataset import Dataset
from calibration.errors import NoSuchElement, NotEnoughData
from calibration.estimate import Estimate, Model, RobotNames
from calibration.geometry import calibrate_geometry
from calibration.plausibility import implausible_inputs
from calibration.postures import Postures, read_passing, read_postures
from calibration.registration import register
from calibration.robot import Chain, chain_of
from calibration.schema import Description
from calibration.verdict import Verdict

Progress = Callable[[str, float], None]
Stage = Callable[[Chain, Description, Postures], tuple[Model, tuple[Verdict, ...]]]

CLOCKS = "clocks"
FITS: tuple[tuple[str, Stage], ...] = (("registration", register), ("geometry", calibrate_geometry))
_SPACING = 0.5  # [s] of the swings' postures the registration sees beside the static ones
STAGES = (CLOCKS, *(name for name, _ in FITS))


def calibrate(dataset: Dataset, stages: Sequence[str] | None = None, progress: Progress | None = None) -> Estimate:
    """Run the stages (all where none is named) on the calibration trials of a dataset.

    The result says itself whether it may be used: `status` and `verdicts`.

    Raises:
        NoSuchElement: A stage of that name does not exist.
        NotEnoughData: There is no calibration trial, or none from which the clocks can be told.
    """
    wanted = STAGES if stages is None else tuple(stages)
    for name in wanted:
        if name not in STAGES:
            raise NoSuchElement("stage", name, STAGES)
    tell = progress or (lambda stage, share: None)
    chain = chain_of(dataset.urdf, dataset.description)
    tell("reading", 0.0)
    trials = tuple(trial for _, trial in dataset.trials("calibration"))
    if not trials:
        raise NotEnoughData("no calibration trial: record static postures and one moving trial with that role")
    verdicts = [Verdict("reading", "refused", m) for m in implausible_inputs(dataset.description, chain, trials)]
    if verdicts:
        return _estimate(dataset, verdicts, (), [])
    tell(CLOCKS, 0.3)
    clocks, said = synchronise(dataset.urdf, dataset.description, trials)
    verdicts += said
    fits = [(name, stage) for name, stage in FITS if name in wanted]
    if not fits:
        return _estimate(dataset, verdicts, clocks, [])
    tell("postures", 0.7)
    models, postures = [], read_postures(dataset.description, trials, clocks[0])
    swings = [
        trial for entry, trial in zip(dataset.entries("calibration"), trials, strict=True) if entry.kind == "swing"
    ]
    passing = read_passing(dataset.description, swings, clocks[0], _SPACING) if swings else None
    for k, (name, stage) in enumerate(fits):
        tell(name, 0.8 + 0.2 * k / len(fits))
        data = postures.joined(passing) if stage is register and passing is not None else postures
        model, said = stage(chain, dataset.description, data)
        models.append(model.with_clocks(clocks))
        verdicts += said
    tell("done", 1.0)
    return _estimate(dataset, verdicts, clocks, models)


def _estimate(dataset: Dataset, verdicts: list[Verdict], clocks: tuple[Clock, ...], models: list[Model]) -> Estimate:
    usable = bool(models) and all(v.verdict != "refused" for v in verdicts)
    description = dataset.description
    return Estimate(
        "calibrated" if usable else "not_calibrated",
        tuple(verdicts),
        clocks,
        tuple(models),
        models[-1].name if models else "",
        dataset.urdf,
        RobotNames(description.joint_names, description.base_frame, description.tool_frame),
    )
