"""What postures tell before they are recorded.

    theta = nominal + T (V x + rest),      T = diag(tolerance),   x ~ N(0, I) beforehand
    x | postures ~ N(., C),    C = (I + sum_i B_i' B_i)^-1,    B_i = W_i J_i T V

W_i whitens the posture's noise: markers, and each joint's play along its lever arms. V spans what the candidates tell
at all (singular values above a cliff); `rest`, the gauge, no posture tells, and it does not move the hand.
The hand's position at posture e then has the standard deviation sqrt(trace(P_e C P_e')), P_e = J_e T V: what
calibration leaves, the joints' own random errors apart.
Reference: Pukelsheim, Optimal Design of Experiments, 2006.
"""

from dataclasses import dataclass

import numpy as np

from calibration.bodies import body_poses
from calibration.hand import HandModel
from calibration.markers import base_body, hand_body
from calibration.parameters import ParameterSet
from calibration.schema import Description
from calibration.se3 import adjoint, inverse

_CLIFF = 1e-6  # singular values below this share of the largest are zero [-]
SAMPLES = 100  # of the markers, that a dwell averages


@dataclass(frozen=True)
class Prospect:
    """Candidate postures and what is known so far.

    Attributes:
        q: (n, n_measured) candidates [rad, m].
        B: (n, d, r) what each would tell [-].
        P: (e, 3, r) hand position at other postures, by x [m].
        V: (p, r) directions of the scaled parameters.
        scale: (p,) tolerances [m, rad].
        J_joint: (n, d, k) whitened, by joint position: the errors of flanks.
        C: (r, r) covariance of x by what is recorded already.
    """

    q: np.ndarray
    B: np.ndarray
    P: np.ndarray
    V: np.ndarray
    scale: np.ndarray
    J_joint: np.ndarray
    C: np.ndarray

    def after(self, chosen: np.ndarray) -> np.ndarray:
        """Covariance (r, r) of x with the chosen candidates recorded too."""
        flat = self.B[chosen].reshape(-1, self.B.shape[2])
        return np.asarray(np.linalg.inv(np.linalg.inv(self.C) + flat.T @ flat))

    def sigma(self, C: np.ndarray) -> np.ndarray:
        """(p,) standard deviations of the parameters at covariance C of x [m, rad]."""
        told = np.einsum("pr,rs,ps->p", self.V, C, self.V)
        untold = 1.0 - (self.V**2).sum(axis=1)
        return np.asarray(self.scale * np.sqrt(np.maximum(told + untold, 0.0)))

    def hand(self, C: np.ndarray) -> np.ndarray:
        """(e,) standard deviation of the hand's position at covariance C of x [m]."""
        return np.asarray(np.sqrt(np.einsum("eij,jk,eik->e", self.P, C, self.P)))


def prospect(
    model: HandModel,
    parameters: ParameterSet,
    description: Description,
    play: np.ndarray,
    q: np.ndarray,
    at: np.ndarray,
) -> Prospect:
    """Candidates q (n, n_measured), nothing recorded yet, the hand to be predicted at postures `at` (e, n_measured).

    Args:
        model: The robot as far as it is known.
        parameters: What is to be found, with tolerances.
        description: Markers and their noise.
        play: (k,) random error of each joint's reading [rad, m].
        q: Candidates.
        at: Where the hand is to be predicted.
    """
    found = model.poses_and_derivatives(q, n_parameters=len(parameters))
    Ad = adjoint(inverse(found.T))
    S = _cluster(description, "hand") + Ad @ _cluster(description, "base") @ np.swapaxes(Ad, 1, 2)
    W = np.linalg.inv(np.linalg.cholesky(S + (found.J_joint * play**2) @ np.swapaxes(found.J_joint, 1, 2)))
    A = (W @ found.J) * parameters.scale
    V = told_directions(A)
    P = model.poses_and_derivatives(at, n_parameters=len(parameters)).J[:, :3] * parameters.scale @ V
    return Prospect(q, A @ V, P, V, parameters.scale, W @ found.J_joint, np.eye(V.shape[1]))


def told_directions(A: np.ndarray) -> np.ndarray:
    """V (p, r): what whitened, scaled derivatives A (n, d, p) tell at all."""
    _, s, Vt = np.linalg.svd(np.linalg.qr(A.reshape(-1, A.shape[2]), mode="r"))
    return np.asarray(Vt[: int((s > _CLIFF * s[0]).sum())].T)


def _cluster(description: Description, which: str) -> np.ndarray:
    """Covariance (6, 6) of a dwell's mean pose of the base's or the hand's markers [m, rad]."""
    body = base_body(description) if which == "base" else hand_body(description)
    if not body.markers:
        return np.zeros((6, 6))
    xyz = np.array([m.xyz for m in body.markers])
    return np.asarray(body_poses(xyz, xyz[None]).covariance[0] * description.sigmas.marker**2 / SAMPLES)
