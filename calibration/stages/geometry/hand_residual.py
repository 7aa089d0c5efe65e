"""Where the hand was in static or passing postures, against the hand model.

    r_i = log6(T_measured_i^-1 T_B_H(q_i, theta))       local twist [m, rad], where the hand's pose was measured
    r_i = p_B_c(q_i, theta) - p_measured_i              [m, base body's axes], where a point c of it was

Random errors: each joint's reading along its lever arms, the hand's position and rotation where asked for, the markers.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calibration.inference.map_estimate import Fit, Problem, solve
from calibration.inference.parameters import ParameterSet
from calibration.inference.residual import Linearised, Noise
from calibration.mocap.postures import Postures
from calibration.numerics.lie import inverse, jlog6, log6, moved, places
from calibration.robot.hand import HandModel
from calibration.stages.geometry.parameters import reading_names

HAND_NAMES = ("hand.position", "hand.rotation")
MARKERS = "markers"


@dataclass(frozen=True)
class NoiseModel:
    """Random errors to begin with, and the least of each, standard deviations.

    Attributes:
        reading: (k,) of the joints' readings [rad, m]; empty where they have none.
        floor: (k,) least of them: the encoders' own noise.
        pose: Of the hand's position [m] and rotation [rad], (2,); empty where all is left to joints and markers.
        stated: The joints' are a datasheet's, so that none is dropped as needless.
    """

    reading: np.ndarray
    floor: np.ndarray
    pose: np.ndarray
    stated: bool = False


@dataclass(frozen=True)
class HandResidual:
    """Measured and predicted poses, or points, of the hand.

    Attributes:
        hand: The robot; parameters that are not fitted keep their values.
        names: Parameters that are fitted.
        postures: The data.
        errors: Random errors.
        roots: (n, d, d) R with R R' the covariance of the measurements; that of the postures where not given.
        tau: (n, k) gravity torques at the readings, where they are known already.
    """

    hand: HandModel
    names: tuple[str, ...]
    postures: Postures
    errors: NoiseModel
    roots: np.ndarray | None = None
    tau: np.ndarray | None = None

    @cached_property
    def noise(self) -> Noise:
        """Readings, hand, markers."""
        k, n_pose, d = len(self.errors.reading), len(self.errors.pose), self.postures.components
        group = np.concatenate([np.arange(k), k + np.repeat(np.arange(n_pose), 3), np.full(d, k + n_pose)])
        of_the_hand = np.arange(k + n_pose + 1)
        return Noise(
            (*(reading_names(self.hand.nominal) if k else ()), *HAND_NAMES[:n_pose], MARKERS),
            group,
            np.concatenate([self.errors.reading, self.errors.pose, [1.0]]),
            np.concatenate([self.errors.floor, 1e-2 * self.errors.pose, [1.0]]),
            of_the_hand < k + n_pose,
            of_the_hand >= k,
        )

    def linearise(self, theta: np.ndarray) -> Linearised:
        """Residuals and derivatives at theta (p,)."""
        postures = self.postures
        found = self.hand.with_theta(theta, self.names).poses_and_derivatives(postures.q, self.tau, self.names)
        if postures.components == 3:
            R, c = found.T[:, :3, :3], postures.point
            r = places(found.T, c) - postures.T_base_hand[:, :3, 3]
            return Linearised(theta, r, moved(R, found.J, c), self._sources(moved(R, found.J_joint, c)))
        r = log6(inverse(postures.T_base_hand) @ found.T)
        J_log = jlog6(r)
        return Linearised(theta, r, J_log @ found.J, self._sources(J_log @ found.J_joint))

    @cached_property
    def _roots(self) -> np.ndarray:
        return np.linalg.cholesky(self.postures.covariance) if self.roots is None else self.roots

    def _sources(self, J_joint: np.ndarray) -> np.ndarray:
        """B (n, d, m) from derivatives by the joints' positions (n, d, k)."""
        eye = np.eye(6)[: J_joint.shape[1], : 3 * len(self.errors.pose)]
        of_the_hand = np.broadcast_to(eye, (len(J_joint), *eye.shape))
        return np.concatenate([J_joint[:, :, : len(self.errors.reading)], of_the_hand, self._roots], axis=2)


def linearised(model: HandModel, theta: np.ndarray, postures: Postures, names: tuple[str, ...]) -> Linearised:
    """Residuals and derivatives at the values theta (p,) of the named parameters; B by the joints' positions first."""
    k = len(model.nominal.joints)
    return HandResidual(model, names, postures, NoiseModel(np.ones(k), np.zeros(k), np.zeros(0))).linearise(theta)


def fit(model: HandModel, parameters: ParameterSet, postures: Postures, reading: np.ndarray, floor: np.ndarray) -> Fit:
    """Fit parameters of `model` from their nominal values.

    Args:
        model: Nominal robot.
        parameters: What is estimated and its priors.
        postures: The data.
        reading: (k,) start value of the joints' random errors [rad, m].
        floor: (k,) least of them: the encoders' own noise [rad, m].
    """
    errors = NoiseModel(np.maximum(reading, floor), floor, np.zeros(0))
    problem = hand_problem(model, parameters, postures, errors)
    return solve(problem, problem.linearise(parameters.nominal))


def hand_problem(model: HandModel, parameters: ParameterSet, postures: Postures, errors: NoiseModel) -> Problem:
    """The problem of `fit`, with the hand's own random errors where they are given."""
    tau = model.nominal.gravity_torques(postures.q)
    residual = HandResidual(model, parameters.names, postures, errors, tau=tau)
    return Problem((residual,), parameters, errors.stated)


def fit_weighted(model: HandModel, parameters: ParameterSet, postures: Postures, W: np.ndarray) -> Fit:
    """Fit with given whiteners W (n, d, d) and no random errors of the joints; sigma from the residuals' own size."""
    none = NoiseModel(np.zeros(0), np.zeros(0), np.zeros(0), stated=True)
    residual = HandResidual(model, parameters.names, postures, none, np.linalg.inv(W))
    problem = Problem((residual,), replace(parameters, group=()), stated=True)
    found = solve(problem, problem.linearise(parameters.nominal))
    factor = float((found.r_white**2).sum()) / max(1, found.r_white.size - len(parameters))
    return replace(found, covariance=factor * found.covariance)
