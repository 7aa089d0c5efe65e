"""One robot in its laboratory: its dataset and its truth."""

from twin.campaign.dataset_description import describe_dataset
from twin.campaign.laboratory import EPOCH, Laboratory, laboratory, second_session
from twin.campaign.measure import measure
from twin.campaign.record import record
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
