"""A robot's URDF with other masses and joint placements than the nominal ones.

    m_i <- m_i (1 + s_i),   c_i <- c_i + d_i        body i: the links that one measured joint moves, or none
    origin <- origin exp6(xi)                       xyz [m], rpy [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)

All links of a body take the same share of their mass and inertia, and the same displacement. Near pitch = +-pi/2 yaw
and roll turn about one axis and only their sum is defined: yaw is taken first, whatever it is, and pitch and roll from
Rz(yaw)' R, so that the three together give R to rounding.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.errors import InputError
from calibration.robot.chain import Chain, reduced_model


@dataclass(frozen=True)
class LinkMasses:
    """How bodies differ from the nominal robot's.

    Attributes:
        joints: (b,) joint that moves each body, the root's first.
        share: (b,) of the mass [-].
        shift: (b, 3) of the centre of mass [m, axes of the joint].
    """

    joints: tuple[str, ...]
    share: np.ndarray
    shift: np.ndarray

    def on(self, urdf: str) -> str:
        """The URDF text with these masses.

        Raises:
            InputError: It is not a URDF, or lacks a joint.
        """
        model = reduced_model(urdf, self.joints[1:], pin.JointModelFreeFlyer())
        robot, links = ET.fromstring(urdf), {}
        for frame in model.frames:
            if frame.type == pin.FrameType.BODY and frame.parentJoint > 0:
                i = self.joints.index(model.names[frame.parentJoint])
                links[frame.name] = self.share[i], frame.placement.rotation.T @ self.shift[i]
        for link in robot.iter("link"):
            inertial = link.find("inertial")
            if inertial is not None and link.get("name") in links:
                _departed(inertial, *links[link.get("name")])
        return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _departed(inertial: ET.Element, share: float, shift: np.ndarray) -> None:
    """Change what a link weighs, by a share of its mass and a shift (3,) of its centre [m, link axes]."""
    origin = inertial.find("origin")
    if origin is None:
        origin = ET.SubElement(inertial, "origin")
    xyz = np.array(origin.get("xyz", "0 0 0").split(), dtype=float) + shift
    origin.set("xyz", " ".join(repr(float(v)) for v in xyz))
    for part in (*inertial.iter("mass"), *inertial.iter("inertia")):
        for key, value in part.attrib.items():
            part.set(key, repr(float(value) * (1.0 + float(share))))


def calibrated_urdf(urdf: str, chain: Chain) -> str:
    """The URDF text with the placement twists of `chain` on its joints; all else, comments included, as it was.

    Raises:
        InputError: A joint of the chain is not in the text.
    """
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    robot = ET.fromstring(urdf, parser=parser)
    joints = {joint.get("name"): joint for joint in robot.findall("joint")}
    for name, xi in zip(chain.joints, chain.xi, strict=True):
        if name not in joints:
            raise InputError("nominal.urdf", f"no joint {name!r}; it has {sorted(str(j) for j in joints)}")
        if np.any(xi):
            _move(joints[name], xi)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _move(joint: ET.Element, xi: np.ndarray) -> None:
    origin = joint.find("origin")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    xyz, rpy = np.split(written_origin(joint), 2)
    moved = pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz) * pin.exp6(xi)
    origin.set("xyz", " ".join(repr(float(v)) for v in moved.translation))
    origin.set("rpy", " ".join(repr(float(v)) for v in roll_pitch_yaw(moved.rotation)))


def written_origin(joint: ET.Element) -> np.ndarray:
    """xyz and rpy (6,) as written."""
    origin = joint.find("origin")
    written = {} if origin is None else origin.attrib
    return np.array([float(v) for key in ("xyz", "rpy") for v in written.get(key, "0 0 0").split()])


def roll_pitch_yaw(R: np.ndarray) -> np.ndarray:
    """Angles (3,) [rad] with Rz(yaw) Ry(pitch) Rx(roll) = R (3, 3) to rounding, everywhere."""
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    rest = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ R
    return np.array([np.arctan2(-rest[1, 2], rest[1, 1]), np.arctan2(-rest[2, 0], rest[0, 0]), yaw])
