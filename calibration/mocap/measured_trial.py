"""A trial with the poses of its marker bodies on the motion capture's clock, each computed once.

T_base_hand = T_lab_base^-1 T_lab_hand
C           = C_hand + Ad(T_hand_base) C_base Ad(T_hand_base)'        local twist, 1 m of noise per axis and marker
"""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from calibration.mocap.cluster_pose import BodyPoses, poses_of
from calibration.numerics.lie import adjoint, inverse
from calibration.recording.schema import Body, Description
from calibration.recording.trial import REST, Trial


@dataclass(frozen=True)
class MeasuredTrial(Trial):
    """A trial of a laboratory.

    Attributes:
        description: Of the dataset.
    """

    description: Description = field(kw_only=True)

    @classmethod
    def of(cls, description: Description, trial: Trial) -> "MeasuredTrial":
        """The trial with the laboratory's bodies; itself where it has them."""
        if isinstance(trial, cls):
            return trial
        return cls(**{f.name: getattr(trial, f.name) for f in fields(Trial)}, description=description)

    def with_readings(self, q_motor: np.ndarray) -> "MeasuredTrial":
        """The trial with other motor readings (n, k) [rad, m]; the poses stay."""
        other = replace(self, q_motor=q_motor)
        object.__setattr__(other, "_poses", self._poses)
        return other

    def poses(self, body: Body) -> BodyPoses:
        """Poses of a marker body at `t_mocap`.

        Raises:
            NotEnoughData: The trial does not record three of its markers.
        """
        if body.name not in self._poses:
            self._poses[body.name] = poses_of(body, self)
        return self._poses[body.name]

    @cached_property
    def _poses(self) -> dict[str, BodyPoses]:
        return {}

    @property
    def base(self) -> BodyPoses:
        """Poses of the base body."""
        return self.poses(self.description.base_body)

    @property
    def hand(self) -> BodyPoses:
        """Poses of the hand body."""
        return self.poses(self.description.hand_body)

    @cached_property
    def T_base_hand(self) -> np.ndarray:  # noqa: N802
        """(m, 4, 4), NaN where base or hand is not seen."""
        return inverse(self.base.T) @ self.hand.T

    def covariance(self, rows: np.ndarray) -> np.ndarray:
        """Covariance (n, 6, 6) [m, rad] of T_base_hand's local twist in some samples, by datasheet noise."""
        unit = hand_covariance(self.T_base_hand[rows], self.base.covariance[rows], self.hand.covariance[rows])
        return self.description.sigmas.marker**2 * unit

    @property
    def rest(self) -> np.ndarray:
        """(m,) samples of the first second, in which every trial rests."""
        return self.t_mocap <= self.t_mocap[0] + REST


def hand_covariance(T_base_hand: np.ndarray, base: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """Covariance of the local twist of T_base_hand (n, 4, 4) from those of base and hand (n, 6, 6)."""
    Ad = adjoint(inverse(T_base_hand))
    return np.asarray(hand + Ad @ base @ np.swapaxes(Ad, 1, 2))
