"""A C3D file as markers and plates, in SI units, the plates as ACTION, lab axes, about the setup's surface centre.

A C3D file says where its plates are and in which units it is, but not whose wrench it stores nor when it began. The
second may stand in a group CLOCK (`c3d_write` puts it there); otherwise it is the mapping's `start`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibration.errors import InputError
from calibration.io.assemble import Reader
from calibration.io.c3d_file import CLOCK, C3dFile
from calibration.io.c3d_read_plates import read_plates
from calibration.io.layouts import LENGTHS, C3dLayout
from calibration.io.recorded import Markers, Recorded
from calibration.schema import Setup


def read_c3d(files: Sequence[Path], layout: C3dLayout, setup: Setup) -> Recorded:
    """What the file of one trial holds.

    Raises:
        InputError: Something in it is not as the mapping says, or not as C3D has it.
    """
    if len(files) > 1:
        raise InputError(files[1], f"one C3D file a trial; {files[0]} has the same name")
    file = C3dFile(files[0])
    factor = _length_unit(file)
    rate, start, own = _times(file)
    t = (start * rate + np.arange(file.header.frames)) / rate
    markers = _markers(file, layout, factor, t)
    plates, notes = read_plates(file, layout, setup, factor, start)
    if plates is not None and not own:
        notes = (*notes, f"{file.path.name}: no {CLOCK} group: plates sampled with the markers, on one clock")
    dwells = _dwells(file, layout, start)
    seen = len(t) if own is None else int(own.get("MOCAP_SAMPLES", len(t)))
    markers = Markers(t[:seen], markers.names, markers.position[:seen])
    together = ("plate",) if plates is not None and not own else ()
    return Recorded(str(file.path), markers, plates=plates, dwells=dwells, together=together, notes=notes)


def _length_unit(file: C3dFile) -> float:
    units = file.parameter("POINT", "UNITS", [])
    if len(units) != 1 or units[0] not in LENGTHS:
        raise InputError(file.path, f"POINT:UNITS is {units}, expected mm or m; set it in the exporting program")
    return LENGTHS[units[0]]


def _times(file: C3dFile) -> tuple[float, float, dict[str, float]]:
    """Marker rate [Hz], time of the first frame [s], and the file's own clocks."""
    rate = float(np.ravel(file.parameter("POINT", "RATE", [0.0]))[0])
    if not rate > 0.0:
        raise InputError(file.path, f"POINT:RATE is {rate}; export the file again")
    _check_ratio(file, rate)
    own = {}
    for name in ("MOCAP_START", "PLATE_START", "MOCAP_SAMPLES", "PLATE_SAMPLES"):
        value = file.parameter(CLOCK, name)
        if value is not None:
            own[name] = float(value[0])
    return rate, own.get("MOCAP_START", 0.0), own


def _check_ratio(file: C3dFile, rate: float) -> None:
    header = file.header
    if not header.analog:
        return
    analog = float(np.ravel(file.parameter("ANALOG", "RATE", [0.0]))[0])
    if header.per_frame < 1 or abs(analog - rate * header.per_frame) > 1e-3 * rate:
        raise InputError(
            file.path,
            f"ANALOG:RATE {analog:g} Hz is not {header.per_frame} times POINT:RATE {rate:g} Hz: samples were dropped "
            "or renamed; record the plates at a multiple of the marker rate and export again",
        )


def _markers(file: C3dFile, layout: C3dLayout, factor: float, t: np.ndarray) -> Markers:
    labels = file.labels("POINT")
    missing = [label for label in layout.markers.values() if label not in labels]
    if missing:
        raise InputError(file.path, f"POINT:LABELS: no {missing}; the file has {labels}; correct the mapping file")
    columns = [labels.index(label) for label in layout.markers.values()]
    return Markers(t, tuple(layout.markers), file.positions[:, columns] * factor)


def _dwells(file: C3dFile, layout: C3dLayout, start: float) -> np.ndarray | None:
    """Start and stop of the static postures (n, 2) [s, mocap clock] from the file's events."""
    if layout.dwell_events is None:
        return None
    labels, times = file.parameter("EVENT", "LABELS", []), file.parameter("EVENT", "TIMES")
    if not labels:
        return None
    pairs = []
    for wanted in layout.dwell_events:
        at = [60.0 * m + s for label, m, s in zip(labels, *np.reshape(times, (2, -1)), strict=True) if label == wanted]
        pairs.append(np.sort(at) + start)
    if len(pairs[0]) != len(pairs[1]):
        raise InputError(file.path, f"EVENT: {len(pairs[0])} events {layout.dwell_events[0]!r} and {len(pairs[1])} "
                         f"{layout.dwell_events[1]!r}; mark both ends of each posture")  # fmt: skip
    return np.stack(pairs, axis=1)


def c3d_reader(layout: C3dLayout, setup: Setup) -> Reader:
    """C3D files by the layout of a mapping."""
    return Reader(lambda files: read_c3d(files, layout, setup), lambda path: path.stem)
