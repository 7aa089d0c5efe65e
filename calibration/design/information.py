"""Information of postures before they are recorded.

    theta = nominal + T (V x + rest),      T = diag(tolerance),   x ~ N(0, I) beforehand
    x | postures ~ N(., C),    C = (I + sum_i B_i' B_i)^-1,    B_i = W_i J_i T V

W_i whitens the posture's noise: markers, and each joint's backlash along its lever arms. V spans what the candidates
identify at all (singular values above a cliff); `rest`, the gauge, no posture identifies, and it does not move the
hand. The hand's position at posture e then has the standard deviation sqrt(trace(P_e C P_e')), P_e = J_e T V: what
calibration leaves, the joints' own random errors apart. With nuisances z (`departures`) it is the root of

    trace(P_e C P_e') + |P_e C m - Z_e|^2,     m = sum_i B_i' H_i,     H_i = W_i G_i,  Z_e = G_e for the position

since a fit that does not ask for z is off by C m z.
Reference: Pukelsheim, Optimal Design of Experiments, 2006.

What a robot does that its calibration does not ask for, as nuisances z ~ N(0, I) with widths of a datasheet.

    placement of joint j    turned by  b_j M_j z        bending under the moment M_j across its axis

It is a function of the posture, not noise: the fit takes it for geometry, and a design that knows only noise goes
where it is largest. M is the gravity moment in the joint's frame [N.m]. Gravity-loaded backlash is estimated (`gears`).
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.inference.parameters import ParameterSet
from calibration.mocap.cluster_pose import body_poses
from calibration.numerics.lie import adjoint, inverse, moved
from calibration.recording.schema import Body, Description
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel, HandPoses

_CLIFF = 1e-6  # singular values below this share of the largest are zero [-]
SAMPLES = 100  # of the markers, that a dwell averages
_BENDING = 3e-3  # of a joint's place at the largest moment it carries, a tenth of what gears give [rad]
_LEAST = 0.5  # [N.m] a joint that gravity loads less is not asked


@dataclass(frozen=True)
class Prospect:
    """Candidate postures and what is known so far.

    Attributes:
        q: (n, n_measured) candidates [rad, m].
        B: (n, d, r) information of each [-].
        P: (e, 3, r) hand position at other postures, by x [m].
        V: (p, r) directions of the scaled parameters.
        scale: (p,) tolerances [m, rad].
        J_joint: (n, d, k) whitened, by joint position: the errors of flanks.
        C: (r, r) covariance of x by what is recorded already.
        H: (n, d, z) what each nuisance does to each candidate, whitened [-].
        Z: (e, 3, z) and to the hand at those other postures [m].
    """

    q: np.ndarray
    B: np.ndarray
    P: np.ndarray
    V: np.ndarray
    scale: np.ndarray
    J_joint: np.ndarray
    C: np.ndarray
    H: np.ndarray
    Z: np.ndarray

    def after(self, chosen: np.ndarray) -> np.ndarray:
        """Covariance (r, r) of x with the chosen candidates recorded too."""
        flat = self.B[chosen].reshape(-1, self.B.shape[2])
        return np.asarray(np.linalg.inv(np.linalg.inv(self.C) + flat.T @ flat))

    def pulled(self, chosen: np.ndarray) -> np.ndarray:
        """m (r, z): how the nuisances pull at x in the chosen candidates."""
        rows, z = len(chosen) * self.H.shape[1], self.H.shape[2]
        return np.asarray(self.B[chosen].reshape(rows, self.B.shape[2]).T @ self.H[chosen].reshape(rows, z))

    def sigma(self, C: np.ndarray) -> np.ndarray:
        """(p,) standard deviations of the parameters at covariance C of x [m, rad]."""
        expected = ((self.V @ C) * self.V).sum(axis=1)
        outside = 1.0 - (self.V**2).sum(axis=1)
        return np.asarray(self.scale * np.sqrt(np.maximum(expected + outside, 0.0)))

    def hand(self, C: np.ndarray, m: np.ndarray | None = None) -> np.ndarray:
        """(e,) root mean square error of the hand's position at covariance C of x, nuisances pulling by m [m]."""
        noise = ((self.P @ C) * self.P).sum(axis=(1, 2))
        if m is None:
            return np.asarray(np.sqrt(noise))
        return np.asarray(np.sqrt(noise + ((self.P @ (C @ m) - self.Z) ** 2).sum(axis=(1, 2))))


def prospect(
    model: HandModel,
    parameters: ParameterSet,
    description: Description,
    reading_sigma: np.ndarray,
    q: np.ndarray,
    at: np.ndarray,
    known: np.ndarray | None = None,
) -> Prospect:
    """Candidates q (n, n_measured), the hand to be predicted at postures `at` (e, n_measured).

    Args:
        model: The robot as far as it is known.
        parameters: What is to be found, with tolerances.
        description: Markers and their noise.
        reading_sigma: (k,) random error of each joint's reading [rad, m].
        q: Candidates.
        at: Where the hand is to be predicted.
        known: (p, p) covariance of the scaled parameters by what is recorded already; V is the identity then.
    """
    p = len(parameters)
    found = model.poses_and_derivatives(q, names=parameters.names)
    W, J, J_joint = _whitened(found, description, reading_sigma)
    A = (W @ J) * parameters.scale
    V = identified_directions(A) if known is None else np.eye(p)
    P = model.poses_and_derivatives(at, names=parameters.names).J[:, :3] * parameters.scale @ V
    C = np.eye(V.shape[1]) if known is None else known
    none = np.zeros((*A.shape[:2], 0)), np.zeros((*P.shape[:2], 0))
    return Prospect(q, A @ V, P, V, parameters.scale, W @ J_joint, C, *none)


def _whitened(
    found: HandPoses, description: Description, play: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """W (n, d, d), derivatives by parameters and by joints of what a dwell measures: a pose, or lone markers' place."""
    S, J, J_joint = dwell_noise(found.T, description), found.J, found.J_joint
    if S.shape[1] == 3:
        R, c = found.T[:, :3, :3], description.hand_body.point
        J, J_joint = moved(R, J, c), moved(R, J_joint, c)
    return np.linalg.inv(np.linalg.cholesky(S + (J_joint * play**2) @ np.swapaxes(J_joint, 1, 2))), J, J_joint


def dwell_noise(T: np.ndarray, description: Description) -> np.ndarray:
    """Covariance (n, 6, 6) of a dwell's hand poses T (n, 4, 4) by the markers; (n, 3, 3) of a point's place."""
    hand, Ad = description.hand_body, adjoint(inverse(T))
    S = Ad @ _cluster(description.base_body, description) @ np.swapaxes(Ad, 1, 2)
    if not hand.is_point:
        return np.asarray(S + _cluster(hand, description))
    R, n = T[:, :3, :3], SAMPLES * len(hand.markers)
    return np.asarray(R @ S[:, :3, :3] @ np.swapaxes(R, 1, 2) + description.sigmas.marker**2 / n * np.eye(3))


def identified_directions(A: np.ndarray) -> np.ndarray:
    """V (p, r): what whitened, scaled derivatives A (n, d, p) identify at all."""
    _, s, Vt = np.linalg.svd(np.linalg.qr(A.reshape(-1, A.shape[2]), mode="r"))
    return np.asarray(Vt[: int((s > _CLIFF * s[0]).sum())].T)


def _cluster(body: Body, description: Description) -> np.ndarray:
    """Covariance (6, 6) of a dwell's mean pose of a marker body [m, rad]; 0 for one that has no markers."""
    if not body.markers:
        return np.zeros((6, 6))
    xyz = np.array([m.xyz for m in body.markers])
    return np.asarray(body_poses(xyz, xyz[None]).covariance[0] * description.sigmas.marker**2 / SAMPLES)


@dataclass(frozen=True)
class Departures:
    """Widths of the nuisances.

    Attributes:
        bending: (k,) b of each joint's placement [rad/(N.m)].
    """

    bending: np.ndarray

    def effects(self, model: HandModel, q: np.ndarray) -> np.ndarray:
        """Local twists of the hand (n, 6, k) at readings q (n, n_measured), for each z = 1."""
        turns = model.kinematics(q, np.zeros((len(q), len(self.bending)))).J_frame[:, :, 1:, 3:]
        return np.asarray(np.einsum("ndkj,nkj->ndk", turns, self.bending[:, None] * model.chain.gravity_moments(q)))


def departing(
    expected: Prospect,
    model: HandModel,
    description: Description,
    play: np.ndarray,
    departures: Departures,
    at: np.ndarray,
) -> Prospect:
    """A prospect of the hand at postures `at`, with nuisances that its fit does not ask for."""
    found = model.poses_and_derivatives(expected.q, names=())
    W, *_ = _whitened(found, description, play)
    G = departures.effects(model, expected.q)
    if W.shape[1] == 3:
        G = moved(found.T[:, :3, :3], G, description.hand_body.point)
    return replace(expected, H=W @ G, Z=departures.effects(model, at)[:, :3])


def departures_of(chain: Chain, q: np.ndarray) -> Departures:
    """Those of a robot whose moments are as at postures q (n, n_measured)."""
    largest = np.linalg.norm(chain.gravity_moments(q), axis=2).max(axis=0)
    return Departures(np.where(largest > _LEAST, _BENDING / np.maximum(largest, _LEAST), 0.0))
