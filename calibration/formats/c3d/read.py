"""Markers and force plates of a C3D file, in SI units, plates as ACTION, lab axes, about the setup's surface centre.

What the file states of a plate is taken from it and compared with the setup; whose wrench it stores is the mapping's.
When it began may stand in a group CLOCK (`c3d_write` puts it there); otherwise it is the mapping's `start`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibration.errors import InputError
from calibration.formats.c3d.file import CLOCK, C3dFile
from calibration.formats.c3d.plate import C3dPlate, lab_wrench, negated_origin
from calibration.formats.mapping.channels import Markers, Plates, Recorded
from calibration.formats.mapping.layouts import LENGTHS, MOMENT_NAMES, MOMENTS, C3dLayout, C3dPlateMap
from calibration.numerics.wrench import moved_to
from calibration.recording.schema import Plate, Setup

_SAME_PLACE = 2e-3  # [m] a plate may be off the setup's
_SAME_WAY = 0.999  # cosine between its x axis and the setup's


def read_plates(
    file: C3dFile, layout: C3dLayout, setup: Setup, factor: float, start: float
) -> tuple[Plates | None, tuple[str, ...]]:
    """Plates of a file whose first frame is at `start` [s], lengths in `factor` [m], and what was recognised.

    Raises:
        InputError: A plate is not what the mapping and the setup say.
    """
    if not layout.plates:
        return None, ()
    known, wrenches, notes = {p.name: p for p in setup.plates}, [], []
    analogs = file.analogs
    for name, mapped in layout.plates.items():
        if name not in known:
            raise InputError(file.path, f"plate {name!r} of the mapping is not in its setup, which has {sorted(known)}")
        plate, channels = plate_of(file, mapped, factor, analogs)
        _check_place(file, name, plate, known[name])
        stored = moved_to(lab_wrench(plate, channels), plate.centre, np.array(known[name].centre))
        wrenches.append(stored if mapped.convention == "action" else -stored)
        notes.append(f"plate {name}: type {plate.type}, {mapped.convention} as declared, place as in the setup")
    rate = file.number("ANALOG", "RATE")
    begin = file.number(CLOCK, "PLATE_START", start)
    n = file.count(CLOCK, "PLATE_SAMPLES", len(analogs))
    t = (begin * rate + np.arange(n)) / rate
    centre = np.array([known[name].centre for name in layout.plates])
    return Plates(t, tuple(layout.plates), np.stack(wrenches, axis=1)[:n], centre), tuple(notes)


def plate_of(file: C3dFile, mapped: C3dPlateMap, factor: float, analogs: np.ndarray) -> tuple[C3dPlate, np.ndarray]:
    """A plate's parameters and its six channels, SI; type 4 channels stay volts."""
    k, used = mapped.number - 1, int(file.number("FORCE_PLATFORM", "USED", 0.0))
    if k >= used:
        raise InputError(file.path, f"FORCE_PLATFORM:USED is {used}, there is no plate {mapped.number}")
    kind = int(file.array("FORCE_PLATFORM", "TYPE", (k + 1,))[k])
    if kind not in (2, 4):
        raise InputError(file.path, f"plate {mapped.number} is of type {kind}; export it as type 2 or 4")
    chosen = file.array("FORCE_PLATFORM", "CHANNEL", (6, k + 1))[:6, k].astype(int) - 1
    if chosen.min() < 0 or chosen.max() >= analogs.shape[1]:
        raise InputError(
            file.path,
            f"FORCE_PLATFORM:CHANNEL gives plate {mapped.number} the channels {(chosen + 1).tolist()}, "
            f"the file has 1 to {analogs.shape[1]}; export it again with all channels of the plate",
        )
    moments = _moment_unit(file, chosen, mapped, kind, factor)
    scale = np.repeat([1.0, moments], 3)
    matrix = np.diag(scale)
    if kind == 4:
        matrix = scale[:, None] * file.array("FORCE_PLATFORM", "CAL_MATRIX", (6, 6, k + 1))[:6, :6, k]
    corners = file.array("FORCE_PLATFORM", "CORNERS", (3, 4, k + 1))[:3, :4, k] * factor
    origin = file.array("FORCE_PLATFORM", "ORIGIN", (3, k + 1))[:3, k] * factor
    plate = C3dPlate(kind, corners, origin, matrix)
    if mapped.origin == "surface_to_transducer":
        plate = negated_origin(plate)
    if plate.origin[2] > 0.0:
        raise InputError(
            file.path,
            f"plate {mapped.number}: ORIGIN z is {1e3 * plate.origin[2]:+.1f} mm, the transducer above the surface; "
            "if the program stores it the other way round, map `origin: surface_to_transducer`, else mend the file",
        )
    return plate, analogs[:, chosen]


def _moment_unit(file: C3dFile, chosen: np.ndarray, mapped: C3dPlateMap, kind: int, factor: float) -> float:
    """Moments' unit in N.m: of the channels where they are forces, of the mapping where the file is silent."""
    units = file.parameter("ANALOG", "UNITS", [])
    stated = {units[c] for c in chosen if c < len(units)} if kind == 2 else set()
    forces, moments = stated & {"N"}, {MOMENT_NAMES[u] for u in stated if u in MOMENT_NAMES}
    strange = stated - {"N"} - MOMENT_NAMES.keys() - {""}
    if strange:
        raise InputError(file.path, f"ANALOG:UNITS of plate {mapped.number} are {sorted(stated)}, expected N and N.mm")
    declared = {mapped.moment_unit} if mapped.moment_unit else set()
    if len(moments | declared) != 1 or (kind == 2 and not forces and not declared):
        raise InputError(
            file.path,
            f"plate {mapped.number}: ANALOG:UNITS are {sorted(stated) or 'nothing'} and the mapping "
            f"{mapped.moment_unit or 'nothing'} of its moments; map the right `moment_unit`",
        )
    return MOMENTS[(moments | declared).pop()]


def _check_place(file: C3dFile, name: str, plate: C3dPlate, declared: Plate) -> None:
    """The plate must be where the setup has it, its z axis down."""
    try:
        R = plate.axes
    except ValueError as error:
        raise InputError(
            file.path, f"plate {name}: CORNERS: {error}; mend the plate in the exporting program"
        ) from error
    if R[2, 2] > 0.0:
        raise InputError(
            file.path,
            f"plate {name}: CORNERS put its z axis upwards: their order mirrors the centre of pressure, or the plate "
            "is upside down; mend it in the exporting program",
        )
    off = float(np.linalg.norm(plate.centre - declared.centre))
    along = float(R[:, 0] @ np.array(declared.axes[0]))
    if off > _SAME_PLACE or along < _SAME_WAY:
        raise InputError(
            file.path,
            f"plate {name}: the file puts its centre at {np.round(plate.centre, 4).tolist()} m and its x axis along "
            f"{np.round(R[:, 0], 3).tolist()}, the setup at {list(declared.centre)} m along {list(declared.axes[0])}; "
            "correct the one that is wrong",
        )


def read_c3d(files: Sequence[Path], layout: C3dLayout, setup: Setup) -> Recorded:
    """What the file of one trial holds.

    Raises:
        InputError: Something in it is not as the mapping says, or not as C3D has it.
    """
    if len(files) > 1:
        raise InputError(files[1], f"one C3D file a trial; {files[0]} has the same name")
    file = C3dFile(files[0])
    factor = length_unit(file)
    rate, start, own = times_of(file)
    t = (start * rate + np.arange(file.header.frames)) / rate
    markers = _markers(file, layout, factor, t)
    plates, notes = read_plates(file, layout, setup, factor, start)
    if plates is not None and not own:
        notes = (*notes, f"{file.path.name}: no {CLOCK} group: plates sampled with the markers, on one clock")
    dwells = _dwells(file, layout, start)
    seen = file.count(CLOCK, "MOCAP_SAMPLES", len(t))
    markers = Markers(t[:seen], markers.names, markers.position[:seen])
    together = ("plate",) if plates is not None and not own else ()
    return Recorded(str(file.path), markers, plates=plates, dwells=dwells, together=together, notes=notes)


def length_unit(file: C3dFile) -> float:
    """POINT:UNITS [m]."""
    units = file.parameter("POINT", "UNITS", [])
    if len(units) != 1 or units[0] not in LENGTHS:
        raise InputError(file.path, f"POINT:UNITS is {units}, expected mm or m; set it in the exporting program")
    return LENGTHS[units[0]]


def times_of(file: C3dFile) -> tuple[float, float, bool]:
    """Marker rate [Hz], time of the first frame [s], and whether the file states the instruments' own clocks."""
    rate = file.number("POINT", "RATE", 0.0)
    if not rate > 0.0:
        raise InputError(file.path, f"POINT:RATE is {rate}; export the file again")
    _check_ratio(file, rate)
    own = file.parameter(CLOCK, "MOCAP_START") is not None
    return rate, file.number(CLOCK, "MOCAP_START", 0.0), own


def _check_ratio(file: C3dFile, rate: float) -> None:
    header = file.header
    if not header.analog:
        return
    analog = file.number("ANALOG", "RATE", 0.0)
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
    labels, times = file.parameter("EVENT", "LABELS", []), np.ravel(file.parameter("EVENT", "TIMES", []))
    if not labels:
        return None
    if len(times) != 2 * len(labels):
        text = f"EVENT:TIMES has {len(times)} values, expected minutes and seconds of {len(labels)} LABELS"
        raise InputError(file.path, f"{text}; export it again")
    pairs = []
    for wanted in layout.dwell_events:
        at = [60.0 * m + s for label, m, s in zip(labels, *np.reshape(times, (2, -1)), strict=True) if label == wanted]
        pairs.append(np.sort(at) + start)
    if len(pairs[0]) != len(pairs[1]):
        raise InputError(file.path, f"EVENT: {len(pairs[0])} events {layout.dwell_events[0]!r} and {len(pairs[1])} "
                         f"{layout.dwell_events[1]!r}; mark both ends of each posture")  # fmt: skip
    return np.stack(pairs, axis=1)
