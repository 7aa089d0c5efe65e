"""Departures that no model of the pipeline holds: warming, a floor out of level, a cable, a loose marker.

    placement  M_j(t) = M_j exp6(xi (1 - exp(-t / T)))          t since the campaign's start, taken at a trial's middle
    floor      g = R(tilt)' (0, 0, -9.81)                       the lab's axes lie in the floor
    cable      tau = -k (q - q_0)                               on the link
    marker     y = p - a (0, 0, 1)                              hangs by its play a, from t_0 on

A link that bends is `twin.defects.loads.Flexibility`.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from twin.conventions import exp6, placement, transform
from twin.defects.base import Defect, Parameter, joint
from twin.defects.placements import twist_parameters
from twin.errors import UnknownElement


@dataclass(frozen=True)
class Warming(Defect):
    """Drift of a joint's placement with temperature.

    Attributes:
        joint_name: The joint.
        xi: Twist once warm (6,), linear [m] then angular [rad].
        time_constant: T [s].
        time: t of the trial concerned [s]; constant within it.
    """

    joint_name: str
    xi: np.ndarray
    time_constant: float
    time: float = 0.0

    @property
    def now(self) -> np.ndarray:
        """Twist at the trial's time (6,)."""
        return self.xi * -np.expm1(-self.time / self.time_constant)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Move the body that carries the joint, after its own placement."""
        carrier = joint(spec, self.joint_name).parent
        carrier.pos, carrier.quat = placement(transform(carrier.pos, carrier.quat) @ exp6(self.now))

    def parameters(self) -> tuple[Parameter, ...]:
        """The twist once warm, and the time constant."""
        name = f"warming.{self.joint_name}"
        return (*twist_parameters(name, self.xi), Parameter(f"{name}.time_constant", "s", self.time_constant))


@dataclass(frozen=True)
class FloorTilt(Defect):
    """A floor out of level.

    Attributes:
        rotation: Of the floor about the level's x and y axes (2,), a rotation vector [rad].
    """

    rotation: tuple[float, float]

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Turn gravity in the lab."""
        R_level_lab = Rotation.from_rotvec([*self.rotation, 0.0])
        spec.option.gravity = R_level_lab.inv().apply(spec.option.gravity)

    def parameters(self) -> tuple[Parameter, ...]:
        """The rotation vector."""
        return tuple(Parameter(f"floor.tilt.{a}", "rad", v) for a, v in zip(("rx", "ry"), self.rotation, strict=True))


@dataclass(frozen=True)
class Cable(Defect):
    """A harness that pulls a joint towards an angle.

    Attributes:
        joint_name: The joint.
        stiffness: k [N.m/rad].
        rest: q_0 [rad].
    """

    joint_name: str
    stiffness: float
    rest: float

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Put a spring on the joint."""
        pulled = joint(spec, self.joint_name)
        pulled.stiffness = np.array([self.stiffness, 0.0, 0.0])
        pulled.springref = np.degrees(self.rest) if spec.compiler.degree else self.rest

    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness and angle of rest."""
        name = f"cable.{self.joint_name}"
        return Parameter(f"{name}.stiffness", "N.m/rad", self.stiffness), Parameter(f"{name}.rest", "rad", self.rest)


@dataclass(frozen=True)
class LooseMarker:
    """A marker that hangs by its play.

    Attributes:
        name: The marker.
        sag: a [m].
        since: t_0 [s from the campaign's start].
    """

    name: str
    sag: float
    since: float

    def moved(self, t: np.ndarray, markers: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
        """Positions (n, n_markers, 3) [m, lab] at times t (n,) [s from the campaign's start] with this marker loose.

        Raises:
            UnknownElement: There is no such marker.
        """
        if self.name not in markers:
            raise UnknownElement("marker", self.name, markers)
        out = positions.copy()
        out[:, markers.index(self.name), 2] -= np.where(t >= self.since, self.sag, 0.0)
        return out

    def parameters(self) -> tuple[Parameter, ...]:
        """How far it hangs, and from when on."""
        name = f"loosened.{self.name}"
        return Parameter(f"{name}.sag", "m", self.sag), Parameter(f"{name}.since", "s", self.since)
