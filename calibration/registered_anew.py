"""A calibrated robot whose markers were put on anew: both frames fitted to a few postures, and what that is worth.

    frames = argmin sum_i |w log6(T_i^-1 T_B_H(q_i))|^2,    error of frames = -L w (J_g dg + e),    L = (w J_f)^+ w

dg ~ N(0, Sigma_g) is the error of all that stays (placements, zeros, gears), e_i the random errors of the postures'
readings and of the hand, covariance S_i, both as the calibration found them. So frames and geometry are off together:

    covariance of (frames, g) = A Sigma_g A' + (L w S w L', 0),    A = (-L w J_g, 1)
"""

from dataclasses import replace

import numpy as np

from calibration.compensator import Compensator
from calibration.hand import HandModel
from calibration.reregistration import fit_frames, frame_weights
from calibration.schema import Description


def registered_anew(robot: Compensator, q: np.ndarray, T_measured: np.ndarray, description: Description) -> Compensator:
    """The robot with its marker frames fitted to static postures, its geometry and zeros held.

    Args:
        robot: As calibrated on another day.
        q: (n, n_joints) readings at rest [rad, m].
        T_measured: (n, 4, 4) T_B_H, the hand's marker body in the base's.
        description: Of the laboratory.

    Raises:
        NotEnoughData: They turn the hand about one direction only.
    """
    hand = fit_frames(robot.hand, q, T_measured, description)
    return replace(robot, hand=hand, covariance=_covariance(robot, hand, q, frame_weights(description)))


def _covariance(robot: Compensator, hand: HandModel, q: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(p, p) of frames and all that stays, postures weighed by `weight` (6,)."""
    n, p = len(q), len(robot.covariance)
    found = hand.poses_and_derivatives(q, n_parameters=p)
    J = (weight[:, None] * found.J).reshape(6 * n, p)
    L = np.linalg.pinv(J[:, :12])
    A = np.vstack([-L @ J[:, 12:], np.eye(p - 12)])
    S = robot.spread.random_errors(found.J_joint)
    each = (L.reshape(12, n, 6) * weight).transpose(1, 0, 2)
    covariance = A @ robot.covariance[12:, 12:] @ A.T
    covariance[:12, :12] += (each @ S @ each.transpose(0, 2, 1)).sum(axis=0)
    return np.asarray(covariance)
