"""The nominal robot on a free-flying base, with its declared payload."""

import numpy as np
import pinocchio as pin

from calibration.recording.schema import Description
from calibration.robot.chain import reduced_model


def floating_model(urdf: str, description: Description) -> pin.Model:
    """Free-flyer model with the measured joints and the declared payload, root joint first."""
    model = reduced_model(urdf, description.joint_names, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion(np.array([*description.gravity, 0.0, 0.0, 0.0]))
    if description.payload is not None:
        frame = model.frames[model.getFrameId(description.payload.link)]
        box = pin.Inertia(description.payload.mass, np.array(description.payload.com), np.zeros((3, 3)))
        model.inertias[frame.parentJoint] = model.inertias[frame.parentJoint] + frame.placement.act(box)
    return model
