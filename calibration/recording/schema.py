"""dataset.json: what a laboratory declares about its robot, its instruments and its trials.

SI units. Nothing in here is a truth: nominal coordinates, datasheet sigmas and tolerances only.
"""

from pathlib import PurePosixPath
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field, field_validator, model_validator

from calibration.errors import NotEnoughData
from calibration.recording.body_on_link import body_on
from calibration.recording.declaration import (
    Declaration,
    Name,
    NonNegative,
    Positive,
    Positive6,
    Text,
    Vector3,
    Vector6,
    refuse_repeated,
)

Axes = tuple[Vector3, Vector3, Vector3]
Role = Literal["calibration", "validation", "confirmation"]
Kind = Literal["static", "sweep", "swing", "spin", "drive"]
_ORTHOGONAL = 1e-3  # axes of a plate may be rounded [-]
_GRAVITY = (0.5, 30.0)  # [m/s2]
_MOST_JOINTS, _MOST_BODIES, _MOST_MARKERS, _MOST_TRIALS = 100, 100, 1000, 10_000


class Joint(Declaration):
    """A measured joint: which encoders it has and how often they are logged [Hz]."""

    name: Name
    encoders: tuple[Literal["motor", "link"], ...]
    rate: Positive


class Marker(Declaration):
    """A marker and its nominal position in its body's frame [m]."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}[+]?$")]  # `hand.x+` is one of a pose
    xyz: Vector3


class Body(Declaration):
    """A rigid marker cluster; its frame nominally coincides with the frame of `link`, but for `placement`.

    `placement` is the translation [m] and rotation vector [rad] of T_link_body where no drawing puts the two together,
    `tolerance` its standard deviations where it was measured on this robot, else they are those of `Tolerances`.
    """

    name: Name
    link: Name
    markers: Annotated[tuple[Marker, ...], Field(max_length=_MOST_MARKERS)]
    placement: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    tolerance: Positive6 | None = None

    @field_validator("markers")
    @classmethod
    def _are_not_in_line(cls, markers: tuple[Marker, ...]) -> tuple[Marker, ...]:
        if len(markers) >= 3 and np.linalg.matrix_rank(np.diff([m.xyz for m in markers], axis=0), rtol=1e-6) < 2:
            raise ValueError("are drawn in a line: they have no rotation; draw them where they are")
        return markers

    @property
    def is_point(self) -> bool:
        """Whether its markers determine a position only."""
        return 0 < len(self.markers) < 3

    @property
    def point(self) -> np.ndarray:
        """Mean of its nominal markers, c (3,) [m, body]."""
        return np.asarray(np.mean([m.xyz for m in self.markers], axis=0))


class Wheel(Declaration):
    """A wheel: hub centre and nominal floor contact point, in the base frame [m]."""

    name: Name
    type: Literal["drive", "caster"]
    centre: Vector3
    contact: Vector3


class Plate(Declaration):
    """A force plate: surface centre [m, lab], its axes as columns in the lab, edge lengths [m]."""

    name: Name
    centre: Vector3
    axes: Axes
    size: tuple[Positive, Positive]

    @field_validator("axes")
    @classmethod
    def _are_a_rotation(cls, axes: Axes) -> Axes:
        R = np.array(axes)
        if np.abs(R @ R.T - np.eye(3)).max() > _ORTHOGONAL or np.linalg.det(R) < 0.0:
            raise ValueError("axes are not of unit length, at right angles and right-handed")
        return axes


class Payload(Declaration):
    """A declared load: mass [kg] and centre of mass [m] in the frame of `link`, with its tolerance on the mass [kg]."""

    link: Name
    mass: NonNegative
    com: Vector3
    tolerance: NonNegative


class Sigmas(Declaration):
    """Datasheet noise, standard deviations per sample.

    Attributes:
        marker: Per axis of a moving marker [m].
        encoder: Per encoder reading [rad].
        plate_force: Per axis [N].
        plate_moment: Per axis [N.m].
    """

    marker: Positive
    encoder: Positive
    plate_force: Positive
    plate_moment: Positive


class Tolerances(Declaration):
    """Datasheet tolerances, as standard deviations; the same for every arm joint.

    Attributes:
        joint_translation: Joint placement, per axis [m].
        joint_rotation: Joint placement, per axis [rad].
        encoder_offset: Zero of the motor encoder [rad, or m for a prismatic joint scaled by 0.1 m/rad].
        joint_play: Motor-side reading minus joint angle, offset apart [rad].
        joint_delay: Median delay of a link behind its motor by viscous friction, friction over stiffness [s].
        joint_delay_spread: Standard deviation of the delay's logarithm [-].
        joint_windup: By which dry friction winds a gear, friction over stiffness [rad].
        body_translation: Marker cluster on its link, per axis [m].
        body_rotation: Marker cluster on its link, per axis [rad].
        plate_translation: Centre of a force plate, per axis across its surface [m].
        link_mass: Relative to the link's mass [-].
        link_com: Centre of mass, per axis [m].
    """

    joint_translation: Positive
    joint_rotation: Positive
    encoder_offset: Positive
    joint_play: Positive
    body_translation: Positive
    body_rotation: Positive
    link_mass: Positive
    link_com: Positive
    joint_delay: Positive = 5e-5
    joint_delay_spread: Positive = 0.6
    joint_windup: Positive = 1e-4
    plate_translation: Positive = 5e-4

    def body(self, body: Body) -> np.ndarray:
        """Standard deviations (6,) of a marker body's placement on its link [m, rad]."""
        return np.array(body.tolerance or [self.body_translation] * 3 + [self.body_rotation] * 3)


class TrialEntry(Declaration):
    """One continuous recording; `file` is relative to the dataset folder.

    `payload` is the mass [kg] of the declared payload in this trial, where it differs from the campaign's.
    """

    id: Name
    role: Role
    kind: Kind
    motion: Text
    file: Annotated[str, Field(max_length=200)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    payload: NonNegative | None = None

    @field_validator("file")
    @classmethod
    def _is_inside(cls, file: str) -> str:
        path = PurePosixPath(file)
        if path.is_absolute() or not path.parts or ".." in path.parts or not file.isprintable() or "\\" in file:
            raise ValueError("name a file inside the dataset's folder, relative to it")
        return file


class Setup(Declaration):
    """The robot and its instruments.

    `marker_frame` is the frame of the marker positions: `lab`, or the name of a marker body without markers, for files
    whose positions were already brought into a frame fixed on that body (the base's motion removed).
    `mocap_clock` names the instruments whose times are the motion capture's own, sampled together by one machine.
    `wrist_link` is the frame of the wrist's force-torque sensor, whose axes and origin `wrist_wrench` has.
    """

    robot: Text
    base_frame: Name
    tool_frame: Name
    joints: Annotated[tuple[Joint, ...], Field(max_length=_MOST_JOINTS)]
    wheels: Annotated[tuple[Wheel, ...], Field(max_length=_MOST_BODIES)] = ()
    plates: Annotated[tuple[Plate, ...], Field(max_length=_MOST_BODIES)] = ()
    payload: Payload | None = None
    gravity: Vector3 = (0.0, 0.0, -9.81)
    marker_frame: Name = "lab"
    mocap_clock: tuple[Literal["robot", "plate"], ...] = ()
    wrist_link: Name | None = None
    sigmas: Sigmas
    tolerances: Tolerances

    @field_validator("gravity")
    @classmethod
    def _is_on_a_planet(cls, gravity: Vector3) -> Vector3:
        size = float(np.linalg.norm(gravity))
        if not _GRAVITY[0] < size < _GRAVITY[1]:
            raise ValueError(f"is {size:g} m/s2 in size; it is within {_GRAVITY[0]} to {_GRAVITY[1]} m/s2")
        return gravity

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the measured joints, base to tip."""
        return tuple(j.name for j in self.joints)


class Description(Setup):
    """The whole of dataset.json."""

    schema_version: Annotated[Literal[1], Field(alias="schema")] = 1
    bodies: Annotated[tuple[Body, ...], Field(max_length=_MOST_BODIES)]
    trials: Annotated[tuple[TrialEntry, ...], Field(max_length=_MOST_TRIALS)]

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, validate_by_name=True, serialize_by_alias=True
    )

    @model_validator(mode="after")
    def _names_are_unique(self) -> "Description":
        refuse_repeated(
            joints=[j.name for j in self.joints],
            bodies=[b.name for b in self.bodies],
            markers=[m.name for b in self.bodies for m in b.markers],
            plates=[p.name for p in self.plates],
            wheels=[w.name for w in self.wheels],
            trials=[t.id for t in self.trials],
        )
        return self

    @model_validator(mode="after")
    def _marker_frame_is_known(self) -> "Description":
        bare = [b.name for b in self.bodies if not b.markers]
        allowed = [] if self.marker_frame == "lab" else [self.marker_frame]
        if bare != allowed:
            raise ValueError(
                f"bodies without markers: {bare}, marker_frame: {self.marker_frame!r}; positions are in the lab, or in "
                "the frame of the one body that has no markers"
            )
        return self

    def carrying(self, mass: float | None) -> "Description":
        """The description with another mass [kg] of its payload; itself where None, or where it has no payload."""
        if mass is None or self.payload is None:
            return self
        return self.model_copy(update={"payload": self.payload.model_copy(update={"mass": mass})})

    def payload_of(self, trial_id: str | None = None) -> float:
        """Mass [kg] in the hand in a trial, the campaign's where none is named or it has no other; 0 without one."""
        payload = self.carrying(next((e.payload for e in self.trials if e.id == trial_id), None)).payload
        return 0.0 if payload is None else payload.mass

    @property
    def alone(self) -> "Description":
        """The description without its trials."""
        return self.model_copy(update={"trials": ()})

    def body(self, name: str) -> Body | None:
        """The marker body of that name, or None where the laboratory has none."""
        return next((b for b in self.bodies if b.name == name), None)

    @property
    def base_body(self) -> Body:
        """The marker body on the base frame."""
        return self._found(body_on(self.bodies, self.base_frame), f"base_frame {self.base_frame!r}")

    @property
    def hand_body(self) -> Body:
        """The marker body at the hand, whose frame is the pose predicted and scored."""
        return self._found(body_on(self.bodies, self.tool_frame, self.base_frame), f"tool_frame {self.tool_frame!r}")

    def _found(self, body: Body | None, wanted: str) -> Body:
        if body is None:
            known = {b.name: b.link for b in self.bodies}
            raise NotEnoughData(f"dataset.json has no marker body on its {wanted}; bodies and links: {known}")
        return body
