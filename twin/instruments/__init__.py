"""What instruments read of a simulation: log, motion capture, force plates, wrist sensor, clocks."""

from twin.instruments.clock import Clock
from twin.instruments.encoder import Encoder
from twin.instruments.force_plate import PlateDefect, sample_plate
from twin.instruments.markers import Cluster, LooseMarker
from twin.instruments.wrist_sensor import WristDefect

__all__ = [
    "Clock",
    "Cluster",
    "Encoder",
    "LooseMarker",
    "PlateDefect",
    "WristDefect",
    "sample_plate",
]
