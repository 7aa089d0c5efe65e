"""Held-out errors of predictions."""

from calibration.evaluation.budget import Budget
from calibration.evaluation.comparison import compare
from calibration.evaluation.ladder import Row, TrialErrors, ladder, trial_errors
from calibration.evaluation.marker_errors import PointRow, point_rows
from calibration.evaluation.results import Evaluation, headline
from calibration.evaluation.submission import read_submission, write_submission

__all__ = [
    "Budget",
    "Evaluation",
    "PointRow",
    "Row",
    "TrialErrors",
    "compare",
    "headline",
    "ladder",
    "point_rows",
    "read_submission",
    "trial_errors",
    "write_submission",
]
