"""Which postures and motions to record."""

from calibration.design.base_excitation import BasePlan, base_motions
from calibration.design.exchange import Criterion
from calibration.design.plan import Comparison, Plan, Sample, Task, compared, nominal_task, plan
from calibration.design.tour_file import played

__all__ = [
    "BasePlan",
    "Comparison",
    "Criterion",
    "Plan",
    "Sample",
    "Task",
    "base_motions",
    "compared",
    "nominal_task",
    "plan",
    "played",
]
