"""Epoch of an instrument on the motion-capture clock, from lags of several trials.

    t_mocap = s (1 + drift) + offset                      s on the instrument's clock [s]
    lag_k = offset + drift s_k + noise_k                  s_k the middle of trial k
    drift_k = drift + noise'_k                            where a trial is long enough to show its own
    var noise_k = B^2 (sigma_k^2 + floor^2)               B^2 = max(1, chi2 / degrees of freedom)   (Birge ratio)

The model errors of a trial grow with its own sigma: what moves little shows little, and most of it wrong. What all
trials share is added at the end. A trial far off the median line is left out and named. Times are centred
before the line is fitted.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import theilslopes

from calibration.errors import NotEnoughData
from calibration.lag import Lag

_DRIFT = 1e-4  # prior standard deviation of a clock's drift [-]: 100 ppm
_FAR = 5.0  # robust standard deviations
_TRIAL = 5e-5  # [s] floor of a trial's sigma; twice it over the trial is that of its own drift


@dataclass(frozen=True)
class Clock:
    """A clock: t_mocap = t (1 + drift) + offset.

    Attributes:
        instrument: `robot` or `plate`.
        offset: At t = 0 [s].
        drift: [-].
        covariance: (2, 2) of (offset, drift) [s, -].
        epoch: Time on the instrument's clock [s] at which offset and drift are uncorrelated.
        sigma: Standard deviation of t_mocap at `epoch` [s].
    """

    instrument: str
    offset: float
    drift: float
    covariance: np.ndarray
    epoch: float
    sigma: float

    def to_mocap(self, t: np.ndarray) -> np.ndarray:
        """Times t [s] of the instrument on the motion-capture clock [s]."""
        return t + (self.offset + self.drift * t)

    def from_mocap(self, t: np.ndarray) -> np.ndarray:
        """Times t [s] of the motion-capture clock on the instrument's clock [s]."""
        return (t - self.offset) / (1.0 + self.drift)


def shared_clock(instrument: str) -> Clock:
    """The clock of an instrument that one machine samples together with the motion capture."""
    return Clock(instrument, 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)


@dataclass(frozen=True)
class TrialLag:
    """What one trial says of a clock.

    Attributes:
        trial_id: The trial.
        s: Time on the instrument's clock [s] at which lag and drift are uncorrelated.
        lag: At s.
        drift: Within the trial [-].
        drift_sigma: Its standard deviation [-]; infinite where the trial alone does not tell.
        duration: Of the trial [s].
        wound: Mean lateness that the fit laid to gears wound by friction, not in the lag [s].
        unseen: What the fit would lay to the lag of a winding by 0.1 mrad in all loaded joints [s].
    """

    trial_id: str
    s: float
    lag: Lag
    drift: float = 0.0
    drift_sigma: float = np.inf
    duration: float = np.inf
    wound: float = 0.0
    unseen: float = 0.0


def fit_clock(instrument: str, trials: list[TrialLag], common: float = 0.0) -> tuple[Clock, tuple[str, ...]]:
    """The clock, and the ids of the trials left out.

    Args:
        instrument: Its name.
        trials: Lags of several trials.
        common: Standard deviation of what all trials share [s].

    Raises:
        NotEnoughData: No trial gave a lag.
    """
    if not trials:
        raise NotEnoughData(
            f"no calibration trial tells the {instrument} clock from the motion-capture clock: record one with 10 s "
            "of arm motion"
        )
    s = np.array([t.s for t in trials])
    lag = np.array([t.lag.value for t in trials])
    sigma = np.array([np.hypot(t.lag.sigma, _TRIAL) for t in trials])
    kept = _inliers(s, lag, sigma)
    within = np.array([(t.drift, np.hypot(t.drift_sigma, 2.0 * _TRIAL / t.duration)) for t in trials])[kept]
    (offset, drift), (var_lag, var_drift), centre = _line(s[kept], lag[kept], sigma[kept], within)
    var_lag += common**2
    J = np.array([[1.0, -centre], [0.0, 1.0]])
    covariance = J @ np.diag([var_lag, var_drift]) @ J.T
    clock = Clock(instrument, float(offset - drift * centre), float(drift), covariance, centre, float(np.sqrt(var_lag)))
    return clock, tuple(t.trial_id for t, k in zip(trials, kept, strict=True) if not k)


def _inliers(s: np.ndarray, lag: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Trials near the Theil-Sen line; all of them when there are fewer than four."""
    if len(s) < 4:
        return np.ones(len(s), dtype=bool)
    slope = float(np.clip(theilslopes(lag, s)[0], -5.0 * _DRIFT, 5.0 * _DRIFT))
    r = lag - slope * s
    r = r - np.median(r)
    spread = 1.4826 * np.median(np.abs(r))
    return np.abs(r) <= _FAR * np.hypot(spread, sigma)


def _line(
    s: np.ndarray, lag: np.ndarray, sigma: np.ndarray, within: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """(lag at the centre, drift), their variances, and the centre: weighted least squares, a prior on the drift.

    `within` (n, 2) is each trial's own drift and its sigma [-].
    """
    w, w_drift = sigma**-2.0, within[:, 1] ** -2.0
    centre, reference = float(w @ s / w.sum()), float(w @ lag / w.sum())
    d = s - centre
    information = float(w @ d**2 + w_drift.sum()) + _DRIFT**-2
    drift = float(w @ (d * (lag - reference)) + w_drift @ within[:, 0]) / information
    chi2 = float(w @ (lag - reference - drift * d) ** 2 + w_drift @ (within[:, 0] - drift) ** 2)
    dof = len(s) + int((w_drift > 0.0).sum()) - 2
    birge = max(1.0, chi2 / dof) if dof > 0 else 1.0
    return (reference, drift), (birge / float(w.sum()), birge / information), centre
