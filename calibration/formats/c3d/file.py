"""The 512-byte header of a C3D file, read without any library: what libraries get wrong without a word shows here.

Frames are counted in 16 bits, so no file holds more than 65,535, and a file that was cut short still opens.
Source: C3D user guide, header section.

A C3D file as ezc3d has it: parameters by name, labels in one list, points and analog channels as (time, channel).
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError
from calibration.formats.c3d.parameters import faults
from calibration.untrusted import check_file

MOST_FRAMES = 65535
_BLOCK = 512
_MOST_BYTES, _SECTION = 128 * 2**20, 255 * 512  # [B] of a file, which take ten times as much in memory; of parameters
_MOST_RATE = 1e5  # [Hz]
_MAGIC = 0x50
_INTEL = 84
CLOCK = "CLOCK"
"""Group with each instrument's own time, as text: see `c3d_write`."""


@dataclass(frozen=True)
class C3dHeader:
    """Counts of a C3D file.

    Attributes:
        points: Markers a frame.
        analog: Analog values a frame, all channels.
        frames: Frames.
        per_frame: Analog samples a frame.
        rate: Frames a second [Hz].
        data_start: First byte of the data.
        value_bytes: 4 for float32 data, 2 for integers.
    """

    points: int
    analog: int
    frames: int
    per_frame: int
    rate: float
    data_start: int
    value_bytes: int

    @property
    def data_bytes(self) -> int:
        """Bytes of all frames."""
        return self.frames * (4 * self.points + self.analog) * self.value_bytes


def checked_header(path: Path) -> C3dHeader:
    """Header of a file of the right length.

    Raises:
        InputError: It is no C3D file, was written on a machine with other numbers, is truncated, or holds more frames
            than it can say.
    """
    check_file(path, _MOST_BYTES)
    try:
        with path.open("rb") as stream:
            first, size = stream.read(_BLOCK), path.stat().st_size
            parameters = (first[0] - 1) * _BLOCK if first else 0
            stream.seek(max(parameters, 0))
            section = stream.read(_SECTION)
            processor = section[:4]
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})") from error
    if len(first) < _BLOCK or first[1] != _MAGIC or len(processor) < 4:
        raise InputError(path, "is no C3D file, or its head is cut off; export it again")
    if processor[3] != _INTEL:
        raise InputError(path, "was written in DEC or SGI number format; export it in Intel format")
    points, analog, begin, end = struct.unpack_from("<4H", first, 2)
    scale, start, per_frame, rate = struct.unpack_from("<f2Hf", first, 12)
    header = C3dHeader(points, analog, end - begin + 1, per_frame, rate, (start - 1) * _BLOCK, 4 if scale < 0.0 else 2)
    if header.frames < 1 or not 0.0 < header.rate < _MOST_RATE or not parameters < header.data_start:
        raise InputError(path, f"has {header.frames} frames at {header.rate:g} Hz by its header; export it again")
    channels = header.analog // max(header.per_frame, 1)
    if channels * max(header.per_frame, 1) != header.analog:
        raise InputError(
            path, f"has {header.analog} analog values in {header.per_frame} samples a frame; export it again"
        )
    for fault in faults(section[: header.data_start - parameters], {"points": points, "channels": channels}):
        raise InputError(path, f"is no C3D file, or damaged: {fault}; export it again")
    missing = header.data_start + header.data_bytes - size
    if missing > 0:
        raise InputError(path, f"is truncated: {missing} bytes of {header.frames} frames are missing; copy it again")
    if header.frames == MOST_FRAMES and -missing > 2 * _BLOCK:
        raise InputError(path, f"holds more than {MOST_FRAMES} frames, which C3D cannot count; split the trial")
    return header


class C3dFile:
    """Parameters and data of a file, by name."""

    def __init__(self, path: Path) -> None:
        import ezc3d

        self.path, self.header = path, checked_header(path)
        try:
            self._c3d: Any = ezc3d.c3d(str(path))
        except (RuntimeError, OSError, ValueError, IndexError) as error:
            raise InputError(path, f"cannot be read as C3D ({error}); export it again") from error

    def parameter(self, group: str, name: str, default: Any = None) -> Any:
        """A parameter's value; text is stripped."""
        found = self._c3d["parameters"].get(group, {}).get(name)
        if found is None:
            return default
        value = found["value"]
        return [v.strip() for v in value] if isinstance(value, list) else value

    def number(self, group: str, name: str, default: float | None = None) -> float:
        """The first value of a parameter, which may be written as text.

        Raises:
            InputError: It is missing without a default, empty, or no finite number.
        """
        value = np.ravel(self.parameter(group, name, [default]))
        try:
            found = float(value[0])
        except (IndexError, TypeError, ValueError):
            found = np.nan
        if not np.isfinite(found):
            raise InputError(self.path, f"{group}:{name} is {value.tolist()}, expected a number; export the file again")
        return found

    def count(self, group: str, name: str, most: int) -> int:
        """A number of samples of those the file has: `most` where the parameter is missing.

        Raises:
            InputError: It is not from 1 to `most`.
        """
        found = self.number(group, name, most)
        if not 1 <= found <= most:
            raise InputError(self.path, f"{group}:{name} is {found:g}, the file has {most}; export the file again")
        return int(found)

    def array(self, group: str, name: str, least: tuple[int, ...]) -> np.ndarray:
        """A parameter's values as numbers, with at least so many along each axis.

        Raises:
            InputError: It is missing or has fewer.
        """
        value = self.parameter(group, name, [])
        found = np.asarray([] if isinstance(value, list) else value, dtype=float)  # text is a list
        if found.ndim != len(least) or any(n < m for n, m in zip(found.shape, least, strict=True)):
            raise InputError(
                self.path, f"{group}:{name} has {found.shape} values, expected {least} or more; export the file again"
            )
        return found

    def labels(self, group: str) -> list[str]:
        """LABELS, LABELS2, ... in one."""
        found: list[str] = []
        for k in range(1, 1 + 1 + self.header.points // 255 + self.header.analog // 255):
            found += self.parameter(group, "LABELS" if k == 1 else f"LABELS{k}", [])
        return found

    @property
    def positions(self) -> np.ndarray:
        """Points (n, m, 3) in POINT:UNITS; ezc3d gives NaN where the residual is negative."""
        return np.asarray(np.moveaxis(self._c3d["data"]["points"][:3], 0, 2).swapaxes(0, 1), dtype=float)

    @property
    def analogs(self) -> np.ndarray:
        """Analog channels (n, c), scaled."""
        return np.asarray(self._c3d["data"]["analogs"][0].T, dtype=float)
