"""estimate.json: its fields, and the way between it and an `Estimate`."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.json_stage_models import (
    JointEntry,
    RegimeEntry,
    SuspensionEntry,
    joint_entry,
    joint_model,
    regime_entry,
    regime_quality,
    suspension_entry,
    suspension_of,
)
from calibration.estimate.plain_values import plain, restored
from calibration.inference.absorption import Absorption
from calibration.inference.parameters import Combination, Model, Parameter, Status
from calibration.options import Options
from calibration.recording.clock import Clock
from calibration.recording.schema import Description, Name, refuse_repeated
from calibration.stages.bundle.robot import BundleParts
from calibration.verdict import Verdict

_Value = Annotated[float, Field(ge=-1e30, le=1e30)]


class Entry(BaseModel):
    """Frozen; no NaN. Unknown fields of other programs are ignored."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="ignore")


class ParameterEntry(Entry):
    """A parameter, as in the contract."""

    name: str
    unit: str = ""
    nominal: _Value = 0.0
    value: _Value
    sigma: float | None = None
    status: Status = "estimated"


class CombinationEntry(Entry):
    """An identifiable combination: coefficients by parameter name."""

    name: str
    coefficients: dict[str, float]
    value: float
    sigma: float


class PlayEntry(Entry):
    """Random reading error of a joint [rad, m], standard deviation."""

    joint: str
    sigma: float


class ModelEntry(Entry):
    """A model of the ladder."""

    parameters: tuple[ParameterEntry, ...]
    combinations: tuple[CombinationEntry, ...] = ()
    reading_error: tuple[PlayEntry, ...] = ()
    rank: int = 0
    condition: float = 0.0
    hand_error: tuple[float, ...] = ()
    absorption: dict[str, Any] | None = None

    @field_validator("parameters")
    @classmethod
    def _are_named_once(cls, parameters: tuple[ParameterEntry, ...]) -> tuple[ParameterEntry, ...]:
        refuse_repeated({"parameters": [p.name for p in parameters]})
        return parameters


class VerdictEntry(Entry):
    """A finding of a stage."""

    stage: str
    verdict: Literal["ok", "warning", "missing", "refused"]
    message: str


class ClockEntry(Entry):
    """t_mocap = t (1 + drift) + offset; see `clock.Clock`."""

    instrument: str
    offset: float
    drift: float
    covariance: tuple[tuple[float, float], tuple[float, float]]
    epoch: float
    sigma: float


class RobotEntry(Entry):
    """Measured joints and the two frames."""

    joints: tuple[str, ...]
    base_frame: str
    tool_frame: str


class EstimateFile(Entry):
    """The whole of estimate.json."""

    schema_version: Annotated[Literal[1], Field(alias="schema")] = 1
    status: Literal["calibrated", "not_calibrated"] = "calibrated"
    verdicts: tuple[VerdictEntry, ...] = ()
    models: dict[Name, ModelEntry]
    main: str = ""
    clocks: tuple[ClockEntry, ...] = ()
    robot: RobotEntry | None = None
    suspension: SuspensionEntry | None = None
    joint_models: tuple[JointEntry, ...] = ()
    link_zero: tuple[float | None, ...] = ()
    regimes: tuple[RegimeEntry, ...] = ()
    options: Options = Field(default_factory=Options)
    laboratory: Description | None = None
    bundle: dict[str, Any] | None = None

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="ignore", validate_by_name=True)

    @model_validator(mode="after")
    def _is_of_one_robot(self) -> "EstimateFile":
        n = len(self.link_zero)
        if self.robot is not None and n not in (0, len(self.robot.joints)):
            raise ValueError(f"link_zero has {n} values for {len(self.robot.joints)} joints")
        return self


def to_file(estimate: Estimate) -> EstimateFile:
    """An estimate as the contents of estimate.json."""
    return EstimateFile(
        status=estimate.status,
        verdicts=tuple(VerdictEntry(stage=v.stage, verdict=v.verdict, message=v.message) for v in estimate.verdicts),
        models={model.name: _model_entry(model) for model in estimate.models},
        main=estimate.main,
        clocks=tuple(
            ClockEntry(
                instrument=c.instrument,
                offset=c.offset,
                drift=c.drift,
                covariance=((c.covariance[0, 0], c.covariance[0, 1]), (c.covariance[1, 0], c.covariance[1, 1])),
                epoch=c.epoch,
                sigma=c.sigma,
            )
            for c in estimate.clocks
        ),
        robot=None
        if estimate.robot is None
        else RobotEntry(
            joints=estimate.robot.joints, base_frame=estimate.robot.base_frame, tool_frame=estimate.robot.tool_frame
        ),
        suspension=None if estimate.suspension is None else suspension_entry(estimate.suspension),
        joint_models=tuple(joint_entry(m) for m in estimate.joint_models),
        link_zero=tuple(_finite(z) for z in estimate.link_zero),
        regimes=tuple(regime_entry(x) for x in estimate.regimes),
        options=estimate.options,
        laboratory=estimate.laboratory,
        bundle=plain(estimate.bundle),
    )


def to_estimate(file: EstimateFile, urdf: str | None, covariances: Mapping[str, np.ndarray]) -> Estimate:
    """The contents of estimate.json, with the covariances of the models that have one, as an estimate."""
    robot = file.robot
    return Estimate(
        file.status,
        tuple(Verdict(v.stage, v.verdict, v.message) for v in file.verdicts),
        tuple(Clock(c.instrument, c.offset, c.drift, np.array(c.covariance), c.epoch, c.sigma) for c in file.clocks),
        tuple(_model(name, entry, covariances.get(name)) for name, entry in file.models.items()),
        file.main or (list(file.models)[-1] if file.models else ""),
        urdf,
        None if robot is None else RobotNames(robot.joints, robot.base_frame, robot.tool_frame),
        None if file.suspension is None else suspension_of(file.suspension),
        tuple(joint_model(entry) for entry in file.joint_models),
        tuple(float("nan") if z is None else z for z in file.link_zero),
        file.options,
        file.laboratory,
        regimes=tuple(regime_quality(x) for x in file.regimes),
        bundle=None if file.bundle is None else restored(BundleParts, file.bundle, "estimate.json: bundle"),
    )


def _finite(x: float) -> float | None:
    """JSON has no NaN: what is not known is null."""
    return float(x) if np.isfinite(x) else None


def _model_entry(model: Model) -> ModelEntry:
    names = [p.name for p in model.parameters]
    return ModelEntry(
        parameters=tuple(
            ParameterEntry(
                name=p.name, unit=p.unit, nominal=p.nominal, value=p.value, sigma=_finite(p.sigma), status=p.status
            )
            for p in model.parameters
        ),
        combinations=tuple(
            CombinationEntry(
                name=c.name,
                coefficients={n: float(x) for n, x in zip(names, c.coefficients, strict=True) if x != 0.0},
                value=c.value,
                sigma=c.sigma,
            )
            for c in model.combinations
        ),
        reading_error=tuple(
            PlayEntry(joint=joint, sigma=float(s)) for joint, s in zip(model.joints, model.reading_sigma, strict=True)
        ),
        rank=model.rank,
        condition=model.condition,
        hand_error=tuple(map(float, model.hand_error)),
        absorption=plain(model.absorption),
    )


def _model(name: str, entry: ModelEntry, covariance: np.ndarray | None) -> Model:
    names = [p.name for p in entry.parameters]
    sigma = np.array([p.sigma or 0.0 for p in entry.parameters])
    return Model(
        name,
        tuple(Parameter(p.name, p.unit, p.nominal, p.value, p.sigma or 0.0, p.status) for p in entry.parameters),
        tuple(
            Combination(c.name, np.array([c.coefficients.get(n, 0.0) for n in names]), c.value, c.sigma)
            for c in entry.combinations
        ),
        np.diag(sigma**2) if covariance is None else covariance,
        tuple(p.joint for p in entry.reading_error),
        np.array([p.sigma for p in entry.reading_error]),
        entry.rank,
        entry.condition,
        np.array(entry.hand_error),
        absorption=None
        if entry.absorption is None
        else restored(Absorption, entry.absorption, f"estimate.json: {name}"),
    )
