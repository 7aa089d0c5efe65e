"""Trials as sways, by the plate's wrench and by that of inverse dynamics."""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.clock import Clock
from calibration.errors import NotEnoughData
from calibration.inverse_dynamics import floating_model
from calibration.parameters import nominal_base_body
from calibration.recording import Trial
from calibration.robot import chain_of
from calibration.schema import Description
from calibration.suspension_rest import rest_of
from calibration.suspension_sway import Forcing, Sway, sway_of
from calibration.suspension_wrench import Load, dynamics_load, plate_load

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Laboratory:
    """What turns a trial into wrenches and displacements.

    Attributes:
        description: Of the dataset.
        model: Nominal floating-base model.
        T_base_B: (4, 4) the base's marker body on the base.
        robot: Clock of the encoders, None where there are none.
        plate: Clock of the force plate, None where there is none.
    """

    description: Description
    model: pin.Model
    T_base_B: np.ndarray
    robot: Clock | None
    plate: Clock | None

    def plate_load(self, trial: Trial, T_lab_0: np.ndarray) -> Load:
        """The wrench the plate measured.

        Raises:
            NotEnoughData: There is no plate, or its clock is not known.
        """
        if self.plate is None or len(trial.t_plate) == 0:
            raise NotEnoughData(f"{trial.id}: no force plate on a known clock")
        return plate_load(trial, self.plate, T_lab_0)

    def dynamics_load(self, trial: Trial, T_lab_0: np.ndarray) -> Load:
        """The wrench by inverse dynamics.

        Raises:
            NotEnoughData: There are no encoder readings on a known clock.
        """
        if self.robot is None or len(trial.t_robot) == 0:
            raise NotEnoughData(f"{trial.id}: no encoder readings on a known clock")
        return dynamics_load(self.model, self.description, trial, self.robot, T_lab_0)


@dataclass(frozen=True)
class Sways:
    """Sways of the usable trials; either is empty where there is no such instrument, else in the same order."""

    plate: tuple[Sway, ...]
    dynamics: tuple[Sway, ...]

    def without(self, names: Iterable[str]) -> "Sways":
        """Without some trials."""
        left_out = set(names)
        return replace(
            self,
            plate=tuple(s for s in self.plate if s.trial_id not in left_out),
            dynamics=tuple(s for s in self.dynamics if s.trial_id not in left_out),
        )

    @property
    def forcings(self) -> tuple[list[Forcing], list[Forcing]]:
        """Of the plate and of the dynamics."""
        return [s.forcing for s in self.plate], [s.forcing for s in self.dynamics]


def laboratory(
    urdf: str, description: Description, robot: Clock | None, plate: Clock | None, T_base_B: np.ndarray | None = None
) -> Laboratory:
    """The laboratory of a dataset; the marker body where it is drawn, unless T_base_B says otherwise."""
    if T_base_B is None:
        T_base_B = nominal_base_body(chain_of(urdf, description), description)
    return Laboratory(description, floating_model(urdf, description), T_base_B, robot, plate)


def read_sways(lab: Laboratory, trials: Sequence[Trial]) -> Sways:
    """Sways of the trials that show the base and its wrench, by every instrument the campaign has."""
    sources: dict[str, Callable[[Trial, np.ndarray], Load]] = {}
    if lab.robot is not None and any(len(t.t_robot) for t in trials):
        sources["dynamics"] = lab.dynamics_load
    if lab.plate is not None and any(len(t.t_plate) for t in trials):
        sources["plate"] = lab.plate_load
    rows = []
    for trial in trials:
        try:
            rest = rest_of(lab.description, trial, lab.T_base_B)
            rows.append([sway_of(lab.description, trial, rest, load(trial, rest.T_lab_0)) for load in sources.values()])
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
    columns = {name: tuple(row[k] for row in rows) for k, name in enumerate(sources)}
    return Sways(columns.get("plate", ()), columns.get("dynamics", ()))
