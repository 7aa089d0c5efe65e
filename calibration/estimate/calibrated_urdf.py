"""A calibrated robot as its URDF: the nominal text with the joint origins moved, or PAL's list of how far they moved.

    origin <- origin exp6(xi)           xyz [m], rpy [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)

Near pitch = +-pi/2 yaw and roll turn about one axis and only their sum is defined: yaw is taken first, whatever it is,
and pitch and roll from Rz(yaw)' R, so that the three together give R to rounding. Zeros of readings do not fit in a
URDF: they go to zeros.yaml, and the calibrated URDF's joint positions are readings minus those.

    master_calibration.yaml     robot_state_publisher: {geometric_calibration: {arm_1_dx: ..., arm_1_droll: ...}}

PAL's robot_state_publisher adds these to xyz and rpy of the nominal origins as they are written, `_joint` cut off the
joint's name. A zero o turns the reading's joint about its own axis S: origin exp6(xi) exp6(-o S). Near pitch = +-pi/2
roll and yaw may be traded by up to pi: the same small rotation. Compliance and backlash have no place there.
Reference: figaroh 1.0.2, tools/geometric_calibration_export.py.
"""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from calibration.errors import InputError
from calibration.numerics.lie import exp6, log6
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel

_KEYS = ("dx", "dy", "dz", "droll", "dpitch", "dyaw")
_HEADER = """\
# Added to the joint origins of the nominal URDF by PAL's robot_state_publisher, zeros of readings included.
# Not together with calibrated.urdf and zeros.yaml, which are the same calibration.
"""
_LEFT_OUT = "# Compliance and backlash, which zeros.yaml has, are left out.\n"


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
    xyz, rpy = np.split(_origin(joint), 2)
    moved = pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz) * pin.exp6(xi)
    origin.set("xyz", " ".join(repr(float(v)) for v in moved.translation))
    origin.set("rpy", " ".join(repr(float(v)) for v in roll_pitch_yaw(moved.rotation)))


def _origin(joint: ET.Element) -> np.ndarray:
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


def pal_calibration(urdf: str, hand: HandModel) -> str:
    """master_calibration.yaml of a calibrated robot.

    Raises:
        InputError: A joint of the chain is not in the text.
    """
    chain = hand.chain
    xi = log6(exp6(chain.xi) @ exp6(-hand.offset[:, None] * chain.nominal_path.twists))
    before, after = (
        {j.get("name"): _origin(j) for j in ET.fromstring(text).findall("joint")}
        for text in (urdf, calibrated_urdf(urdf, chain.with_placements(xi)))
    )
    lines = [_HEADER, _LEFT_OUT] if hand.compliance.any() or hand.gap.any() else [_HEADER]
    lines.append("robot_state_publisher:\n  geometric_calibration:\n")
    for name in chain.joints:
        moved = after[name] - before[name]
        moved[3:] = (moved[3:] + np.pi) % (2.0 * np.pi) - np.pi
        short = name.removesuffix("_joint")
        lines += [f"    {short}_{key}: {float(x)!r}\n" for key, x in zip(_KEYS, moved, strict=True) if x]
    return "".join(lines)
