"""What is what in a file of each format: columns, labels and topics, their units, whose wrench they hold."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from calibration.recording.declaration import Declaration, Positive

Columns = tuple[str, str, str]
LENGTHS = {"m": 1.0, "mm": 1e-3}
ANGLES = {"rad": 1.0, "deg": 0.017453292519943295}
MOMENTS = {"N.m": 1.0, "N.mm": 1e-3}
MOMENT_NAMES = {"Nm": "N.m", "N.m": "N.m", "N*m": "N.m", "Nmm": "N.mm", "N.mm": "N.mm", "N*mm": "N.mm"}


class PlateChannels(Declaration):
    """Columns of one force plate.

    Attributes:
        force: Fx, Fy, Fz.
        moment: Mx, My, Mz.
        cop: Centre of pressure x, y, z, against which the convention is checked; may be left out.
        reversed: Those of `force` whose sign is opposite to that of the others; a centre of pressure depends on Fz
        alone.
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
    reversed: tuple[str, ...] = ()
    convention: Literal["action", "reaction"]
    axes: Literal["lab", "plate"]
    about: Literal["centre", "lab"]
    force_unit: Literal["N"]
    moment_unit: Literal["N.m", "N.mm"]
    cop_unit: Literal["m", "mm"] = "m"

    @model_validator(mode="after")
    def _reversed_are_forces(self) -> "PlateChannels":
        if other := set(self.reversed) - set(self.force):
            raise ValueError(f"`reversed` names columns of `force` {list(self.force)}, found {sorted(other)}")
        return self

    @property
    def signs(self) -> tuple[float, ...]:
        """Of the columns of `force`."""
        return tuple(-1.0 if c in self.reversed else 1.0 for c in self.force)


class JointChannels(Declaration):
    """Columns of one joint; `motor` its motor-side position, `link` that of its link-side encoder."""

    motor: str
    link: str | None = None
    velocity: str | None = None
    effort: str | None = None
    command: str | None = None
    unit: Literal["rad", "deg", "m", "mm"]


class WristChannels(Declaration):
    """Columns of the wrist's force-torque sensor, its own axes, N and N.m.

    Attributes:
        force: Fx, Fy, Fz.
        moment: Mx, My, Mz.
        convention: Whose wrench: `action` of the hand on the sensor, or the sensor's `reaction`.
    """

    force: Columns
    moment: Columns
    convention: Literal["action", "reaction"]


Order = Literal["quat_xyzw", "quat_wxyz", "rotation_vector", "euler_xyz", "euler_zyx", "euler_XYZ", "euler_ZYX"]


class PoseNumbers(Declaration):
    """How the 6D pose of a rigid body is written.

    Attributes:
        order: Of its rotation; Euler axes of the lab in small letters, of the body in capitals, the first one first.
        position_unit: m or mm.
        angle_unit: rad or deg, of all but quaternions.
        sigma_position: Standard deviation per axis [m].
        sigma_rotation: Standard deviation per axis [rad].
    """

    order: Order
    position_unit: Literal["m", "mm"] = "m"
    angle_unit: Literal["rad", "deg"] = "rad"
    sigma_position: Positive
    sigma_rotation: Positive


class PoseChannels(PoseNumbers):
    """Columns of the 6D pose of a rigid body.

    Attributes:
        position: x, y, z of its origin.
        rotation: Four numbers of a quaternion, three of a rotation vector or of Euler angles.
    """

    position: Columns
    rotation: tuple[str, ...]

    @model_validator(mode="after")
    def _has_as_many_columns(self) -> "PoseChannels":
        wanted = 4 if self.order.startswith("quat") else 3
        if len(self.rotation) != wanted:
            raise ValueError(f"`rotation` names {len(self.rotation)} columns, {self.order} has {wanted}")
        return self


class PoseTopic(PoseNumbers):
    """Topic of the 6D pose of a rigid body: PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped or TF.

    Attributes:
        topic: Its name.
        frame: The body's frame (child_frame_id) on a topic of several, such as /tf.
        parent: The frame the pose is in (frame_id); all bodies' is one.
        order: ROS has quaternions x, y, z, w.
    """

    topic: str
    frame: str | None = None
    parent: str | None = None
    order: Order = "quat_xyzw"


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
        wrist: Columns of the wrist's force-torque sensor, in a table of joints.
        poses: Columns of the pose of each rigid body, where the file has poses instead of markers.
        dwells: Columns of start and stop of each static posture [s, markers' clock], in a table of nothing else.
    """

    suffix: str = ".csv"
    time: CsvTime | None = None
    markers: dict[str, Columns] = {}
    marker_unit: Literal["m", "mm"] = "m"
    marker_std: Positive | None = None
    gaps: Literal["empty", "zero"] = "empty"
    joints: dict[str, JointChannels] = {}
    plates: dict[str, PlateChannels] = {}
    wrist: WristChannels | None = None
    poses: dict[str, PoseChannels] = {}
    dwells: tuple[str, str] | None = None

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> "CsvTable":
        if self.dwells is not None:
            if self.time or self.marker_std or self.markers or self.joints or self.plates:
                raise ValueError("a table of `dwells` has nothing else")
            return self
        stated = self.marker_std is not None or (bool(self.poses) and not self.markers)
        if self.marker_std is not None if self.time else not stated:
            raise ValueError("give `time` for samples, or `marker_std` for static postures")
        if self.time is None and (self.plates or not self.joints or not (self.markers or self.poses)):
            raise ValueError("a table of static postures has markers and joints, and no plates")
        if self.wrist is not None and (self.time is None or not self.joints):
            raise ValueError("`wrist` is sampled with the joints; map it in their table")
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
        wrist: WrenchStamped topic of the wrist's force-torque sensor.
        wrist_convention: Whose wrench that is: `action` of the hand on the sensor, or the sensor's `reaction`.
        poses: Topic of the pose of each rigid body, stamped on the clock of the readings.
    """

    source: Literal["joint_states", "introspection"] = "joint_states"
    joints: dict[str, str] = {}
    motor: str = "/joint_states"
    link: str | None = None
    command: str | None = None
    names: str = "/introspection_data/names"
    values: str = "/introspection_data/values"
    wrist: str | None = None
    wrist_convention: Literal["action", "reaction"] | None = None
    poses: dict[str, PoseTopic] = {}

    @model_validator(mode="after")
    def _says_something(self) -> "BagLayout":
        if not self.joints and not self.poses:
            raise ValueError("name `joints`, `poses`, or both")
        return self

    @model_validator(mode="after")
    def _wrist_says_whose(self) -> "BagLayout":
        if (self.wrist is None) != (self.wrist_convention is None):
            raise ValueError("give `wrist` and `wrist_convention` together: no bag contains whose wrench it is")
        return self

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that are read."""
        readings = (self.motor, self.link, self.command)
        read = (self.names, self.values) if self.source == "introspection" else readings
        poses = (pose.topic for pose in self.poses.values())
        return tuple(topic for topic in (*(read if self.joints else ()), self.wrist, *poses) if topic is not None)
