"""What `Compensator` returns: poses of the hand with their covariance, and the state after a sample."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

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
        uncertainty: Computes `covariance`, which costs more than the pose.
        state: For the next step; None of a recording.
    """

    T: np.ndarray
    uncertainty: Callable[[], np.ndarray]
    state: RobotState | None = None

    @cached_property
    def covariance(self) -> np.ndarray:
        """(n, 6, 6) of the local twist [m, rad], for a base frame located by its own markers; when first asked for."""
        return self.uncertainty()
