"""Held-out errors of predictions."""

from calibration.evaluation.comparison import compare
from calibration.evaluation.ladder import Row, TrialErrors, ladder, scored_errors
from calibration.evaluation.main_row import headline
from calibration.evaluation.marker_errors import PointRow, point_rows
from calibration.evaluation.pose_errors import pose_errors
from calibration.evaluation.results import Evaluation
from calibration.evaluation.submission import read_submission, write_submission

__all__ = [
    "Evaluation",
    "PointRow",
    "Row",
    "TrialErrors",
    "compare",
    "headline",
    "ladder",
    "point_rows",
    "pose_errors",
    "read_submission",
    "scored_errors",
    "write_submission",
]
