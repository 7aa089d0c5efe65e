"""Which postures and motions to record."""

from calibration.design.exchange import Criterion
from calibration.design.next_motions import drive_next, sweeps_next, swings_next
from calibration.design.next_postures import record_next
from calibration.design.plan import Comparison, Plan, Sample, Task, compared, nominal_task, plan
from calibration.design.tour_file import played

__all__ = [
    "Comparison",
    "Criterion",
    "Plan",
    "Sample",
    "Task",
    "compared",
    "drive_next",
    "nominal_task",
    "plan",
    "played",
    "record_next",
    "sweeps_next",
    "swings_next",
]
