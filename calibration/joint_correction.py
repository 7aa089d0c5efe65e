"""The joint models in use: motor readings in, the readings the geometry should be given out.

    q_corrected = q_motor - dtheta_hat(theta, tau, dq)

The geometry was fitted to motor readings whose mean discrepancy over its postures is part of its zeros; dtheta_hat is
what departs from that mean.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NoSuchElement
from calibration.joint_inputs import InputModel
from calibration.joint_model import JointModel


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
