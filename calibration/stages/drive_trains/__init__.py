"""Drive trains of the joints: backlash, compliance, friction and encoder errors, identified and used.

fit_drive_trains      motor minus link readings of the calibration trials -> DriveTrains
completed             joints without a link encoder, from the hand's markers, and the geometry on link angles
DriveTrains           motor readings -> link angles with intervals
refit_geometry        the geometry on link angles, with the bending of the arm's column
hand_poses            a trial's corrected readings -> poses of the hand
stream_of             the same sample by sample
"""

from calibration.stages.drive_trains.column_bending import ColumnBending, bent
from calibration.stages.drive_trains.corrected_trial import corrected_trial, hand_poses
from calibration.stages.drive_trains.drive_train import DriveTrain, Quantity
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles
from calibration.stages.drive_trains.from_markers import completed
from calibration.stages.drive_trains.geometry_refit import refit_geometry
from calibration.stages.drive_trains.stage import fit_drive_trains
from calibration.stages.drive_trains.streams import stream_of

__all__ = [
    "ColumnBending",
    "DriveTrain",
    "DriveTrains",
    "LinkAngles",
    "Quantity",
    "bent",
    "completed",
    "corrected_trial",
    "fit_drive_trains",
    "hand_poses",
    "refit_geometry",
    "stream_of",
]
