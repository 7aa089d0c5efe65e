"""Masses and centres of mass of a robot that are not the nominal ones.

    m_i <- m_i (1 + s_i),   c_i <- c_i + d_i        body i: the links that one measured joint moves, or none

All links of a body take the same share of their mass and inertia, and the same displacement.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.robot.chain import reduced_model


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
