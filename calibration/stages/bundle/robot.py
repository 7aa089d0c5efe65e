"""The robot of row `full` in use.

T_lab_H(t) = T_lab_B(t)  T_B_H(q_link(t), M(t))        q_link  readings behind the drive trains
M       moment that bends the column
T_lab_B(t)  marker body of the base that sticks and slips, from its first second and a wrench
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from calibration.errors import NotEnoughData
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.robot.urdf import LinkMasses, calibrated_urdf
from calibration.stages.drive_trains.column_bending import ColumnBending
from calibration.stages.drive_trains.corrected_trial import (
    CorrectedTrial,
    by_link_encoders,
    corrected_trial,
    hand_poses,
)
from calibration.stages.drive_trains.drive_train import DriveTrain, drive_motion, harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.hung_load import HungLoad
from calibration.stages.drive_trains.stage import MovedBase
from calibration.stages.drive_trains.torques import STIFF, dynamics
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.poses import BasePrediction, slipping_base_poses
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.model import Source

Encoder = Literal["motor", "link"]


@dataclass(frozen=True)
class BundleParts:
    """What row `full` has beside the parameters of its geometry, as estimate.json holds it.

    Attributes:
        trains: Drive trains of the joints that have one.
        offset: (k,) zeros of the motor readings [rad, m].
        bending: Of the column.
        stick_slip: The base; None where it was not identified.
        at_rest: (m,) s_j of each train's angle in dwells, see `errors_in_use` [rad]; 0 where not known, or empty.
        at_rest_by_dynamics: The same where inverse dynamics move the base that else a plate moves; empty without.
        hung: What the wrist's sensor weighed beside links and payload; None where nothing was.
        links: What a plate weighed; None where none did, and the links are nominal.
        placed: Whether drive trains and base are loaded by links where the geometry and the column have them; in
            estimates of before, by links where they nominally are.
    """

    trains: tuple[DriveTrain, ...]
    offset: np.ndarray
    bending: ColumnBending
    stick_slip: StickSlip | None
    at_rest: np.ndarray = field(default_factory=lambda: np.zeros(0))
    at_rest_by_dynamics: np.ndarray = field(default_factory=lambda: np.zeros(0))
    hung: HungLoad | None = None
    links: LinkMasses | None = None
    placed: bool = False

    @property
    def by_dynamics(self) -> "BundleParts":
        """The same where inverse dynamics move the base: links that its jolts move stop elsewhere."""
        return replace(self, at_rest=self.at_rest_by_dynamics) if len(self.at_rest_by_dynamics) else self


@dataclass(frozen=True)
class BundledRobot:
    """The robot with its drive trains, in a laboratory.

    Attributes:
        hand: Its geometry.
        trains: Its drive trains with the dynamics that load them; none where none was identified.
        bending: Of the column.
        stick_slip: Its base; None where it was not identified.
        at_rest: (k,) s_j of each joint's angle in dwells [rad]; 0 where not known.
    """

    hand: HandModel
    trains: DriveTrains
    bending: ColumnBending
    stick_slip: StickSlip | None
    at_rest: np.ndarray

    @classmethod
    def of(cls, hand: HandModel, parts: BundleParts, urdf: str, description: Description) -> "BundledRobot":
        """The robot from what was saved of it, and the nominal one."""
        urdf, column = urdf if parts.links is None else parts.links.on(urdf), STIFF
        if parts.placed:
            urdf, column = calibrated_urdf(urdf, hand.chain), parts.bending.column
        robot = dynamics(urdf, description, parts.offset, parts.hung, column)
        trains = DriveTrains(robot, parts.trains, urdf, description, parts.hung)
        at_rest = trains.by_joint(parts.at_rest) if len(parts.at_rest) else np.zeros(len(parts.offset))
        return cls(hand, trains, parts.bending, parts.stick_slip, at_rest)

    def hand_in_base(self, trial: Trial, robot: Clock) -> np.ndarray:
        """T_B_H (n, 4, 4) at a trial's mocap times by motor readings, NaN where one is missing; the base measured."""
        return self.hand_poses(self.corrected(trial, robot), robot)

    def hand_poses(self, corrected: CorrectedTrial, robot: Clock, encoder: Encoder = "motor") -> np.ndarray:
        """T_B_H (n, 4, 4) at a trial's mocap times by one side's encoders, NaN where a reading is missing."""
        one = corrected if encoder == "motor" else by_link_encoders(self.trains, corrected)
        return hand_poses(self.hand, self.bending, one, robot)

    def corrected(self, trial: Trial, robot: Clock, moved: MovedBase | None = None) -> CorrectedTrial:
        """Link angles in place of a trial's motor readings, on a base that moved so.

        Where that is not given, its markers are read throughout.
        """
        return corrected_trial(self.trains, trial, robot, self.hand, moved)

    def encoder_differences(self, corrected: CorrectedTrial) -> dict[str, np.ndarray]:
        """Motor minus link reading (3, n) [rad] by each drive train with a link encoder: as predicted, on both flanks.

        q_motor - q_link = offset - offset_l + e_m - e_l + delta        flanks: delta = c tau -+ half gap
        """
        trains, loads, found = self.trains, corrected.loads, {}
        for train in (train for train in trains.trains if np.isfinite(train.link).all()):
            j = trains.joints.index(train.joint)
            angle = corrected.angles.q[:, j] - trains.dynamics.offset[j]
            y = loads.q[:, j] - (angle + train.link[0] + harmonic_terms(angle) @ train.link[1:])
            delta = loads.q[:, j] - train.harmonics(loads.angle[:, j]) - corrected.angles.q[:, j]
            low, high = train.flanks(drive_motion([loads], j, train.inertials if len(train.inertials) else None))
            found[train.joint] = np.array([y, y - delta + low, y - delta + high])
        return found

    @property
    def knows_link_encoders(self) -> bool:
        """Whether errors of link encoders were identified with the drive trains."""
        return any(np.isfinite(train.link).all() for train in self.trains.trains)

    def knows(self, source: Source) -> bool:
        """Whether the base's motion was identified from that source."""
        return self.stick_slip is not None and source in [d.source for d in self.stick_slip.directions]

    def base_motion(self, sources: WrenchSources, trial: Trial, source: Source) -> BasePrediction:
        """The base from the first second of a trial and a wrench.

        Raises:
            NotEnoughData: The wrench was not recorded, or the base was not identified.
        """
        if self.stick_slip is None:
            raise NotEnoughData(f"{trial.id}: no base that slips was identified")
        sources = replace(sources, lab=replace(sources.lab, urdf=self.trains.urdf))
        return slipping_base_poses(self.stick_slip, sources, trial, source, self.trains)
