"""6D poses in the columns of a CSV file, by their names.

A rigid body is three columns of a position and three or four of a rotation with the same beginning: qx..qw, rx..rz,
Rotation X..W, roll, pitch, yaw (OptiTrack, Vicon, Qualisys). Which three numbers a rotation is, and how well a system
measures it, no file states: both are to be chosen; the import checks the order with the robot.
"""

import re
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from calibration.formats.csv.read import CsvText
from calibration.formats.mapping.layouts import PoseChannels
from calibration.formats.mapping.poses import marker_names, markers_at
from calibration.formats.survey.view import CHOOSE, GUESS, flow

_ROTATION = re.compile(r"^(?P<body>.*?)[\W_]*(?:(?:rot(?:ation)?|quat(?:ernion)?)[\W_]*|[qr])(?P<axis>[xyzw])$", re.I)
_ANGLES = re.compile(r"^(?P<body>.*?)[\W_]*(?P<axis>roll|pitch|yaw)$", re.I)
_POSITION = re.compile(r"^(?P<body>.*?)[\W_]*(?:(?:pos(?:ition)?|trans(?:lation)?|[tp])[\W_]*)?(?P<axis>[xyz])$", re.I)
_KINDS = ((_ROTATION, "xyzw", "quat_xyzw"), (_ROTATION, "xyz", "rotation_vector"))
SIGMAS = {"sigma_position": 2e-4, "sigma_rotation": 1e-3}  # [m], [rad] of a body of 0.2 m in motion capture
TYPICAL = "standard deviations per axis, those of motion capture [m, rad]"
_FAR, _TURN = 30.0, 2.0 * np.pi
UNNAMED = "body"


@dataclass(frozen=True)
class PoseColumns:
    """The pose of a rigid body: its name and what the mapping says of it."""

    name: str
    channels: PoseChannels

    @property
    def columns(self) -> tuple[str, ...]:
        """All of them."""
        return (*self.channels.position, *self.channels.rotation)

    @property
    def markers(self) -> tuple[str, ...]:
        """Names of the markers that stand for it."""
        return marker_names(self.name)

    def positions(self, text: CsvText) -> np.ndarray:
        """Positions (n, 6, 3) [m] of those markers.

        Raises:
            ValueError: The numbers are no pose.
        """
        p, x = (text.numbers(c, gaps=True) for c in (self.channels.position, self.channels.rotation))
        return markers_at(p, x, self.channels)


def poses_in(text: CsvText, others: AbstractSet[str | None]) -> tuple[PoseColumns, ...]:
    """Poses of rigid bodies in columns that are not `others`."""
    known, found = [c for c in text.header if c not in others], dict[str, PoseColumns]()
    position = _of(_POSITION, known)
    for pattern, axes, order in (*_KINDS, (_ANGLES, ("roll", "pitch", "yaw"), "euler_XYZ")):
        for body, of in _of(pattern, known).items():
            place = position.get(body, {})
            if body in found or not ({*axes} <= of.keys() and {*"xyz"} <= place.keys()):
                continue
            channels = _channels(text, [place[a] for a in "xyz"], [of[a] for a in axes], order)
            found[body] = PoseColumns(re.sub(r"\W", "_", body) or UNNAMED, channels)
    return tuple(found.values())


def lines_of(poses: Sequence[PoseColumns]) -> Iterator[str]:
    """The lines of the mapping."""
    if poses:
        yield "poses:"
    for p in poses:
        known = p.channels.order.startswith("quat")
        what = (
            f"{GUESS}: " if known else f"{CHOOSE}: which three numbers (rotation_vector, euler_XYZ, euler_zyx, ...); "
        )
        fields = flow(p.channels.model_dump(exclude_defaults=True))
        yield f"  {flow(p.name)}: {fields}  {what}{TYPICAL}"


def _of(pattern: re.Pattern[str], columns: list[str]) -> dict[str, dict[str, str]]:
    """Columns by axis, by body."""
    found: dict[str, dict[str, str]] = {}
    for column in columns:
        if match := pattern.match(column):
            found.setdefault(match["body"], {}).setdefault(match["axis"].lower(), column)
    return found


def _channels(text: CsvText, position: list[str], rotation: list[str], order: str) -> PoseChannels:
    """With the units that the sizes of the numbers show."""
    p, x = (np.abs(text.numbers(columns, gaps=True)) for columns in (position, rotation))
    units = {"position_unit": "mm"} if float(np.nanmedian(p)) > _FAR else {}
    units |= {"angle_unit": "deg"} if order[:4] != "quat" and float(np.nanmax(x)) > _TURN else {}
    return PoseChannels.model_validate({"position": position, "rotation": rotation, "order": order, **units, **SIGMAS})
