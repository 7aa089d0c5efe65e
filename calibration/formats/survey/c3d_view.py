"""A C3D file by its parameters: labels, rates, where the plates are and in which units; not whose wrench it stores."""

from pathlib import Path

import numpy as np

from calibration.formats.c3d.file import CLOCK, C3dFile
from calibration.formats.c3d.plate import lab_wrench
from calibration.formats.c3d.read import length_unit, plate_of, times_of
from calibration.formats.c3d.write import DWELL_EVENTS
from calibration.formats.mapping.channels import Markers, Recorded
from calibration.formats.mapping.layouts import C3dPlateMap
from calibration.formats.survey.view import FileView, PlateView

_UNNAMED = "*"


def view_c3d(path: Path) -> FileView:
    """What a C3D file shows.

    Raises:
        InputError: It cannot be read, or lacks what C3D requires.
    """
    file = C3dFile(path)
    factor, (rate, start, own) = length_unit(file), times_of(file)
    labels = [n for n in file.labels("POINT") if n and not n.startswith(_UNNAMED)]
    columns = [file.labels("POINT").index(n) for n in labels]
    t = (start * rate + np.arange(file.header.frames)) / rate
    seen = file.count(CLOCK, "MOCAP_SAMPLES", len(t))
    markers = Markers(t[:seen], tuple(labels), (file.positions[:, columns] * factor)[:seen])
    used = int(file.number("FORCE_PLATFORM", "USED", 0.0))
    plates = tuple(_plate(file, k + 1, factor, used) for k in range(used))
    together = ("plate",) if plates and not own else ()
    lines = ["markers: same"]
    if set(DWELL_EVENTS) <= set(file.parameter("EVENT", "LABELS", [])):
        lines.append(f"dwell_events: [{', '.join(DWELL_EVENTS)}]")
    return FileView(path, "c3d", Recorded(str(path), markers, together=together), plates, tuple(lines))


def _plate(file: C3dFile, number: int, factor: float, used: int) -> PlateView:
    plate, channels = plate_of(file, C3dPlateMap(number=number, convention="reaction"), factor, file.analogs)
    R = plate.axes
    up = R if R[2, 2] > 0.0 else R @ np.diag([1.0, -1.0, -1.0])
    name = "plate" if used == 1 else f"plate{number}"
    return PlateView(name, lab_wrench(plate, channels), plate.centre, up.T, plate.size, f"number: {number}")
