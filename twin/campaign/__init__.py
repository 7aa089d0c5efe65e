"""One robot in its laboratory: its dataset and its truth."""

from twin.campaign.dataset_description import describe_dataset
from twin.campaign.laboratory_model import EPOCH, Laboratory, laboratory, second_session
from twin.campaign.measurement import measure
from twin.campaign.recording import record
from twin.campaign.robot import Robot, sample

__all__ = [
    "EPOCH",
    "Laboratory",
    "Robot",
    "describe_dataset",
    "laboratory",
    "measure",
    "record",
    "sample",
    "second_session",
]
