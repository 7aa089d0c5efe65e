"""What instruments read of a simulation: log, motion capture, force plates, wrist sensor, clocks."""

from twin.instruments.clock import Clock
from twin.instruments.encoder import Encoder
from twin.instruments.force_plate import PlateDefect, sample_plate
from twin.instruments.instrument import Instrument
from twin.instruments.markers import Cluster, LooseMarker
from twin.instruments.wrist_sensor import WristDefect

INSTRUMENTS: tuple[type[Instrument], ...] = ()
"""Those that a scenario may list under `twin.instruments.further`, by their `kind`."""

__all__ = [
    "INSTRUMENTS",
    "Clock",
    "Cluster",
    "Encoder",
    "Instrument",
    "LooseMarker",
    "PlateDefect",
    "WristDefect",
    "sample_plate",
]
