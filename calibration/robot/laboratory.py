"""The robot of a dataset and its setup, each model of it built once.

chain      base frame -> tool frame, measured joints only, with payload and gravity of dataset.json
floating   the same joints on a free flyer, for inverse dynamics of the whole robot
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from calibration.recording.schema import Description
from calibration.robot.chain import Chain, chain_of, reduced_model
from calibration.robot.gravity import gravity_torques
from calibration.robot.nominal_frames import nominal_base_body, nominal_frames
from calibration.robot.rigid_tree import RigidTree, tree_of


def floating_model(urdf: str, description: Description) -> pin.Model:
    """Free-flyer model with the measured joints and the declared payload, root joint first."""
    model = reduced_model(urdf, description.joint_names, pin.JointModelFreeFlyer())
    model.gravity = pin.Motion(np.array([*description.gravity, 0.0, 0.0, 0.0]))
    if description.payload is not None:
        frame = model.frames[model.getFrameId(description.payload.link)]
        box = pin.Inertia(description.payload.mass, np.array(description.payload.com), np.zeros((3, 3)))
        model.inertias[frame.parentJoint] = model.inertias[frame.parentJoint] + frame.placement.act(box)
    return model


@dataclass(frozen=True)
class Laboratory:
    """The nominal robot and what dataset.json declares about it.

    Attributes:
        urdf: Text of nominal.urdf, or of the robot as weighed.
        description: The whole of dataset.json.
    """

    urdf: str
    description: Description

    @cached_property
    def chain(self) -> Chain:
        """The nominal chain of the measured joints."""
        return chain_of(self.urdf, self.description)

    @cached_property
    def floating(self) -> pin.Model:
        """Free-flyer model with the payload and gravity of the description."""
        return floating_model(self.urdf, self.description)

    @cached_property
    def tree(self) -> RigidTree:
        """The floating model made ready for its dynamics, readings in the order of the description."""
        return tree_of(self.floating, self.description.joint_names)

    @cached_property
    def nominal_frames(self) -> np.ndarray:
        """Nominal base and hand marker frames (12,): T_base_B, T_tool_H as translation [m], rotation vector [rad]."""
        return nominal_frames(self.chain, self.description)

    @cached_property
    def T_base_B(self) -> np.ndarray:  # noqa: N802
        """Nominal pose (4, 4) of the base's marker body in the base frame."""
        return nominal_base_body(self.chain, self.description)

    def with_base_body(self, placement: np.ndarray, sigma: np.ndarray) -> "Laboratory":
        """With the base's marker body where it was measured: T_base_B as (6,), its sigma (6,) [m, rad]."""
        description, own = self.description, self.description.base_body
        measured = {"placement": tuple(map(float, placement)), "tolerance": tuple(map(float, sigma))}
        bodies = tuple(b.model_copy(update=measured) if b is own else b for b in description.bodies)
        return replace(self, description=description.model_copy(update={"bodies": bodies}))

    @cached_property
    def _payloads(self) -> Mapping[str, float | None]:
        return {entry.id: entry.payload for entry in self.description.trials}

    def carrying(self, mass: float | None) -> "Laboratory":
        """The laboratory with another mass [kg] of the payload; itself where None, or where no payload is declared."""
        description = self.description.carrying(mass)
        return self if description is self.description else replace(self, description=description)

    @cached_property
    def unloaded(self) -> "Laboratory":
        """Without its payload."""
        return self.carrying(0.0)

    def of_trial(self, trial_id: str) -> "Laboratory":
        """With the payload of one trial of the dataset; of another trial, the campaign's."""
        return self.carrying(self._payloads.get(trial_id))

    def gravity_torques(self, q: np.ndarray) -> np.ndarray:
        """Torques (n, n_measured) [N.m, N] that hold the joints at angles q (n, n_measured) [rad, m], with payload."""
        return gravity_torques(self.chain.loads, q)
