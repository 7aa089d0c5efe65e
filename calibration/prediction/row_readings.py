"""Joint readings that the geometry of a row is evaluated at: motor's, corrected, behind the drive trains, or link's."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.errors import NotEnoughData
from calibration.estimate.rows import Encoder, LadderRow, row_of
from calibration.mocap.postures import readings_at
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.stages.bundle.robot import BundledRobot
from calibration.stages.joints.correction import Corrected, JointModels, correct
from calibration.stages.joints.samples import aligned_link_readings

Side = Literal["motor", "corrected", "bundled", "bundled link", "link"]


@dataclass(frozen=True)
class RowReadings:
    """Readings of a trial for each row.

    Attributes:
        robot: The robot's clock on the motion capture's; None where it is not known.
        joints: The published joint models; None without.
        bundled: Drive trains of row `full`; None without.
    """

    robot: Clock | None
    joints: JointModels | None
    bundled: BundledRobot | None

    def positions(self, name: str, encoder: Encoder, trial: Trial) -> np.ndarray:
        """Joint positions (n, n_joints) [rad, m] the geometry is evaluated at, at the motion capture's times.

        The base is measured throughout the trial, by which other sessions are registered.
        """
        side = self.side(row_of(name), encoder)
        if side == "bundled" and self.bundled is not None and self.robot is not None:
            return self.of(side, trial, self.bundled.corrected(trial, self.robot).trial.q_motor)
        corrected = self.corrected(trial) if side == "corrected" else None
        return self.of(side, trial, None if corrected is None else corrected.q)

    def side(self, row: LadderRow, encoder: Encoder) -> Side:
        """Which readings the geometry of a row is evaluated at."""
        if row.bundle and self.bundled is not None and self.bundled.trains.trains:
            return "bundled" if encoder == "motor" else "bundled link"
        if self.joints is None or (encoder == "motor" and not row.joints):
            return "motor"
        return "link" if encoder == "link" else "corrected"

    def of(self, side: Side, trial: Trial, corrected: np.ndarray | None) -> np.ndarray:
        """Readings (n, n_joints) [rad, m] of a side of the gears, or corrected ones, at the motion capture's times."""
        if self.robot is None or not len(trial.t_robot):
            raise NotEnoughData(f"{trial.id}: no joint readings on a known clock, so no hand pose can be predicted")
        readings = trial.q_motor
        if side == "link" and self.joints is not None:
            readings = aligned_link_readings(trial, self.joints.zero)
        elif side != "motor" and corrected is not None:
            readings = corrected
        return readings_at(trial, self.robot, trial.t_mocap, readings)

    def corrected(self, trial: Trial) -> Corrected | None:
        """Readings corrected by the joint models; None without."""
        if self.joints is None or not len(trial.t_robot):
            return None
        return correct(self.joints.of_trial(trial.id), trial.t_robot, trial.q_motor)
