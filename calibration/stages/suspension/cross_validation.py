"""Which axes of the base the suspension predicts better than a base that stays: leave one trial out.

    R2_a = 1 - sum_k sum_t (x - x_(-k))_a^2 / sum_k sum_t x_a^2          x_(-k): fitted without trial k, from the wrench

Zero is a base that stays, not the mean. One trial may slip more than all others move; an axis is moved only if R2 is
positive and, with such a trial counting no more than the others together, is worth it with and without the trial that
is most evidence for it: yaw, after a jolt, slips and is where no spring would put it. `explained` takes the motion
capture's noise (its variance at rest) off both sums: what share of the motion itself is the spring's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.stages.suspension.base_response import BaseResponse
from calibration.stages.suspension.modal_response import predicted

_WORTH = 0.05  # R2 below which an axis is not predicted [-]
_NOISE = 1.25  # how much more than expected the noise may be, known from one second a trial [-]
_SLIP = 0.1  # share of the motion [-]
_UNKNOWN = 0.05  # of what is left, noise included [-]
_VISIBLE = 1.5  # motion over noise, mean squares, below which its share cannot be determined [-]
_WILD = 25.0  # mean square over the median of the trials


@dataclass(frozen=True)
class HeldOut:
    """Sums over each trial when it was left out, six axes, or three.

    Attributes:
        error: (n_trials, axes) squared error.
        motion: (n_trials, axes) squared displacement.
        noise: (n_trials, axes) squared noise to be expected.
        count: (n_trials,) samples.
        ids: Of the trials; none in estimates of earlier versions.
    """

    error: np.ndarray
    motion: np.ndarray
    noise: np.ndarray
    count: np.ndarray
    ids: tuple[str, ...] = ()

    @property
    def r2(self) -> np.ndarray:
        """(6,) of all trials together."""
        return 1.0 - self.error.sum(axis=0) / np.maximum(self.motion.sum(axis=0), np.finfo(float).tiny)

    def variance(self, moves: np.ndarray) -> np.ndarray:
        """(6,) mean square of what is left of the displacement where an axis moves, of all of it where it stays.

        Noise is taken off, but not more than 95 % of it: what is hidden by noise is not known to be nothing.
        """
        left = np.where(moves, np.minimum(self.error, np.finfo(float).max), self.motion).sum(axis=0)
        return np.maximum(left - self.noise.sum(axis=0), _UNKNOWN * left) / max(float(self.count.sum()), 1.0)

    @property
    def wild(self) -> np.ndarray:
        """(n_trials,) trials with an error on an axis far beyond that of most: they slipped too far to be predicted."""
        square = self.error / np.maximum(self.count, 1.0)[:, None]
        return np.asarray((square > _WILD * np.median(square, axis=0)).any(axis=1))

    def only(self, trials: np.ndarray) -> "HeldOut":
        """Of some trials (n_trials,) bool."""
        ids = tuple(name for name, one in zip(self.ids, trials, strict=False) if one)
        return HeldOut(self.error[trials], self.motion[trials], self.noise[trials], self.count[trials], ids)

    def farthest(self, axis: int) -> tuple[int, "HeldOut | None"]:
        """The trial that moves an axis most, and the others if it moves it more than all of those together."""
        moved = self.motion[:, axis]
        most = int(moved.argmax())
        return most, self.only(np.arange(len(moved)) != most) if 2.0 * moved[most] > moved.sum() else None

    @property
    def still(self) -> np.ndarray:
        """(6,) of a base taken to stay: mean square of the trial that moved it most; noise taken off."""
        left = np.maximum(self.motion - self.noise, _UNKNOWN * self.motion)
        return np.asarray((left / np.maximum(self.count, 1.0)[:, None]).max(axis=0))

    @property
    def explained(self) -> np.ndarray:
        """(6,) share of the motion without noise; NaN where there is hardly any."""
        error, motion, noise = (a.sum(axis=0) for a in (self.error, self.motion, self.noise))
        visible = motion > _VISIBLE * noise
        share = 1.0 - (error - noise) / np.where(visible, motion - noise, 1.0)
        return np.where(visible, np.minimum(share, 1.0), np.nan)

    @property
    def slips(self) -> np.ndarray:
        """(6,) axes whose error is more than noise and a tenth of the motion: no spring's alone."""
        error, motion, noise = (a.sum(axis=0) for a in (self.error, self.motion, self.noise))
        return np.asarray(error > _NOISE * noise + _SLIP * np.maximum(motion - noise, 0.0))

    @property
    def moves(self) -> np.ndarray:
        """(6,) whether to move an axis."""
        error, axes = np.minimum(self.error, np.finfo(float).max), np.arange(self.motion.shape[1])
        others = self.motion.sum(axis=0) - self.motion
        weight = np.minimum(1.0, others / np.maximum(self.motion, np.finfo(float).tiny))
        motion, gain = weight * self.motion, weight * (self.motion - error)
        best = gain.argmax(axis=0)
        rest_motion, rest_gain = (a.sum(axis=0) - a[best, axes] for a in (motion, gain))
        worth = gain.sum(axis=0) > _WORTH * motion.sum(axis=0)
        return np.asarray((self.r2 > 0.0) & worth & (rest_gain > _WORTH * rest_motion))


def held_out(responses: Sequence[BaseResponse], without: Callable[[int], tuple[np.ndarray, np.ndarray]]) -> HeldOut:
    """Predict every trial by K and C fitted without it."""
    rows = []
    for k, response in enumerate(responses):
        e = (response.x - predicted(*without(k), response.forcing))[response.valid]
        rows.append(
            ((e**2).sum(axis=0), (response.x[response.valid] ** 2).sum(axis=0), len(e) * response.noise, len(e))
        )
    error, motion, noise, count = (np.array(a, dtype=float) for a in zip(*rows, strict=True))
    return HeldOut(error, motion, noise, count, tuple(response.trial_id for response in responses))
