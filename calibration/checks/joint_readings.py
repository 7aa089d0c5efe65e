"""Joint readings that cannot be true: missing, beyond a joint's limits, or a link side that is not its motor's.

Zeros of either side may be anything; a link may be off its motor by its gear's backlash and deflection.

    y = q_motor - q_link - zero         rms y > 0.1 rad over calibration trials: ten times the backlash of a worn gear
    q_link ~ a q_motor + b              a = -1 sign, a = 180 / pi degrees, a = 0 stands still; by least squares

A polynomial of the angle explains such a discrepancy perfectly, so the R2 of a joint model does not show it.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.recording.posture_means import PostureMeans
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.verdict import Verdict

_APART, _FEW = 0.1, 20  # [rad, m] a link may be off its motor by this much, its zero apart; readings to judge by
_MARGIN = 0.3  # a reading may be outside its joint's limits by this much [rad, m] plus this share of the range
_COPIED = (
    0.01  # of an encoder's noise by which a reading may differ from its command; noise and quantisation are larger
)
_SHARE = 0.05  # of the samples that may be farther out
_BEYOND = 0.1  # rms [rad, m]
_NEAR = 0.1  # of the slope [-]
_FOLLOWS = 0.99  # correlation with another joint's motor side [-]
_SLOPES = ((-1.0, "its sign is turned"), (180.0 / np.pi, "it is in degrees"), (0.0, "it stands still"))


def missing_readings(trial: Trial | PostureMeans) -> Iterator[str]:
    """Joints whose motor-side readings have holes."""
    for k, name in enumerate(trial.joint):
        bad = np.flatnonzero(~np.isfinite(trial.q_motor[:, k]))
        if len(bad):
            yield f"joint {name}: {len(bad)} readings are missing, the first in sample {bad[0]}; cut them out"


def implausible_readings(chain: Chain, q: np.ndarray) -> Iterator[str]:
    """Joints whose readings q (n, n_measured) are far outside their limits."""
    if not len(q):
        return
    for name, column, low, high in zip(chain.measured, q.T, *chain.limits(), strict=True):
        margin = _MARGIN * (1.0 + (high - low))
        outside = float(((column < low - margin) | (column > high + margin)).mean())
        if outside > _SHARE:
            within = np.degrees(low) - 60.0 < column.min() and column.max() < np.degrees(high) + 60.0
            in_degrees = within and np.abs(column).max() > 2.0 * np.pi
            unit = " (recorded in degrees?)" if in_degrees and not chain.is_prismatic(name) else ""
            yield (
                f"joint {name!r} reads {column.min():.3g} to {column.max():.3g}, its limits are {low:.3g} to "
                f"{high:.3g}{unit}"
            )


def commanded(trial: Trial, sigma: float) -> Iterator[str]:
    """Joints whose readings are the commands, closer than an encoder's noise sigma [rad, m] or quantisation allows."""
    names = []
    for name, read, asked in zip(trial.joint, trial.q_motor.T, trial.q_command.T, strict=True):
        known = np.isfinite(asked)
        moves = np.abs(np.gradient(np.where(known, asked, 0.0))) > sigma if len(asked) > 1 else known
        apart = (read - asked)[known & moves]
        if len(apart) >= _FEW and apart.std() < _COPIED * sigma:
            names.append(name)
    if names:
        yield (
            f"readings of {', '.join(names)} are the commands, to {_COPIED * sigma:.1g} rad in motion: "
            "record what the encoders read, which are noisier"
        )


def wrong_sides(trial: Trial) -> Iterator[str]:
    """Link readings of one trial that do not follow their motor's."""
    for k, name in enumerate(trial.joint):
        known = np.isfinite(trial.q_link[:, k])
        if known.sum() < _FEW or _range(trial.q_link[known, k] - trial.q_motor[known, k]) < _APART:
            continue
        others = {
            (other, how): _range(trial.q_link[known, k] - sign * trial.q_motor[known, j])
            for j, other in enumerate(trial.joint)
            for sign, how in ((1.0, "follows"), (-1.0, "runs against"))
            if _range(trial.q_motor[known, j]) > 2.0 * _APART
        }
        other, how = min(others, key=lambda key: others[key], default=("", ""))
        hint = f"; it {how} the motor of {other}" if others and others[other, how] < _APART else ""
        yield f"joint {name}: its link reading does not follow its motor's{hint}: columns swapped, or a sign reversed"


def _range(x: np.ndarray) -> float:
    """Between the 5th and the 95th percentile."""
    low, high = np.percentile(x, (5.0, 95.0))
    return float(high - low)


def wrong_links(measured: Sequence[str], trials: Sequence[Trial], zero: np.ndarray) -> Iterator[Verdict]:
    """A refusal for each joint whose link readings, its zero (n_measured,) removed, are not those of its motor side."""
    motor, link = (np.concatenate([getattr(t, side) for t in trials]) for side in ("q_motor", "q_link"))
    for j, joint in enumerate(measured):
        known = np.isfinite(link[:, j]) & np.isfinite(motor).all(axis=1)
        if not known.any():
            continue
        rms = float(np.sqrt((((motor - link)[known, j] - zero[j]) ** 2).mean()))
        if rms > _BEYOND:
            why = _reason(measured, j, motor[known], link[known, j])
            message = f"link encoder of {joint} is off its motor side by {rms:.2g} rad rms{why}; correct the recording"
            yield Verdict("joints", "refused", message)


def _reason(measured: Sequence[str], j: int, motor: np.ndarray, link: np.ndarray) -> str:
    """What explains the readings `link` (n,), or nothing; motor (n, n_measured)."""
    spread, across = motor.std(axis=0), link.std()
    covariance = ((motor - motor.mean(axis=0)) * (link - link.mean())[:, None]).mean(axis=0)
    follows = np.abs(covariance) > _FOLLOWS * np.maximum(spread * across, np.finfo(float).tiny)
    if follows.any() and not follows[j]:
        return f": it follows {measured[int(np.argmax(follows))]}"
    slope = covariance[j] / max(float(spread[j]) ** 2, np.finfo(float).tiny)
    named = [text for value, text in _SLOPES if abs(slope - value) < _NEAR * max(abs(value), 1.0)]
    return f": {named[0]}" if named else " (sign, unit, whole turns, order of the joints?)"
