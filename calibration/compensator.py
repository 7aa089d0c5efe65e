"""The estimate in use: readings in, hand pose and its uncertainty out.

T_lab_hand = T_lab_base T_base_tool(q_motor - offset) T_tool_H
covariance of its local twist = J Sigma J' + J_joint diag(play^2) J_joint'
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration.arm import PREFIX, first_joint, placement_derivative
from calibration.errors import InputError, NotCalibrated, ShapeError
from calibration.estimate import Estimate
from calibration.estimate_files import load_estimate
from calibration.hand import HandModel
from calibration.parameters import AXES, parameter_names
from calibration.robot import chain_of_frames


@dataclass(frozen=True)
class HandPose:
    """Predicted poses of the hand body.

    Attributes:
        T: (n, 4, 4) in the lab, or in the base frame where the base's pose was not given.
        covariance: (n, 6, 6) of the local twist [m, rad], for a base frame located by its own markers.
    """

    T: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Compensator:
    """The main model of an estimate.

    Attributes:
        hand: The calibrated robot.
        covariance: (p, p) of its parameters, in the order of `HandModel.theta`.
        play: (k,) random reading error of each joint [rad, m].
    """

    hand: HandModel
    covariance: np.ndarray
    play: np.ndarray

    @classmethod
    def load(cls, folder: Path | str) -> "Compensator":
        """Read the folder of an estimate.

        Raises:
            InputError: The folder is not a saved estimate.
            NotCalibrated: The estimate must not be used.
        """
        estimate = load_estimate(folder)
        if not estimate.calibrated:
            raise NotCalibrated([v.message for v in estimate.verdicts if v.verdict == "refused"])
        if estimate.urdf is None or estimate.robot is None:
            raise InputError(folder, "not a whole estimate: nominal.urdf or the robot's joints and frames are missing")
        return cls.of(estimate)

    @classmethod
    def of(cls, estimate: Estimate) -> "Compensator":
        """The main model of an estimate that knows its robot."""
        if estimate.urdf is None or estimate.robot is None:
            raise NotCalibrated(["it does not say which robot it is about"])
        robot = estimate.robot
        chain = chain_of_frames(estimate.urdf, robot.joints, robot.base_frame, robot.tool_frame)
        model = estimate.model(estimate.main)
        names, known = parameter_names(chain), [p.name for p in model.parameters]
        G = np.array([[float(name == other) for other in known] for name in names])
        if f"{PREFIX}.x" in known:
            arm = [known.index(f"{PREFIX}.{axis}") for axis in AXES]
            first = names.index(f"geometry.{first_joint(chain)}.x")
            vector = np.array([model.parameters[i].value for i in arm])
            G[first : first + 6, arm] = placement_derivative(chain, vector)
        play = model.play if len(model.play) else np.zeros(len(chain.joints))
        return cls(model.hand(chain, np.zeros(12)), G @ model.covariance @ G.T, play)

    def predict(
        self,
        t: np.ndarray,
        q_motor: np.ndarray,
        wrench: np.ndarray | None = None,
        T_lab_base_start: np.ndarray | None = None,
    ) -> HandPose:
        """Hand poses at readings q_motor (n, n_joints) [rad, m], taken at t (n,) [s].

        Args:
            t: Times; this model has no memory and does not use them.
            q_motor: Readings, columns as in the estimate.
            wrench: Wrench on the base; this model holds the base still and does not use it.
            T_lab_base_start: (4, 4) pose of the base frame; identity where not given.
        """
        q = np.asarray(q_motor, dtype=float)
        if len(t) != len(q):
            raise ShapeError("q_motor", q.shape, (len(t), "n_joints"))
        T_lab_base = np.eye(4) if T_lab_base_start is None else np.asarray(T_lab_base_start, dtype=float)
        found = self.hand.poses_and_derivatives(q)
        moved = found.J_joint * self.play
        covariance = found.J @ self.covariance @ np.swapaxes(found.J, 1, 2) + moved @ np.swapaxes(moved, 1, 2)
        return HandPose(T_lab_base @ self.hand.in_base_frame(q), covariance)

    def step(
        self,
        t: float,
        q_motor: np.ndarray,
        wrench: np.ndarray | None = None,
        T_lab_base_start: np.ndarray | None = None,
    ) -> HandPose:
        """The same for one sample q_motor (n_joints,); arrays of length 1."""
        return self.predict(np.array([t]), np.asarray(q_motor, dtype=float)[None], wrench, T_lab_base_start)
