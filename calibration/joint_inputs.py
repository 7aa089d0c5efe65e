"""What the joint models are asked with, from motor encoders alone.

    theta = q_motor - offset        tau = gravity torque of the nominal model at theta        dq = d(q_motor)/dt

The offsets are the geometric calibration's. The velocity is zero-phase: readings on an even grid, low-passed forth and
back, central differences; it looks half a second ahead, so it is for recordings. Whoever predicts sample by sample
passes a velocity of its own.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.errors import ShapeError
from calibration.hand import HandModel
from calibration.inverse_dynamics import floating_model
from calibration.joint_gravity import gravity_torques
from calibration.schema import Description
from calibration.signals import RATE, even, low_passed

_CUTOFF = 10.0  # [Hz] of the velocity; starts and stops last a tenth of a second


@dataclass(frozen=True)
class JointInputs:
    """Inputs of the joint models, all (n, n_measured).

    Attributes:
        theta: Joint angles [rad, m].
        tau: Gravity torques [N.m, N].
        velocity: Motor-side velocities [rad/s, m/s].
    """

    theta: np.ndarray
    tau: np.ndarray
    velocity: np.ndarray


@dataclass(frozen=True)
class InputModel:
    """The nominal robot that turns readings into inputs.

    Attributes:
        model: Floating model with the declared payload.
        measured: The joints of the columns of q.
        offset: (n_measured,) zeros of the motor-side readings [rad, m].
        urdf: Text the model was built from.
        description: Of the dataset.
    """

    model: pin.Model
    measured: tuple[str, ...]
    offset: np.ndarray
    urdf: str
    description: Description

    def of_trial(self, trial_id: str) -> "InputModel":
        """The robot with the payload of one trial of the dataset; of another trial, the campaign's."""
        entry = next((t for t in self.description.trials if t.id == trial_id), None)
        if entry is None or self.description.loaded(entry) is self.description:
            return self
        return replace(self, model=floating_model(self.urdf, self.description.loaded(entry)))

    def inputs(self, t: np.ndarray, q_motor: np.ndarray, velocity: np.ndarray | None = None) -> JointInputs:
        """Inputs at readings q_motor (n, n_measured) taken at t (n,) [s], every clock will do.

        Args:
            t: Times, increasing.
            q_motor: Readings [rad, m], without NaN.
            velocity: Motor-side velocities where they are known; else from t and q_motor.

        Raises:
            NotEnoughData: Less than a second of readings and no velocity.
        """
        if q_motor.shape != (len(t), len(self.measured)):
            raise ShapeError("q_motor", q_motor.shape, (len(t), len(self.measured)))
        theta = q_motor - self.offset
        v = velocities(t, q_motor) if velocity is None else velocity
        return JointInputs(theta, gravity_torques(self.model, self.measured, theta), v)


def input_model(urdf: str, description: Description, hand: HandModel) -> InputModel:
    """The input model of a dataset, with the zeros of a calibrated hand model."""
    measured, offset = hand.chain.measured, np.zeros(len(hand.chain.measured))
    offset[hand.chain.columns] = hand.offset
    return InputModel(floating_model(urdf, description), measured, offset, urdf, description)


def velocities(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Velocities (n, k) [rad/s, m/s] of q (n, k) at t (n,) [s], zero-phase."""
    smooth = low_passed(even(t, q), _CUTOFF)
    v = np.gradient(smooth.x, 1.0 / RATE, axis=0)
    return np.stack([np.interp(t, smooth.t, column) for column in v.T], axis=1)
