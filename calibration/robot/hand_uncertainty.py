"""Where the markers of the hand will be seen, with a band: of this session, or of any other one.

    p_m = R x_m + t               T_B_H = (R, t) at the readings, x_m a marker in the hand's body
    covariance of p_m = G_m S G_m',     G_m = R [I  -[x_m]x]
    S = J Sigma J' + J_joint diag(s^2) J_joint' + diag(hand^2) + Ad diag(base) Ad' + diag(marker body)

Sigma is the parameters' covariance, s and hand the random errors of readings and hand. The last two terms are a day's:
between sessions base and marker body are not where they were, by what nothing inside one session can show.
The radius that holds 95 % of |e| is that of a gamma distribution with the mean and variance of |e|^2.
Reference: Satterthwaite, Biometrics Bulletin 1946.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.special import gammaincinv

from calibration.numerics.lie import adjoint, inverse, skew
from calibration.recording.schema import Tolerances
from calibration.robot.hand import HandModel


@dataclass(frozen=True)
class Session:
    """How far marker body and base are from where they were, on another day; standard deviations per axis.

    The defaults are those of a service robot that was put away in between, its markers not touched: the same posture,
    2 mm (rms) elsewhere. They are assumed; what re-registrations show is `second_session.session_of`.

    Attributes:
        base: Of the laboratory's frame in the base: translation [m], rotation [rad].
        hand: Of the marker body in the tool: translation [m], rotation [rad].
    """

    base: tuple[float, float] = (1e-3, 2e-3)
    hand: tuple[float, float] = (1e-3, 5e-3)

    @classmethod
    def remounted(cls, tolerances: Tolerances) -> Self:
        """Both marker bodies put back as drawings have them: on either day off by the tolerances of a body."""
        one = (2.0**0.5 * tolerances.body_translation, 2.0**0.5 * tolerances.body_rotation)
        return cls(one, one)

    @property
    def variances(self) -> np.ndarray:
        """(12,) of the two local twists."""
        return np.repeat([*self.base, *self.hand], 3) ** 2


@dataclass(frozen=True)
class Spread:
    """What a calibrated robot is not sure of.

    Attributes:
        names: Of the parameters that are not certain, length p.
        theta: (p, p) their covariance.
        reading: (k,) random errors of the joints' readings, standard deviations [rad, m].
        hand: (2,) of the hand's position [m] and rotation [rad]; (1,) of the position; (0,) none.
    """

    names: tuple[str, ...]
    theta: np.ndarray
    reading: np.ndarray
    hand: np.ndarray

    @property
    def hand_variances(self) -> np.ndarray:
        """(6,) of the hand's own random errors."""
        pose = np.zeros(6)
        pose[: 3 * len(self.hand)] = np.repeat(self.hand, 3) ** 2
        return pose

    def random_errors(self, J_joint: np.ndarray) -> np.ndarray:
        """Covariance (n, 6, 6) of readings' and hand's random errors; J_joint (n, 6, k) by joint position."""
        return np.asarray((J_joint * self.reading**2) @ np.swapaxes(J_joint, 1, 2) + np.diag(self.hand_variances))


@dataclass(frozen=True)
class Predicted:
    """Predicted marker positions with their uncertainty.

    Attributes:
        positions: (n, m, 3) [m], in the base's marker body or the laboratory the robot was calibrated in.
        covariance: (n, m, 3, 3) [m^2]: parameters, random errors and, where asked for, another session.
    """

    positions: np.ndarray
    covariance: np.ndarray

    @property
    def radius_95(self) -> np.ndarray:
        """(n, m) distance from the prediction within which 95 % are [m]."""
        return radius_95(self.covariance)


def radius_95(covariance: np.ndarray, offset: np.ndarray | None = None) -> np.ndarray:
    """(...) distance from a prediction within which 95 % are [m], by covariances (..., 3, 3).

    About a place that is known to be off by b (..., 3) [m], |e|^2 has the mean tr C + |b|^2 and the variance
    2 tr C^2 + 4 b' C b.
    """
    mean = np.trace(covariance, axis1=-2, axis2=-1)
    half = (covariance**2).sum(axis=(-2, -1))
    if offset is not None:
        mean = mean + (offset**2).sum(axis=-1)
        half = half + 2.0 * np.einsum("...i,...ij,...j->...", offset, covariance, offset)
    return np.asarray(np.sqrt(gammaincinv(0.5 * mean**2 / half, 0.95) * (2.0 * half / mean)))


def predicted_points(
    hand: HandModel, spread: Spread, markers: np.ndarray, q: np.ndarray, session: Session | None = None
) -> Predicted:
    """Markers (m, 3) [m] of the hand's body at readings q (n, n_measured), in another session where one is given."""
    found = hand.poses_and_derivatives(np.asarray(q, dtype=float), names=spread.names)
    S = found.J @ spread.theta @ np.swapaxes(found.J, 1, 2) + spread.random_errors(found.J_joint)
    return points_of(found.T, S, markers, session)


def points_of(T: np.ndarray, S: np.ndarray, markers: np.ndarray, session: Session | None = None) -> Predicted:
    """Markers (m, 3) [m] of poses T_B_H (n, 4, 4) whose local twists have covariance S (n, 6, 6)."""
    if session is not None:
        eye = np.broadcast_to(np.eye(6), S.shape)
        both = np.concatenate([adjoint(inverse(T)), eye], axis=2)
        S = S + (both * session.variances) @ np.swapaxes(both, 1, 2)
    R = T[:, None, :3, :3]
    G = np.concatenate([np.broadcast_to(R, (len(S), len(markers), 3, 3)), -R @ skew(markers)], axis=3)
    positions = np.einsum("nij,mj->nmi", T[:, :3, :3], markers) + T[:, None, :3, 3]
    return Predicted(positions, G @ S[:, None] @ np.swapaxes(G, 2, 3))
