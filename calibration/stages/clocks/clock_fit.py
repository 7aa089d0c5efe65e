"""Epoch of an instrument on the motion-capture clock, from lags of several trials.

    t_mocap = s (1 + drift) + offset                      s on the instrument's clock [s]
    lag_k = offset + drift s_k + m wound_k + noise_k      s_k the middle of trial k, m ~ N(0, 1)
    drift_k = drift + noise'_k                            where a trial is long enough to show its own
    var noise_k = B^2 (sigma_k^2 + floor^2)               B^2 = max(1, chi2 / degrees of freedom)   (Birge ratio)

The model errors of a trial grow with its own sigma: what moves little shows little, and most of it wrong. wound_k is
the lateness that the fit of trial k laid to gears wound by friction, less its weighted mean: a share m of it, any up to
all, is the clock's. Sweeps wind little and are recorded first, swings that fold much and last: without m that share is
taken for drift. What all trials share is added at the end. A trial far off the median line is left out and named.
Times are centred before the line is fitted.

How late an instrument shows a motion, alike in all trials, where no recording can separate it from its clock.

Robot: a link is late behind viscous friction c on a mesh of stiffness k by c / k, and where dry friction f winds the
mesh by f / k over the speed,

    late = c / k + left * wound + u * unseen,     ln(c / k) ~ N(ln delay, spread^2),   left ~ U(0, 0.2),   u ~ N(1, 1)

delay and spread are the datasheet's (`Tolerances`): 50 us of strain-wave gears (0.5 N.m.s/rad on 10 kN.m/rad), a factor
of 1.8 either way from cold to worn in, where it has none; wound is the mean lateness of the hysteresis that the fit of
poses found in the loaded joints. Play operators are not quite what a wound gear does, and what a fit leaves of such a
term has the sign of what it took: of dry friction alone a tenth was left. Friction never makes a link early: hysteresis
that the fit finds to be early is something else, and only widens.
Short motions do not separate hysteresis from lag: of a winding by the datasheet's `joint_windup`, f / k of such gears
(0.1 mrad: 0.6 N.m on 9 kN.m/rad to 0.15 on 1), unseen is what the fit of each trial would lay to the clock; it is one
robot's, and no number of trials averages it.
Plate: an anti-alias filter's delay is a part of its clock.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import NotEnoughData
from calibration.numerics.time_delay import Lag
from calibration.recording.clock import Clock
from calibration.recording.schema import Tolerances

_DRIFT = 1e-4  # prior standard deviation of a clock's drift [-]: 100 ppm
_FAR = 5.0  # robust standard deviations
_TRIAL = 5e-5  # [s] floor of a trial's sigma; twice it over the trial is that of its own drift
_MISLAID = 1.0  # share of what the fit laid to gears wound by friction that is the clock's, standard deviation [-]
_LEFT = 0.2  # at most, of what dry friction winds
_PLATE = 3e-4  # [s]
NOT_SHOWN = Lag(np.nan, np.inf)


@dataclass(frozen=True)
class TrialLag:
    """What one trial says of a clock.

    Attributes:
        trial_id: The trial.
        s: Time on the instrument's clock [s] at which lag and drift are uncorrelated.
        lag: At s.
        drift: Within the trial [-].
        drift_sigma: Its standard deviation [-]; infinite where the trial alone does not identify it.
        duration: Of the trial [s].
        wound: Mean lateness that the fit laid to gears wound by friction, not in the lag [s].
        unseen: What the fit would lay to the lag of a winding by 0.1 mrad in all loaded joints [s].
        plain: The lag without nuisances, `NOT_SHOWN` where that motion shows none; None where it was not looked for.
    """

    trial_id: str
    s: float
    lag: Lag
    drift: float = 0.0
    drift_sigma: float = np.inf
    duration: float = np.inf
    wound: float = 0.0
    unseen: float = 0.0
    plain: Lag | None = None

    def contradicts(self, offset: float, drift: float) -> bool:
        """Whether its motion alone, without its nuisances, has a lag far from where a clock has it."""
        return self.plain is None or abs(self.plain.value - offset - drift * self.s) > _FAR * self.plain.sigma


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
            f"no calibration trial identifies the {instrument} clock from the motion-capture clock: record one with "
            "10 s of arm motion"
        )
    s = np.array([t.s for t in trials])
    lag = np.array([t.lag.value for t in trials])
    sigma = np.array([np.hypot(t.lag.sigma, _TRIAL) for t in trials])
    kept = _inliers(s, lag, sigma)
    within = np.array([(t.drift, np.hypot(t.drift_sigma, 2.0 * _TRIAL / t.duration)) for t in trials])[kept]
    wound = np.array([t.wound for t in trials])[kept]
    (offset, drift), (var_lag, var_drift), centre = _line(s[kept], lag[kept], sigma[kept], within, wound)
    var_lag += common**2
    J = np.array([[1.0, -centre], [0.0, 1.0]])
    covariance = J @ np.diag([var_lag, var_drift]) @ J.T
    clock = Clock(instrument, float(offset - drift * centre), float(drift), covariance, centre, float(np.sqrt(var_lag)))
    return clock, tuple(t.trial_id for t, k in zip(trials, kept, strict=True) if not k)


def _inliers(s: np.ndarray, lag: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Trials near the Theil-Sen line; all of them when there are fewer than four."""
    if len(s) < 4:
        return np.ones(len(s), dtype=bool)
    later, earlier = np.nonzero(s[:, None] > s)
    slope = np.median((lag[later] - lag[earlier]) / (s[later] - s[earlier])) if len(later) else 0.0
    slope = float(np.clip(slope, -5.0 * _DRIFT, 5.0 * _DRIFT))
    r = lag - slope * s
    r = r - np.median(r)
    spread = 1.4826 * np.median(np.abs(r))
    return np.abs(r) <= _FAR * np.hypot(spread, sigma)


def _line(
    s: np.ndarray, lag: np.ndarray, sigma: np.ndarray, within: np.ndarray, wound: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """(lag at the centre, drift), their variances, and the centre: weighted least squares, a prior on the drift.

    `within` (n, 2) is each trial's own drift and its sigma [-], `wound` (n,) what was laid to gears [s].
    """
    w, w_drift = sigma**-2.0, within[:, 1] ** -2.0
    centre, reference, mean = (float(w @ x / w.sum()) for x in (s, lag, wound))
    A = np.column_stack([s - centre, wound - mean])
    information = (A.T * w) @ A + np.diag([float(w_drift.sum()) + _DRIFT**-2, _MISLAID**-2])
    drift, mislaid = np.linalg.solve(information, A.T @ (w * (lag - reference)) + [w_drift @ within[:, 0], 0.0])
    left = lag - reference - A @ [drift, mislaid]
    chi2 = float(w @ left**2 + w_drift @ (within[:, 0] - drift) ** 2 + (mislaid / _MISLAID) ** 2)
    dof = len(s) + int((w_drift > 0.0).sum()) - 2
    birge = max(1.0, chi2 / dof) if dof > 0 else 1.0
    variance = float(np.linalg.inv(information)[0, 0])
    return (reference, float(drift)), (birge / float(w.sum()), birge * variance), centre


def allowance(instrument: str, lags: Sequence[TrialLag], known: Tolerances) -> tuple[float, float]:
    """Mean and standard deviation [s] of what all trials share."""
    if instrument == "plate":
        return 0.0, _PLATE
    if not lags:
        return 0.0, 0.0
    w = np.array([t.lag.sigma for t in lags]) ** -2.0
    wound, unseen = w @ [(t.wound, t.unseen) for t in lags] / w.sum()
    viscous = known.joint_delay * np.exp(0.5 * known.joint_delay_spread**2)
    spread = viscous * np.sqrt(np.expm1(known.joint_delay_spread**2))
    sigma = np.linalg.norm([spread, _LEFT / np.sqrt(12.0) * wound, unseen])
    return float(viscous + 0.5 * _LEFT * max(wound, 0.0) + unseen), float(sigma)
