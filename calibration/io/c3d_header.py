"""The 512-byte header of a C3D file, read without any library: what libraries get wrong without a word shows here.

Frames are counted in 16 bits, so no file holds more than 65,535, and a file that was cut short still opens.
Source: C3D user guide, header section.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

from calibration.errors import InputError

MOST_FRAMES = 65535
_BLOCK = 512
_MAGIC = 0x50
_INTEL = 84


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
    try:
        with path.open("rb") as stream:
            first, size = stream.read(_BLOCK), path.stat().st_size
            parameters = (first[0] - 1) * _BLOCK if first else 0
            stream.seek(max(parameters, 0))
            processor = stream.read(4)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})") from error
    if len(first) < _BLOCK or first[1] != _MAGIC or len(processor) < 4:
        raise InputError(path, "is no C3D file, or its head is cut off; export it again")
    if processor[3] != _INTEL:
        raise InputError(path, "was written in DEC or SGI number format; export it in Intel format")
    points, analog, begin, end = struct.unpack_from("<4H", first, 2)
    scale, start, per_frame, rate = struct.unpack_from("<f2Hf", first, 12)
    header = C3dHeader(points, analog, end - begin + 1, per_frame, rate, (start - 1) * _BLOCK, 4 if scale < 0.0 else 2)
    missing = header.data_start + header.data_bytes - size
    if missing > 0:
        raise InputError(path, f"is truncated: {missing} bytes of {header.frames} frames are missing; copy it again")
    if header.frames == MOST_FRAMES and -missing > 2 * _BLOCK:
        raise InputError(path, f"holds more than {MOST_FRAMES} frames, which C3D cannot count; split the trial")
    return header
