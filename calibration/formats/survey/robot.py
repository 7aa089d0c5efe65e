"""The robot of a URDF as far as a mapping needs it: its movable joints, base to tip, its root and the tool's link."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass

from calibration.errors import InputError

_TOOL = re.compile(r"tool|grasp|tcp|flange|end_?effector|(^|_)ee(_|$)", re.IGNORECASE)
_SENSOR = re.compile(r"(^|_)(ft|force)(_|$)", re.IGNORECASE)
_MOVABLE = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of a URDF: its type, and the links it connects."""

    name: str
    type: str
    parent: str
    child: str


@dataclass(frozen=True)
class UrdfRobot:
    """The tree of a URDF.

    Attributes:
        name: Of the robot.
        joints: All of them.
    """

    name: str
    joints: tuple[UrdfJoint, ...]

    @property
    def movable(self) -> tuple[str, ...]:
        """Names of the joints that move by one coordinate."""
        return tuple(j.name for j in self.joints if j.type in _MOVABLE)

    @property
    def root(self) -> str:
        """The link that no joint carries."""
        children = {j.child for j in self.joints}
        return next((j.parent for j in self.joints if j.parent not in children), "")

    def prismatic(self, names: Iterable[str]) -> list[str]:
        """Those of the joints that slide."""
        slides = {j.name for j in self.joints if j.type == "prismatic"}
        return [n for n in names if n in slides]

    def in_order(self, names: Iterable[str]) -> list[str]:
        """The joints, base to tip."""
        return sorted(names, key=lambda n: len(self._above(self._joint(n).child)))

    def chain_to(self, link: str, names: Iterable[str]) -> tuple[str, ...]:
        """Those of the joints that carry a link, base to tip."""
        wanted = set(names)
        return tuple(j.name for j in reversed(self._above(link)) if j.name in wanted)

    def tool(self, measured: Iterable[str]) -> str:
        """The link at the tip of the chain with most measured joints; a fixed frame of a tool's name before others."""
        names = set(measured)
        links = [j.child for j in self.joints]
        if names >= set(self.movable) and any(map(_TOOL.search, links)):
            links = [link for link in links if _TOOL.search(link)]
        counts = {link: sum(j.name in names for j in self._above(link)) for link in links}
        rigid = [
            link
            for link in links
            if counts[link] == max(counts.values()) and not _moves_between(self._above(link), names)
        ]
        named = [link for link in rigid if _TOOL.search(link)]
        return max(named or rigid, key=lambda link: len(self._above(link)), default=self.root)

    def wrist(self, tool: str) -> str:
        """The link of a force-torque sensor below the tool by its name, the first from the base; else the tool."""
        return next((j.child for j in reversed(self._above(tool)) if _SENSOR.search(j.child)), tool)

    def _joint(self, name: str) -> UrdfJoint:
        return next(j for j in self.joints if j.name == name)

    def _above(self, link: str) -> list[UrdfJoint]:
        """Joints from a link down to the root."""
        by_child = {j.child: j for j in self.joints}
        found: list[UrdfJoint] = []
        while link in by_child and len(found) <= len(self.joints):
            found.append(by_child[link])
            link = by_child[link].parent
        return found


def _moves_between(above: list[UrdfJoint], measured: set[str]) -> bool:
    """Whether a joint that is not measured moves the link against the last measured one."""
    for joint in above:
        if joint.name in measured:
            return False
        if joint.type != "fixed":
            return True
    return False


def read_urdf(text: str) -> UrdfRobot:
    """The tree of a URDF.

    Raises:
        InputError: It is no URDF.
    """
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise InputError("urdf", f"is no XML ({error})") from error
    joints = []
    for j in root.findall("joint"):
        parent, child = j.find("parent"), j.find("child")
        if parent is not None and child is not None:
            ends = parent.get("link", ""), child.get("link", "")
            joints.append(UrdfJoint(j.get("name", ""), j.get("type", ""), *ends))
    if not joints:
        raise InputError("urdf", "has no joints")
    return UrdfRobot(root.get("name", "robot"), tuple(joints))
