"""A calibrated URDF: the nominal text with the joint origins moved.

    origin <- origin exp6(xi)           xyz [m], rpy [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)

Near pitch = +-pi/2 yaw and roll turn about one axis and only their sum is defined: yaw is taken first, whatever it is,
and pitch and roll from Rz(yaw)' R, so that the three together give R to rounding. Zeros of readings do not fit in a
URDF: they go to master_calibration.yaml, and this file's joint positions are readings minus those.
"""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from calibration.errors import InputError
from calibration.robot import Chain


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
    xyz, rpy = (np.array([float(v) for v in origin.get(key, "0 0 0").split()]) for key in ("xyz", "rpy"))
    moved = pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz) * pin.exp6(xi)
    origin.set("xyz", " ".join(repr(float(v)) for v in moved.translation))
    origin.set("rpy", " ".join(repr(float(v)) for v in roll_pitch_yaw(moved.rotation)))


def roll_pitch_yaw(R: np.ndarray) -> np.ndarray:
    """Angles (3,) [rad] with Rz(yaw) Ry(pitch) Rx(roll) = R (3, 3) to rounding, everywhere."""
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    rest = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ R
    return np.array([np.arctan2(-rest[1, 2], rest[1, 1]), np.arctan2(-rest[2, 0], rest[0, 0]), yaw])
