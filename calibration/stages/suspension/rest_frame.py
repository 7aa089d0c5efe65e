"""Frame 0: the base frame where it stands in the first second of a trial, upright on the floor.

    T_lab_0 = U T_lab_B(rest) T_base_B^-1           U sets it on the floor
    x = (t, theta):   T_lab_B(t) = T_lab_0 [exp(theta) t; 0 1] T_0_B       displacement of the base frame [m, rad]

B is the base's marker body, T_base_B its placement in the model in use. Markers are placed to some millimetres and
milliradians on the base, the floor is known better: the wheels' nominal contact points lie in a plane of the base
frame, the floor is horizontal and, where there is a plate, at the height of its surface. So U turns and lifts frame 0
until the two planes meet; heading and horizontal position are the markers'.
"""

from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import from_vector, inverse, mean, to_vector
from calibration.recording.schema import Description
from calibration.recording.trial import REST, Trial


@dataclass(frozen=True)
class Rest:
    """Where the base stands at rest.

    Attributes:
        T_lab_0: (4, 4) the base frame.
        T_0_B: (4, 4) its marker body.
    """

    T_lab_0: np.ndarray
    T_0_B: np.ndarray

    def displacement(self, T_lab_B: np.ndarray) -> np.ndarray:
        """Displacement (n, 6) [m, rad] of the base frame behind poses T_lab_B (n, 4, 4); NaN where they are."""
        return to_vector(inverse(self.T_lab_0) @ T_lab_B @ inverse(self.T_0_B))

    def poses(self, x: np.ndarray) -> np.ndarray:
        """T_lab_B (n, 4, 4) of displacements x (n, 6)."""
        return self.T_lab_0 @ from_vector(x) @ self.T_0_B


def rest_of(description: Description, trial: Trial, T_base_B: np.ndarray) -> Rest:
    """Frame 0 of a trial, from the base markers of its first second alone.

    Raises:
        NotEnoughData: They are not seen there.
    """
    body = description.base_body
    early = trial.t_mocap <= trial.t_mocap[0] + REST
    T_lab_B = MeasuredTrial.of(description, trial).base.T[early]
    if not np.isfinite(T_lab_B).any():
        raise NotEnoughData(f"{trial.id}: body {body.name!r} is not seen in the first second of the trial")
    return rest_at(description, mean(T_lab_B), T_base_B)


def rest_at(description: Description, T_lab_B: np.ndarray, T_base_B: np.ndarray) -> Rest:
    """Frame 0 where the base's marker body is at T_lab_B (4, 4) at rest."""
    T_lab_0 = upright(T_lab_B @ inverse(T_base_B), description)
    return Rest(T_lab_0, inverse(T_lab_0) @ T_lab_B)


def upright(T_lab_base: np.ndarray, description: Description) -> np.ndarray:
    """The pose (4, 4) turned and lifted so that the wheels' contact plane is the floor."""
    up = -np.array(description.gravity)
    contacts = np.array([w.contact for w in description.wheels])
    if len(contacts) < 3 or not up.any():
        return T_lab_base
    centre = contacts.mean(axis=0)
    normal = np.linalg.svd(contacts - centre)[2][2]
    n = T_lab_base[:3, :3] @ normal
    up = up / np.linalg.norm(up)
    n = n if n @ up > 0.0 else -n
    axis = np.cross(n, up)
    sine = float(np.linalg.norm(axis))
    turn = axis / sine * np.arctan2(sine, n @ up) if sine > 0.0 else axis
    U = from_vector(np.concatenate([np.zeros(3), turn]))
    pivot = T_lab_base[:3, :3] @ centre + T_lab_base[:3, 3]
    U[:3, 3] = pivot - U[:3, :3] @ pivot
    if description.plates:
        U[:3, 3] += up * (up @ (np.array(description.plates[0].centre) - pivot))
    return U @ T_lab_base
