"""estimate.json: its fields, and the way between it and an `Estimate`."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from calibration.estimate.estimate import Estimate, RobotNames
from calibration.estimate.plain_values import plain, restored
from calibration.inference.absorption import Absorption
from calibration.inference.parameters import Combination, Model, Parameter, Status
from calibration.options import Options
from calibration.recording.clock import Clock
from calibration.recording.declaration import Name, refuse_repeated
from calibration.recording.schema import Description
from calibration.stages.bundle.robot import BundleParts
from calibration.stages.joints.model import JointModel
from calibration.stages.joints.repetitions import RegimeQuality
from calibration.stages.suspension.model import Suspension
from calibration.verdict import Verdict

_Value = Annotated[float, Field(ge=-1e30, le=1e30)]
_Part = dict[str, Any]
T = TypeVar("T")


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
    absorption: _Part | None = None

    @field_validator("parameters")
    @classmethod
    def _are_named_once(cls, parameters: tuple[ParameterEntry, ...]) -> tuple[ParameterEntry, ...]:
        refuse_repeated(parameters=[p.name for p in parameters])
        return parameters


class VerdictEntry(Entry):
    """A finding of a stage."""

    stage: str
    verdict: Literal["ok", "warning", "missing", "refused"]
    message: str


class EstimateFile(Entry):
    """The whole of estimate.json; what is a `_Part` is a dataclass in its plain form, see `plain_values`."""

    schema_version: Annotated[Literal[1], Field(alias="schema")] = 1
    status: Literal["calibrated", "not_calibrated"] = "calibrated"
    verdicts: tuple[VerdictEntry, ...] = ()
    models: dict[Name, ModelEntry]
    main: str = ""
    clocks: tuple[_Part, ...] = ()
    robot: _Part | None = None
    suspension: _Part | None = None
    joint_models: tuple[_Part, ...] = ()
    link_zero: tuple[float | None, ...] = ()
    regimes: tuple[_Part, ...] = ()
    options: Options = Field(default_factory=Options)
    laboratory: Description | None = None
    bundle: _Part | None = None

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, extra="ignore", validate_by_name=True)


def to_file(estimate: Estimate) -> EstimateFile:
    """An estimate as the contents of estimate.json."""
    return EstimateFile(
        status=estimate.status,
        verdicts=tuple(VerdictEntry(stage=v.stage, verdict=v.verdict, message=v.message) for v in estimate.verdicts),
        models={model.name: _model_entry(model) for model in estimate.models},
        main=estimate.main,
        clocks=tuple(map(plain, estimate.clocks)),
        robot=plain(estimate.robot),
        suspension=None if estimate.suspension is None else _suspension_part(estimate.suspension),
        joint_models=tuple(_without(plain(m), "covariance", "blocks") for m in estimate.joint_models),
        link_zero=tuple(_finite(z) for z in estimate.link_zero),
        regimes=tuple(map(plain, estimate.regimes)),
        options=estimate.options,
        laboratory=estimate.laboratory,
        bundle=plain(estimate.bundle),
    )


def to_estimate(file: EstimateFile, urdf: str | None, covariances: Mapping[str, np.ndarray]) -> Estimate:
    """The contents of estimate.json, with the covariances of the models that have one, as an estimate."""
    robot, bundle = _known(RobotNames, file.robot, "robot"), _known(BundleParts, file.bundle, "bundle")
    if robot is not None:
        _check_sizes(robot.joints, file, bundle)
    return Estimate(
        file.status,
        tuple(Verdict(v.stage, v.verdict, v.message) for v in file.verdicts),
        tuple(_restored(Clock, c, "clocks") for c in file.clocks),
        tuple(_model(name, entry, covariances.get(name)) for name, entry in file.models.items()),
        file.main or (list(file.models)[-1] if file.models else ""),
        urdf,
        robot,
        None if file.suspension is None else _suspension(file.suspension),
        tuple(_restored(JointModel, m, "joint_models") for m in file.joint_models),
        tuple(float("nan") if z is None else z for z in file.link_zero),
        file.options,
        file.laboratory,
        regimes=tuple(_restored(RegimeQuality, x, "regimes") for x in file.regimes),
        bundle=bundle,
    )


def _check_sizes(names: tuple[str, ...], file: EstimateFile, bundle: BundleParts | None) -> None:
    """See that there is a value for each joint, in all models those on the way to the hand, and for each train."""
    joints, on_the_way = len(names), {e.joint for m in file.models.values() for e in m.reading_error}
    sizes = [("link_zero", len(file.link_zero), joints)]
    sizes += [(f"{name}: reading_error", len(m.reading_error), len(on_the_way)) for name, m in file.models.items()]
    if not on_the_way <= set(names):
        raise ValueError(
            f"reading_error is of joints that the robot does not have: {', '.join(on_the_way - set(names))}"
        )
    if bundle is not None:
        sizes += [("offset", len(bundle.offset) or -1, joints)]
        of_trains = ("at_rest", "at_rest_by_dynamics")
        sizes += [(name, len(getattr(bundle, name)), len(bundle.trains)) for name in of_trains]
        inertials = [len(train.inertials) for train in bundle.trains]
        sizes += [("inertials", n, max(inertials)) for n in inertials]
    for name, found, expected in sizes:
        if found not in (0, expected):
            raise ValueError(f"{name} has {found} values, not {expected}")


def _restored(kind: type[T], part: _Part, at: str) -> T:
    return restored(kind, part, f"estimate.json: {at}")


def _known(kind: type[T], part: _Part | None, at: str) -> T | None:
    return None if part is None else _restored(kind, part, at)


def _suspension_part(suspension: Suspension) -> _Part:
    """Without what is a parameter of model_1."""
    held_out = [{"source": source} | plain(tried) for source, tried in suspension.held_out]
    return _without(plain(suspension), "parameters", "combinations") | {"held_out": held_out}


def _suspension(part: _Part) -> Suspension:
    held_out = [(tried["source"], tried) for tried in part["held_out"]]
    apart = {"held_out": held_out, "parameters": (), "combinations": ()}
    return _restored(Suspension, part | apart, "suspension")


def _without(part: _Part, *names: str) -> _Part:
    return {name: value for name, value in part.items() if name not in names}


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
        absorption=_known(Absorption, entry.absorption, name),
    )
