"""A calibrated robot as PAL's list of how far its joint origins moved.

    master_calibration.yaml     robot_state_publisher: {geometric_calibration: {arm_1_dx: ..., arm_1_droll: ...}}

PAL's robot_state_publisher adds these to xyz and rpy of the nominal origins as they are written, `_joint` cut off the
joint's name. A zero o turns the reading's joint about its own axis S: origin exp6(xi) exp6(-o S). Near pitch = +-pi/2
roll and yaw may be traded by up to pi: the same small rotation. Compliance and backlash have no place there.
Reference: figaroh 1.0.2, tools/geometric_calibration_export.py.
"""

import xml.etree.ElementTree as ET

import numpy as np

from calibration.numerics.lie import exp6, log6
from calibration.robot.hand import HandModel
from calibration.robot.urdf import calibrated_urdf, written_origin

_KEYS = ("dx", "dy", "dz", "droll", "dpitch", "dyaw")
_HEADER = """\
# Added to the joint origins of the nominal URDF by PAL's robot_state_publisher, zeros of readings included.
# Not together with calibrated.urdf and zeros.yaml, which are the same calibration.
"""
_LEFT_OUT = "# Compliance and backlash, which zeros.yaml has, are left out.\n"


def pal_calibration(urdf: str, hand: HandModel) -> str:
    """master_calibration.yaml of a calibrated robot.

    Raises:
        InputError: A joint of the chain is not in the text.
    """
    chain = hand.chain
    xi = log6(exp6(chain.xi) @ exp6(-hand.offset[:, None] * chain.nominal_path.twists))
    before, after = (
        {j.get("name"): written_origin(j) for j in ET.fromstring(text).findall("joint")}
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
