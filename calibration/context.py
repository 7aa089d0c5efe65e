"""State of a calibration between two stages: input of the next one, and the estimate so far."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

from calibration.estimate.estimate import Estimate, with_clocks
from calibration.inference.parameters import Model
from calibration.mocap.postures import Postures, mean_postures, passing_postures, static_postures
from calibration.recording.experiment import ExperimentPlan
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import TrialEntry
from calibration.recording.trial import Trial
from calibration.stages.bundle.stage import Bundle
from calibration.stages.joints.correction import JointModels
from calibration.stages.joints.repetitions import on_repetitions
from calibration.stages.stage import StageInput, StageResult
from calibration.stages.suspension.model import Suspension
from calibration.verdict import Verdict

_SPACING = 0.5  # [s] of the swings' postures the registration sees beside the static ones


@dataclass(frozen=True)
class Context:
    """Input of the next stage, and the estimate so far."""

    data: StageInput
    estimate: Estimate

    def with_findings(self, *findings: Verdict) -> "Context":
        """With more findings and no model."""
        verdicts = (*self.estimate.verdicts, *findings)
        rejected = any(v.verdict == "refused" for v in verdicts)
        return Context(replace(self.data, rejected=rejected), replace(self.estimate, verdicts=verdicts))

    def with_result(self, result: StageResult) -> "Context":
        """With the models, quantities and findings of a stage."""
        names = [model.name for model in result.models]
        kept = (m for m in self.estimate.models if m.name not in names)
        models = (*kept, *(self._clocked(m) for m in result.models))
        estimate = replace(self.estimate, models=models)
        if isinstance(result.quantity, Suspension):
            estimate = replace(estimate, suspension=result.quantity)
        elif isinstance(result.quantity, JointModels):
            found, zero = result.quantity, tuple(map(float, result.quantity.zero))
            regimes = on_repetitions(found, self.data.trials, self.data.options.terms)
            estimate = replace(estimate, joint_models=found.models, link_zero=zero, regimes=regimes)
        elif isinstance(result.quantity, Bundle):
            estimate = replace(estimate, bundle=result.quantity.parts)
        data = replace(self.data, models=models, quantities=(*self.data.quantities, result.quantity))
        return Context(data, estimate).with_findings(*result.findings)

    def with_plan(self, plan: ExperimentPlan | None, findings: Sequence[Verdict]) -> "Context":
        """With an experiment to record next, if there is one."""
        plans = self.estimate.remedies if plan is None else (*self.estimate.remedies, plan)
        return replace(self, estimate=replace(self.estimate, remedies=plans)).with_findings(*findings)

    def _clocked(self, model: Model) -> Model:
        """With the clocks' parameters, unless they are among those of the model it builds on."""
        known = any(p.name.startswith("clock.") for p in model.parameters)
        return model if known else with_clocks(model, self.data.clocks)


def with_postures(
    data: StageInput, pairs: Sequence[tuple[TrialEntry, Trial]], means: Sequence[PostureMeans]
) -> StageInput:
    """With the static postures of trials and means, and those passed in swings."""
    description, robot = data.lab.description, data.clock("robot")
    found, passing = [mean_postures(description, m) for m in means], None
    if robot is not None:
        if any(len(trial.dwell_start) for trial in data.trials) or not found:
            found.append(static_postures(description, data.trials, robot, data.lab.chain.poses))
        swings = [trial for entry, trial in pairs if entry.kind == "swing"]
        passing = passing_postures(description, swings, robot, _SPACING) if swings else None
    return replace(data, postures=reduce(Postures.joined, found) if found else None, passing=passing)
