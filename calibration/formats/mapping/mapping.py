"""The mapping file: what laboratory files do not say, asked for by name and never guessed.

Which column or label is which marker, joint or plate channel; units; whose wrench it is and about what; where markers
sit on the robot; which file is which trial. It is a YAML file of these fields, strictly validated.
"""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from calibration.errors import InputError
from calibration.formats.mapping.layouts import BagLayout, C3dLayout, CsvTable, PoseChannels, PoseTopic
from calibration.formats.mapping.poses import marker_names as pose_markers
from calibration.formats.mapping.poses import shape_of
from calibration.recording.body_on_link import body_on
from calibration.recording.declaration import (
    Declaration,
    Name,
    NonNegative,
    Number,
    Positive,
    Positive6,
    Text,
    Vector6,
    refuse_repeated,
)
from calibration.recording.schema import Body, Kind, Marker, Role, Setup


class Standing(Declaration):
    """Where the base frame stands in the first second of the first calibration trial: x, y [m, lab], heading [rad]."""

    x: float
    y: float
    heading: float


class MappedBody(Declaration):
    """A marker body.

    Attributes:
        name: Its name.
        link: The link it is fixed on.
        markers: Drawn markers, with their coordinates in the link's frame [m].
        placement: Of drawn markers, where their coordinates are not in the link's frame; see `schema.Body`.
        tolerance: Of that, where it was measured on this robot.
        pose: Columns or topic of its 6D pose, those of the table or bag (`pose: true` in the file): six markers stand
            for it.
        undrawn: Names of markers whose coordinates nobody measured: their shape is the mean over calibration trials.
        standing: Places an undrawn body on the base by where the base stands at rest.
        fitted: Places an undrawn body, or the frame of the marker positions, by the nominal robot's fit to the
            calibration postures.
    """

    name: Name
    link: Name
    markers: tuple[Marker, ...] = ()
    placement: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    tolerance: Positive6 | None = None
    pose: PoseChannels | PoseTopic | None = None
    undrawn: tuple[Name, ...] = ()
    standing: Standing | None = None
    fitted: bool = False

    @model_validator(mode="after")
    def _is_placed_once(self) -> "MappedBody":
        if self.pose is not None and (self.markers or self.undrawn or self.standing):
            raise ValueError(f"body {self.name}: its pose is recorded, so it has no markers; `fitted: true` places it")
        if self.markers and (self.undrawn or self.fitted or self.standing):
            raise ValueError(f"body {self.name}: markers are drawn, so it is neither undrawn, standing nor fitted")
        if (self.undrawn or self.fitted or self.standing) and self.fitted == (self.standing is not None):
            raise ValueError(
                f"body {self.name}: state how it is placed: `markers` with xyz, `standing`, or `fitted: true`"
            )
        return self

    @classmethod
    def of(cls, body: Body) -> "MappedBody":
        """A body of a dataset."""
        return cls.model_validate(body.model_dump())

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Of all its markers."""
        if self.pose is not None:
            return pose_markers(self.name)
        return self.undrawn or tuple(m.name for m in self.markers)

    def drawn(self) -> Body:
        """The body as it is drawn."""
        markers = self.markers
        if self.pose is not None:
            places = (tuple(map(float, x)) for x in shape_of(self.pose))
            markers = tuple(Marker(name=n, xyz=x) for n, x in zip(self.marker_names, places, strict=True))  # type: ignore[arg-type]
        return Body(name=self.name, link=self.link, markers=markers, placement=self.placement, tolerance=self.tolerance)


class MappedTrial(Declaration):
    """One trial and the file it is in.

    Attributes:
        id: Its name in the dataset.
        file: Name of the file without folder and suffix; `id` unless given.
        role: What it is for.
        kind: What moves.
        motion: Its motion; `id` unless given.
        start: Time of the file's first sample on the motion-capture clock [s], where the file does not say.
        part: From and to [s since the file's first sample]; the whole file unless given.
        payload: Mass [kg] of the declared payload in this trial, where it differs.
        dwells: Start and stop of each static posture [s, mocap clock], where the file does not say.
        approach: Sign of each joint's last motion before each posture, -1, 0 or 1.
    """

    id: Name
    file: str | None = None
    role: Role
    kind: Kind
    motion: Text | None = None
    start: Number | None = None
    part: tuple[NonNegative, Positive] | None = None
    payload: NonNegative | None = None
    dwells: tuple[tuple[Number, Number], ...] | None = None
    approach: tuple[tuple[Literal[-1, 0, 1], ...], ...] | None = None

    @model_validator(mode="after")
    def _is_consistent(self) -> "MappedTrial":
        times = [t for pair in self.dwells or () for t in pair]
        if any(b < a for a, b in pairwise(times)) or any(a == b for a, b in self.dwells or ()):
            raise ValueError(f"trial {self.id}: a dwell begins before it ends and after the one before")
        if self.part is not None and self.part[1] <= self.part[0]:
            raise ValueError(f"trial {self.id}: part begins before it ends")
        if self.approach is not None and len({len(row) for row in self.approach}) > 1:
            raise ValueError(f"trial {self.id}: rows of approach are of different lengths")
        return self

    @property
    def stem(self) -> str:
        """Name of its file without folder and suffix."""
        return self.file or self.id


class Mapping(Declaration):
    """The whole mapping file.

    Attributes:
        urdf: The nominal robot: a path relative to the mapping file, or `tiago`, which comes with this program.
        setup: The robot and its instruments, as in dataset.json.
        bodies: The marker bodies.
        trials: The trials.
        files: The files, paths or patterns beside the mapping file, where none are named on the command line.
        reversed_effort: Joints whose drives count the motor current against the joint's own direction.
        csv: Kinds of CSV files.
        c3d: What is what in the C3D files.
        bag: What is what in the bags.
    """

    urdf: Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$")]
    setup: Setup
    bodies: tuple[MappedBody, ...]
    trials: Annotated[tuple[MappedTrial, ...], Field(min_length=1)]
    files: tuple[str, ...] = ()
    reversed_effort: tuple[str, ...] = ()
    csv: tuple[CsvTable, ...] = ()
    c3d: C3dLayout | None = None
    bag: BagLayout | None = None

    @property
    def base_name(self) -> str:
        """Of the marker body on the base frame; empty where there is none."""
        found = body_on(self.bodies, self.setup.base_frame)
        return found.name if found else ""

    @property
    def hand_name(self) -> str:
        """Of the marker body on the tool frame; empty where there is none."""
        found = body_on(self.bodies, self.setup.tool_frame, self.setup.base_frame)
        return found.name if found else ""

    @model_validator(mode="after")
    def _names_fit(self) -> "Mapping":
        refuse_repeated(
            bodies=[b.name for b in self.bodies],
            markers=[name for b in self.bodies for name in b.marker_names],
            trials=[t.id for t in self.trials],
        )
        unknown = sorted(set(self.reversed_effort) - set(self.setup.joint_names))
        if unknown:
            raise ValueError(f"reversed_effort: {unknown} are no joints of the setup")
        return self


@dataclass(frozen=True)
class MappingFile:
    """A mapping file as it was read.

    Attributes:
        path: Where, for messages.
        content: What it says.
        urdf: Text of the nominal robot it names.
    """

    path: Path
    content: Mapping
    urdf: str

    def error(self, place: str, message: str) -> InputError:
        """An error of the mapping file, or of what it does not fit."""
        return InputError(self.path, f"{place}: {message}")
