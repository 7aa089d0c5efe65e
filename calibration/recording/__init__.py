"""The recording format: dataset.json, trials and their netCDF files; `schema` and `netcdf` are namespaces."""

from calibration.recording.clock import Clock
from calibration.recording.dataset import Dataset, load
from calibration.recording.experiment import ExperimentPlan, plans_text, read_plans
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description, TrialEntry
from calibration.recording.trial import Trial, read_trial, write_trial

__all__ = [
    "Clock",
    "Dataset",
    "Description",
    "ExperimentPlan",
    "PostureMeans",
    "Trial",
    "TrialEntry",
    "load",
    "plans_text",
    "read_plans",
    "read_trial",
    "write_trial",
]
