"""What `Compensator` returns: poses of the hand with their covariance, and the state after a sample."""

from dataclasses import dataclass

import numpy as np

from calibration.prediction.base_pose import BaseState
from calibration.prediction.bundled_arm import ArmState


@dataclass(frozen=True)
class RobotState:
    """State after a sample.

    Attributes:
        arm: Its drive trains; None where the estimate has none.
        base: The base under a wrench; None without one.
    """

    arm: ArmState | None = None
    base: BaseState | None = None


@dataclass(frozen=True)
class HandPose:
    """Predicted poses of the hand body.

    Attributes:
        T: (n, 4, 4) in the lab, or in the base frame at rest where the base's pose was not given.
        covariance: (n, 6, 6) of the local twist [m, rad], for a base frame located by its own markers.
        state: For the next step; None of a recording.
    """

    T: np.ndarray
    covariance: np.ndarray
    state: RobotState | None = None
