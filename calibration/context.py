"""What the stages have in common, and what a stage would need that a dataset does not have."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

from calibration.errors import NotEnoughData
from calibration.estimate.estimate import Estimate, with_clocks
from calibration.inference.parameters import Model
from calibration.mocap.postures import Postures, mean_postures, passing_postures, static_postures
from calibration.recording.clock import Clock
from calibration.recording.dataset import Dataset
from calibration.recording.experiment import ExperimentPlan
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.verdict import Verdict

_SPACING = 0.5  # [s] of the swings' postures the registration sees beside the static ones


@dataclass(frozen=True)
class Work:
    """What the stages have in common, and what they have found so far.

    Attributes:
        dataset: The recordings.
        chain: The nominal chain.
        trials: Continuous calibration trials in which the base stands.
        clocks: Of the instruments.
        postures: The static ones, None where none shows base and hand with readings.
        passing: Those of the swings, None where there is no swing.
        estimate: So far.
    """

    dataset: Dataset
    chain: Chain
    trials: tuple[Trial, ...]
    clocks: tuple[Clock, ...]
    postures: Postures | None
    passing: Postures | None
    estimate: Estimate

    @property
    def description(self) -> Description:
        """Of the dataset."""
        return self.dataset.description

    def clock(self, instrument: str) -> Clock | None:
        """The clock of an instrument; None where it was not recorded or could not be told."""
        return next((c for c in self.clocks if c.instrument == instrument), None)

    def with_model(self, model: Model, said: Sequence[Verdict], **parts: object) -> "Work":
        """With one more model."""
        e = self.estimate
        grown = replace(e, models=(*e.models, with_clocks(model, self.clocks)), verdicts=(*e.verdicts, *said), **parts)  # type: ignore[arg-type]
        return replace(self, estimate=grown)

    def suggesting(self, remedy: ExperimentPlan | None, said: Sequence[Verdict]) -> "Work":
        """With something to record next, if there is."""
        work = self.saying(*said)
        remedies = work.estimate.remedies if remedy is None else (*work.estimate.remedies, remedy)
        return replace(work, estimate=replace(work.estimate, remedies=remedies))

    def saying(self, *said: Verdict) -> "Work":
        """With something to say and no model."""
        return replace(self, estimate=replace(self.estimate, verdicts=(*self.estimate.verdicts, *said)))


def with_postures(work: Work, pairs: Sequence[tuple[TrialEntry, Trial]], means: Sequence[PostureMeans]) -> Work:
    """With the postures the dataset has."""
    robot, found = work.clock("robot"), [mean_postures(work.description, m) for m in means]
    passing = None
    if robot is not None:
        if any(len(trial.dwell_start) for trial in work.trials) or not found:
            found.append(static_postures(work.description, work.trials, robot))
        swings = [trial for entry, trial in pairs if entry.kind == "swing"]
        passing = passing_postures(work.description, swings, robot, _SPACING) if swings else None
    postures = reduce(Postures.joined, found) if found else None
    return replace(work, postures=postures, passing=passing)


def postures_of(work: Work) -> Postures:
    """The static postures.

    Raises:
        NotEnoughData: There are none.
    """
    if work.postures is None:
        raise NotEnoughData("no static posture shows base and hand with joint readings")
    return work.postures
