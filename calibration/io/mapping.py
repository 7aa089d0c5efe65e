"""The mapping file: what laboratory files do not say, asked for by name and never guessed.

Which column or label is which marker, joint or plate channel; units; whose wrench it is and about what; where markers
sit on the robot; which file is which trial. It is a YAML file of these fields, strictly validated.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from calibration.errors import InputError
from calibration.schema import Body, Declaration, Kind, Marker, NonNegative, Positive, Role, Setup, Vector6

Columns = tuple[str, str, str]
LENGTHS = {"m": 1.0, "mm": 1e-3}
ANGLES = {"rad": 1.0, "deg": 0.017453292519943295}
MOMENTS = {"N.m": 1.0, "N.mm": 1e-3}
MOMENT_NAMES = {"Nm": "N.m", "N.m": "N.m", "N*m": "N.m", "Nmm": "N.mm", "N.mm": "N.mm", "N*mm": "N.mm"}


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
        undrawn: Names of markers whose coordinates nobody measured: their shape is the mean over calibration trials.
        standing: Places an undrawn body on the base by where the base stands at rest.
        fitted: Places an undrawn body, or the frame of the marker positions, by the nominal robot's fit to the
            calibration postures.
    """

    name: str
    link: str
    markers: tuple[Marker, ...] = ()
    placement: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    undrawn: tuple[str, ...] = ()
    standing: Standing | None = None
    fitted: bool = False

    @model_validator(mode="after")
    def _is_placed_once(self) -> "MappedBody":
        if self.markers and (self.undrawn or self.fitted or self.standing):
            raise ValueError(f"body {self.name}: markers are drawn, so it is neither undrawn, standing nor fitted")
        if (self.undrawn or self.fitted or self.standing) and self.fitted == (self.standing is not None):
            raise ValueError(
                f"body {self.name}: say how it is placed: `markers` with xyz, `standing`, or `fitted: true`"
            )
        return self

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Of all its markers."""
        return self.undrawn or tuple(m.name for m in self.markers)

    def drawn(self) -> Body:
        """The body as it is drawn."""
        return Body(name=self.name, link=self.link, markers=self.markers, placement=self.placement)


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

    id: str
    file: str | None = None
    role: Role
    kind: Kind
    motion: str | None = None
    start: float | None = None
    part: tuple[NonNegative, Positive] | None = None
    payload: NonNegative | None = None
    dwells: tuple[tuple[float, float], ...] | None = None
    approach: tuple[tuple[Literal[-1, 0, 1], ...], ...] | None = None

    @property
    def stem(self) -> str:
        """Name of its file without folder and suffix."""
        return self.file or self.id


class PlateChannels(Declaration):
    """Columns of one force plate.

    Attributes:
        force: Fx, Fy, Fz.
        moment: Mx, My, Mz.
        cop: Centre of pressure x, y, z, against which the convention is checked; may be left out.
        convention: Whose wrench: `action` of the robot on the plate, or the plate's `reaction`.
        axes: `lab`, or `plate`: those declared for the plate.
        about: Point of the moments: the plate's surface `centre`, or the `lab` origin.
        force_unit: N.
        moment_unit: N.m or N.mm.
        cop_unit: m or mm.
    """

    force: Columns
    moment: Columns
    cop: Columns | None = None
    convention: Literal["action", "reaction"]
    axes: Literal["lab", "plate"]
    about: Literal["centre", "lab"]
    force_unit: Literal["N"]
    moment_unit: Literal["N.m", "N.mm"]
    cop_unit: Literal["m", "mm"] = "m"


class JointChannels(Declaration):
    """Columns of one joint; `motor` its motor-side position, `link` that of its link-side encoder."""

    motor: str
    link: str | None = None
    velocity: str | None = None
    effort: str | None = None
    command: str | None = None
    unit: Literal["rad", "deg", "m", "mm"]


class CsvTime(Declaration):
    """The time column: seconds, or UTC stamps such as 2023-09-20_16:40:52.540797 (seconds since that midnight)."""

    column: str
    unit: Literal["s", "ms", "utc"]


class CsvTable(Declaration):
    """One kind of CSV file: one header line, a row a sample on one clock, or a row a static posture.

    Attributes:
        suffix: What follows the trial's file name.
        time: The time column; none in a table of static postures.
        markers: Columns of each marker.
        marker_unit: m or mm.
        marker_std: Standard deviation of the mean position of a marker in a posture [m]; for static postures.
        gaps: How an occluded marker is written: `empty` cells, or `zero`.
        joints: Columns of each joint.
        plates: Columns of each plate.
    """

    suffix: str = ".csv"
    time: CsvTime | None = None
    markers: dict[str, Columns] = {}
    marker_unit: Literal["m", "mm"] = "m"
    marker_std: Positive | None = None
    gaps: Literal["empty", "zero"] = "empty"
    joints: dict[str, JointChannels] = {}
    plates: dict[str, PlateChannels] = {}

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> "CsvTable":
        if (self.time is None) == (self.marker_std is None):
            raise ValueError("give `time` for samples, or `marker_std` for static postures")
        if self.time is None and (self.plates or not self.joints or not self.markers):
            raise ValueError("a table of static postures has markers and joints, and no plates")
        return self


class C3dPlateMap(Declaration):
    """One plate of a C3D file.

    Attributes:
        number: Its place in FORCE_PLATFORM, from 1.
        convention: Whose wrench is stored: laboratories store the `reaction`, but no C3D file says so.
        moment_unit: Of its moments, where ANALOG:UNITS does not say.
        origin: What ORIGIN is: from the transducers' origin to the surface centre as C3D has it (z negative), or the
            other way round.
    """

    number: Annotated[int, Field(ge=1)]
    convention: Literal["action", "reaction"]
    moment_unit: Literal["N.m", "N.mm"] | None = None
    origin: Literal["transducer_to_surface", "surface_to_transducer"] = "transducer_to_surface"


class C3dLayout(Declaration):
    """What is what in the C3D files.

    Attributes:
        markers: POINT label of each marker.
        plates: Plates by their name in the setup.
        dwell_events: Labels of the events at start and stop of each static posture.
    """

    markers: dict[str, str]
    plates: dict[str, C3dPlateMap] = {}
    dwell_events: tuple[str, str] | None = None


class BagLayout(Declaration):
    """What is what in the bags; ROS has radians and metres.

    Attributes:
        source: Where the readings are: in JointState topics, or in PAL's introspection.
        joints: Name of each joint in the bag.
        motor: JointState topic of the motor side.
        link: JointState topic of the link encoders.
        command: JointState topic of the set-points.
        names: Introspection topic of the names.
        values: Introspection topic of the values.
    """

    source: Literal["joint_states", "introspection"]
    joints: dict[str, str]
    motor: str = "/joint_states"
    link: str | None = None
    command: str | None = None
    names: str = "/introspection_data/names"
    values: str = "/introspection_data/values"

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that are read."""
        if self.source == "introspection":
            return self.names, self.values
        return tuple(topic for topic in (self.motor, self.link, self.command) if topic is not None)


class Mapping(Declaration):
    """The whole mapping file.

    Attributes:
        urdf: The nominal robot: a path relative to the mapping file, or `tiago`, which comes with this program.
        setup: The robot and its instruments, as in dataset.json.
        bodies: The marker bodies.
        trials: The trials.
        csv: Kinds of CSV files.
        c3d: What is what in the C3D files.
        bag: What is what in the bags.
    """

    urdf: str
    setup: Setup
    bodies: tuple[MappedBody, ...]
    trials: Annotated[tuple[MappedTrial, ...], Field(min_length=1)]
    csv: tuple[CsvTable, ...] = ()
    c3d: C3dLayout | None = None
    bag: BagLayout | None = None

    @model_validator(mode="after")
    def _names_are_unique(self) -> "Mapping":
        groups = {
            "bodies": [b.name for b in self.bodies],
            "markers": [name for b in self.bodies for name in b.marker_names],
            "trials": [t.id for t in self.trials],
        }
        for group, names in groups.items():
            twice = sorted({n for n in names if names.count(n) > 1})
            if twice:
                raise ValueError(f"{group} named more than once: {twice}")
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
