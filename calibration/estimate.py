"""What a calibration found: parameters with their uncertainty, clocks, verdicts; or why there is nothing to use."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from calibration.arm import PREFIX, as_placements
from calibration.clock import Clock
from calibration.errors import NoSuchElement
from calibration.hand import HandModel, nominal_hand
from calibration.identifiability import Combination, Status
from calibration.options import Options
from calibration.parameters import AXES, parameter_names
from calibration.remedy import Remedy
from calibration.robot import Chain
from calibration.schema import Description
from calibration.se3 import from_vector
from calibration.verdict import Verdict

if TYPE_CHECKING:
    from calibration.joint_model import JointModel
    from calibration.suspension import Suspension


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Attributes:
        name: As in the contract.
        unit: `m`, `rad`, `s` or `-`.
        nominal: Datasheet value.
        value: Estimate.
        sigma: Standard deviation, priors included.
        status: Whether the data fix it alone, only in combinations, or not at all.
    """

    name: str
    unit: str
    nominal: float
    value: float
    sigma: float
    status: Status


@dataclass(frozen=True)
class Model:
    """Parameters that were estimated together.

    Attributes:
        name: Row of the ladder: `registration`, `model_2`, ...
        parameters: In a fixed order.
        combinations: Identifiable combinations of more than one parameter; coefficients in the parameters' order.
        covariance: (p, p).
        joints: Joints of the chain, base to tip.
        play: (k,) random reading error of each joint, standard deviation [rad, m]; empty where not estimated.
        rank: Number of identifiable combinations; 0 where not known.
        condition: Condition number of the scaled whitened Jacobian [-]; 0 where not known.
        hand_error: (2,) random errors of the hand's position [m] and rotation [rad]; empty where not estimated.
    """

    name: str
    parameters: tuple[Parameter, ...]
    combinations: tuple[Combination, ...] = ()
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    joints: tuple[str, ...] = ()
    play: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rank: int = 0
    condition: float = 0.0
    hand_error: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def value(self, name: str, default: float) -> float:
        """Estimate of a parameter, `default` where the model has none of that name."""
        return next((p.value for p in self.parameters if p.name == name), default)

    def hand(self, chain: Chain, frames: np.ndarray) -> HandModel:
        """The robot with this model's values; nominal chain and marker frames (12,) [m, rad] where it has none."""
        nominal = nominal_hand(chain, frames)
        values = {p.name: p.value for p in self.parameters}
        theta = np.array([values.get(n, x) for n, x in zip(parameter_names(chain), nominal.theta, strict=True)])
        if f"{PREFIX}.x" in values:
            arm = from_vector(np.array([values[f"{PREFIX}.{axis}"] for axis in AXES]))
            theta[12 : 12 + 6 * len(chain.joints)] = as_placements(chain, arm).ravel()
        return nominal.with_theta(theta)

    def with_clocks(self, clocks: Iterable[Clock]) -> "Model":
        """The model with `clock.<instrument>.{offset,drift}` after its own parameters."""
        model = self
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
            model = replace(
                model, parameters=model.parameters + added, combinations=tuple(padded), covariance=covariance
            )
        return model


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
        main: Name of the model that calibrated.urdf and `Compensator` use; empty where there is none.
        urdf: URDF text the geometry is relative to; None: the dataset's nominal one.
        robot: Joints and frames; None where the source does not say.
        suspension: Base under a wrench, of row `model_1`; None where there is none.
        joint_models: Printed joint models, of row `model_3`.
        link_zero: Motor minus link reading of each measured joint over the calibration postures [rad, m].
        options: What was chosen.
        laboratory: What dataset.json declares, without its trials; None where the source does not say.
        remedies: What to record next, for what the data do not tell.
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
    remedies: tuple[Remedy, ...] = ()

    def model(self, name: str) -> Model:
        """The model of that name.

        Raises:
            NoSuchElement: There is none.
        """
        found = next((m for m in self.models if m.name == name), None)
        if found is None:
            raise NoSuchElement("model", name, [m.name for m in self.models])
        return found

    def clock(self, instrument: str) -> Clock | None:
        """The clock of an instrument, None where it was not synchronised."""
        return next((c for c in self.clocks if c.instrument == instrument), None)

    @property
    def calibrated(self) -> bool:
        """Whether the result may be used."""
        return self.status == "calibrated"
