"""A C3D file as ezc3d has it: parameters by name, labels in one list, points and analog channels as (time, channel)."""

from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import InputError
from calibration.io.c3d_header import checked_header

CLOCK = "CLOCK"
"""Group with each instrument's own time, as text: see `c3d_write`."""


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
