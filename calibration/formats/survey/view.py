"""What one laboratory file shows, in SI units, before anybody declared anything."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration.formats.mapping.channels import Recorded

CHOOSE = "# CHOOSE"
"""Mark of lines that state what no file does."""
GUESS = "# GUESS"
"""Mark of lines that the files make probable, with the reason: to be edited only where it is wrong."""
WHOSE = f"  {CHOOSE}: whose wrench, `action` of the hand on the sensor or the sensor's `reaction`"
WRIST = re.compile(r"wrist|(^|[_/])ft($|[_/])", re.IGNORECASE)
"""Names of a wrist's force-torque sensor."""
_PLAIN = re.compile(r"^[A-Za-z_][\w./-]*$")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}


@dataclass(frozen=True)
class PlateView:
    """A force plate as a file has it.

    Attributes:
        name: Of its columns or number.
        wrench: (n, 6) as stored, lab axes where the file states them [N, N.m].
        centre: (3,) surface centre [m, lab]; NaN where the file does not show it.
        axes: (3, 3) its axes as rows [lab].
        size: Edge lengths [m]; NaN where not known.
        layout: Its line of the mapping, without the convention.
        force: Columns of its force, where a column has a name.
    """

    name: str
    wrench: np.ndarray
    centre: np.ndarray
    axes: np.ndarray
    size: tuple[float, float]
    layout: str
    force: tuple[str, ...] = ()

    @property
    def convention(self) -> str:
        """Whose wrench it must be for the robot to press down."""
        return "action" if float(np.nanmedian(self.wrench[:, 2])) < 0.0 else "reaction"


@dataclass(frozen=True)
class FileView:
    """One file.

    Attributes:
        path: The file.
        kind: csv, c3d or bag.
        recorded: Its markers, joints or posture means [m, rad, s].
        plates: Its force plates.
        layout: Lines of the mapping that describe the file; files with the same lines are of one table.
        left: Columns, labels or topics that are not mapped.
    """

    path: Path
    kind: str
    recorded: Recorded
    plates: tuple[PlateView, ...] = ()
    layout: tuple[str, ...] = ()
    left: tuple[str, ...] = ()


def flow(value: object) -> str:
    """A value in one line of YAML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(k)}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(v) for v in value) + "]"
    if isinstance(value, str) and (not _PLAIN.match(value) or value.lower() in _WORDS):
        return "'" + value.replace("'", "''") + "'"
    return str(value)
