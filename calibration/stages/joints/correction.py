"""What the joint models are asked with, from motor encoders alone.

    theta = q_motor - offset        tau = gravity torque of the nominal model at theta        dq = d(q_motor)/dt

The offsets are the geometric calibration's. The velocity is zero-phase: readings on an even grid, low-passed forth and
back, central differences; it looks half a second ahead, so it is for recordings. Whoever predicts sample by sample
passes a velocity of its own.

The joint models in use: motor readings in, the readings the geometry should be given out.

    q_corrected = q_motor - dtheta_hat(theta, tau, dq)

The geometry was fitted to motor readings whose mean discrepancy over its postures is part of its zeros; dtheta_hat is
what departs from that mean.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NoSuchElement, ShapeError
from calibration.numerics.signals import RATE, even, interpolate_columns, low_passed
from calibration.robot.hand import HandModel
from calibration.robot.laboratory import Laboratory
from calibration.stages.joints.model import JointModel

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
        lab: The robot with the declared payload.
        offset: (n_measured,) zeros of the motor-side readings [rad, m].
    """

    lab: Laboratory
    offset: np.ndarray

    @property
    def measured(self) -> tuple[str, ...]:
        """The joints of the columns of q."""
        return self.lab.chain.measured

    def of_trial(self, trial_id: str) -> "InputModel":
        """The robot with the payload of one trial of the dataset; of another trial, the campaign's."""
        return replace(self, lab=self.lab.of_trial(trial_id))

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
        return JointInputs(theta, self.lab.gravity_torques(theta), v)


def input_model(lab: Laboratory, hand: HandModel) -> InputModel:
    """The input model of a laboratory, with the zeros of a calibrated hand model."""
    offset = np.zeros(len(hand.chain.measured))
    offset[hand.chain.columns] = hand.offset
    return InputModel(lab, offset)


def velocities(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Velocities (n, k) [rad/s, m/s] of q (n, k) at t (n,) [s], zero-phase."""
    smooth = low_passed(even(t, q), _CUTOFF)
    v = np.gradient(smooth.x, 1.0 / RATE, axis=0)
    return interpolate_columns(t, smooth.t, v)


@dataclass(frozen=True)
class JointModels:
    """The joint models of a robot and what they are asked with.

    Attributes:
        inputs: From readings to inputs.
        zero: (n_measured,) motor minus link reading over the calibration postures [rad, m]; NaN without link encoder.
        models: In the order of the measured joints; joints without a link encoder have none.
    """

    inputs: InputModel
    zero: np.ndarray
    models: tuple[JointModel, ...]

    def of_trial(self, trial_id: str) -> "JointModels":
        """The same models, asked with the payload of one trial."""
        return replace(self, inputs=self.inputs.of_trial(trial_id))

    def model(self, joint: str) -> JointModel:
        """The model of a joint.

        Raises:
            NoSuchElement: It has none.
        """
        found = next((m for m in self.models if m.joint == joint), None)
        if found is None:
            raise NoSuchElement("joint model", joint, [m.joint for m in self.models])
        return found


@dataclass(frozen=True)
class Corrected:
    """Readings with the predicted discrepancy taken off.

    Attributes:
        q: (n, n_measured) [rad, m].
        outside: (n, n_measured) where a model was asked outside its domain, at the nearest value inside.
        modelled: (n_measured,) which joints have a model that corrects.
        variance: (n, n_measured) of the corrections [rad2]; 0 without one.
    """

    q: np.ndarray
    outside: np.ndarray
    modelled: np.ndarray
    variance: np.ndarray


def correct(models: JointModels, t: np.ndarray, q_motor: np.ndarray, velocity: np.ndarray | None = None) -> Corrected:
    """What goes into the geometry in place of q_motor (n, n_measured) [rad, m], read at t (n,) [s].

    Args:
        models: The joint models.
        t: Times of the readings on any clock; used for the velocity only.
        q_motor: Readings without NaN.
        velocity: Motor-side velocities (n, n_measured); where not given, zero-phase from t and q_motor.

    Raises:
        NotEnoughData: Less than a second of readings and no velocity.
    """
    inputs = models.inputs.inputs(t, q_motor, velocity)
    q, outside = np.array(q_motor, dtype=float), np.zeros(q_motor.shape, dtype=bool)
    modelled, variance = np.zeros(q.shape[1], dtype=bool), np.zeros_like(q)
    for model in (m for m in models.models if m.powers):
        j = models.inputs.measured.index(model.joint)
        asked = inputs.theta[:, j], inputs.tau[:, j], inputs.velocity[:, j]
        q[:, j] -= model.discrepancy(*asked)
        outside[:, j] = model.is_outside(*asked[:2])
        modelled[j], variance[:, j] = True, model.variance(*asked)
    return Corrected(q, outside, modelled, variance)
