"""What a calibration found: parameters with their uncertainty, clocks, verdicts; or why there is nothing to use."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from calibration.errors import NoSuchElement, NotCalibrated
from calibration.inference.parameters import Model, Parameter
from calibration.options import Options
from calibration.recording.clock import Clock
from calibration.recording.experiment import ExperimentPlan
from calibration.recording.schema import Description
from calibration.verdict import Verdict

if TYPE_CHECKING:
    from calibration.stages.bundle.robot import BundleParts
    from calibration.stages.joints.model import JointModel
    from calibration.stages.joints.repetitions import RegimeQuality
    from calibration.stages.suspension.model import Suspension


_GEOMETRY = ("geometry.", "encoder.", "frame.base.arm")


@dataclass(frozen=True)
class RobotNames:
    """What of the robot an estimate is about: the measured joints (columns of q) and the two frames."""

    joints: tuple[str, ...]
    base_frame: str
    tool_frame: str


@dataclass(frozen=True)
class Estimate:
    """Result of `calibrate`, or of somebody else.

    Attributes:
        status: `calibrated`, or `not_calibrated`: the verdicts say why and nothing may be used.
        verdicts: Findings of all stages.
        clocks: One for each instrument that was synchronised.
        models: In the order they were estimated.
        main: Name of the model that `Compensator` uses; empty where there is none.
        urdf: URDF text the geometry is relative to; None: the dataset's nominal one.
        robot: Joints and frames; None where the source does not say.
        suspension: Base under a wrench, of row `model_1`; None where there is none.
        joint_models: Printed joint models, of row `model_3`.
        link_zero: Motor minus link reading of each measured joint over the calibration postures [rad, m].
        options: What was chosen.
        laboratory: What dataset.json declares, without its trials; None where the source does not say.
        remedies: What to record next, for what the data do not identify.
        bundle: Drive trains, bending and base of row `full`; None where they were not identified.
        regimes: Fit quality of the joint models on repetitions of their own motions.
        registered: Whether it says where the marker bodies are; a URDF does not.
    """

    status: Literal["calibrated", "not_calibrated"]
    verdicts: tuple[Verdict, ...]
    clocks: tuple[Clock, ...]
    models: tuple[Model, ...]
    main: str
    urdf: str | None = None
    robot: RobotNames | None = None
    suspension: "Suspension | None" = None
    joint_models: "tuple[JointModel, ...]" = ()
    link_zero: tuple[float, ...] = ()
    options: Options = field(default_factory=Options)
    laboratory: Description | None = None
    remedies: tuple[ExperimentPlan, ...] = ()
    regimes: "tuple[RegimeQuality, ...]" = ()
    registered: bool = True
    bundle: "BundleParts | None" = None

    def model(self, name: str) -> Model:
        """The model of that name.

        Raises:
            NoSuchElement: There is none.
        """
        found = next((m for m in self.models if m.name == name), None)
        if found is None:
            raise NoSuchElement("model", name, [m.name for m in self.models])
        return found

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every estimated parameter once: of the main model where it has it, else of the first model that does."""
        models = sorted(self.models, key=lambda m: m.name != self.main)
        found: dict[str, Parameter] = {}
        for p in (p for model in models for p in model.parameters):
            found.setdefault(p.name, p)
        return tuple(found.values())

    def clock(self, instrument: str) -> Clock | None:
        """The clock of an instrument, None where it was not synchronised."""
        return next((c for c in self.clocks if c.instrument == instrument), None)

    @property
    def calibrated(self) -> bool:
        """Whether the result may be used."""
        return self.status == "calibrated"

    def require_calibrated(self) -> None:
        """Check that it may be used.

        Raises:
            NotCalibrated: It must not; the message has the findings why.
        """
        if not self.calibrated:
            found = [v for v in self.verdicts if v.verdict == "refused"]
            raise NotCalibrated([v.message for v in found if v.stage != "conclusion"] or [v.message for v in found])

    @property
    def exported(self) -> str:
        """Name of the model of calibrated.urdf and zeros.yaml: readers of those know no drive trains."""
        return self.main if self.bundle is None else "model_2"

    @property
    def has_geometry(self) -> bool:
        """Whether its main model moves a joint or a reading's zero, so that it has a calibrated URDF of its own."""
        model = next((m for m in self.models if m.name == self.main), None)
        return model is not None and any(p.name.startswith(_GEOMETRY) for p in model.parameters)

    @property
    def extent(self) -> str:
        """How far it is calibrated: `calibrated`, only the part that was, or `not calibrated`."""
        if not self.calibrated:
            return "not calibrated"
        if self.has_geometry:
            return "calibrated"
        return "suspension only" if self.main == "model_1" else f"{self.main or 'clocks'} only"


def with_clocks(model: Model, clocks: Iterable[Clock]) -> Model:
    """The model with `clock.<instrument>.{offset,drift}` after its own parameters."""
    for clock in (c for c in clocks if c.covariance.any()):  # a shared clock is known, not estimated
        sigma = np.sqrt(np.diag(clock.covariance))
        added = (
            Parameter(f"clock.{clock.instrument}.offset", "s", 0.0, clock.offset, float(sigma[0]), "estimated"),
            Parameter(f"clock.{clock.instrument}.drift", "-", 0.0, clock.drift, float(sigma[1]), "estimated"),
        )
        p = len(model.parameters)
        covariance = np.zeros((p + 2, p + 2))
        covariance[:p, :p], covariance[p:, p:] = model.covariance, clock.covariance
        padded = (replace(c, coefficients=np.append(c.coefficients, [0.0, 0.0])) for c in model.combinations)
        model = replace(model, parameters=model.parameters + added, combinations=tuple(padded), covariance=covariance)
    return model
