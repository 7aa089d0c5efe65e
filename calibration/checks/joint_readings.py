"""Joint readings that cannot be true: missing, beyond a joint's limits, or a link side that is not its motor's.

Zeros of either side may be anything; a link may be off its motor by its gear's backlash and deflection.

    y = q_link - q_motor + zero      rms y > 0.1 rad in a trial: ten times the backlash of a worn gear
    jumps of y from sample to sample, of whole turns where it wraps; q_link at its limit while q_motor moves
    q_link ~ a q_motor + b           a = -1 sign, a = 180 / pi degrees, another scale; by least squares

    |int v - dq_link|^2 < 1/4 |int v - dq_motor|^2      what is in proportion to int v apart, over steps of 0.1 s in
                                     which dq_link - dq_motor is ten sigma: v is the link's, sides are exchanged,
                                     unless the other steps take back half of what these have it nearer

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
_LAGS, _BIN = 10.0, 0.1  # sigma by which the sides move apart where they can be judged, in that time [s]
_FOLLOWS, _TURNS = 0.25, 5  # of the squares; times in which a joint must show its lag
_KEPT = 0.5  # of what they have the link nearer, over all times: a velocity that jumps between samples is off both
_SHARE = 0.05  # of the samples that may be farther out
_NEAR = 0.1  # of a slope, of a turn [-]
_SCALE, _LEFT = 0.03, 0.3  # a slope is off 1 by more and leaves less of the difference, rms: no backlash is so straight
_SLOPES = ((-1.0, "has its sign turned"), (180.0 / np.pi, "is in degrees"))
_UNNAMED = "is off its motor side by"


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
    for name, column, low, high in zip(chain.measured, q.T, *chain.limits, strict=True):
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


def exchanged(trial: Trial, sigma: float) -> Iterator[str]:
    """Joints whose motor velocity is that of the link readings, which are near; sigma of an encoder [rad, m].

    An encoder that reads in steps larger than ten sigma is not judged: it is off its velocity as well.
    """
    names = []
    steps = np.diff(trial.t_robot)
    width = max(1, round(_BIN / float(np.median(steps)))) if len(steps) else 1
    for name, q, link, v in zip(trial.joint, trial.q_motor.T, trial.q_link.T, trial.v_motor.T, strict=True):
        moved = np.stack([0.5 * (v[1:] + v[:-1]) * steps, np.diff(q), np.diff(link)])
        moved = moved[:, : len(steps) // width * width].reshape(3, -1, width).sum(axis=2)
        by_v, by_q, by_link = moved[:, np.isfinite(moved).all(axis=0)]
        in_steps = np.diff(np.unique(q)).min(initial=np.inf) > _LAGS * sigma
        if len(by_v) < _TURNS or in_steps or _range(np.cumsum(by_link - by_q)) > _APART:
            continue
        unit = by_v / max(float(np.linalg.norm(by_v)), np.finfo(float).tiny)
        off_motor, off_link = (x - unit * (unit @ x) for x in (by_v - by_q, by_v - by_link))
        rows, nearer = np.abs(off_link - off_motor) > _LAGS * sigma, off_motor**2 - off_link**2
        follows = (off_link[rows] ** 2).sum() < _FOLLOWS * (off_motor[rows] ** 2).sum()
        if rows.sum() >= _TURNS and follows and nearer.sum() > _KEPT * nearer[rows].sum():
            names.append(name)
    if names:
        yield (
            f"motor and link readings of {', '.join(names)} are exchanged, or the motor's are wrong: its velocity is "
            "that of the link readings; exchange the columns, or see its readings for spikes, stops and delays"
        )


def wrong_sides(trial: Trial) -> Iterator[str]:
    """Link readings of one trial that are not those of their joint's motor side, and why."""
    for k, name in enumerate(trial.joint):
        if reason := _wrong_side(trial, k, None):
            yield f"link encoder of {name} {reason}; correct the recording"


def wrong_links(measured: Sequence[str], trials: Sequence[Trial], zero: np.ndarray) -> Iterator[Verdict]:
    """A refusal for each joint whose link readings, its zero (n_measured,) added, are not those of its motor side."""
    for j, joint in enumerate(measured):
        found = {t.id: reason for t in trials if (reason := _wrong_side(t, j, float(zero[j])))}
        if found:
            reason = next((r for r in found.values() if not r.startswith(_UNNAMED)), next(iter(found.values())))
            where = "every trial" if len(found) == len(trials) else ", ".join(found)
            yield Verdict("joints", "refused", f"link encoder of {joint} {reason}: {where}; correct the recording")


def _wrong_side(trial: Trial, j: int, zero: float | None) -> str:
    """What is wrong with joint j's link readings, or nothing; its zero [rad, m], where it is known."""
    known = np.isfinite(trial.q_link[:, j]) & np.isfinite(trial.q_motor).all(axis=1)
    motor, link = trial.q_motor[known], trial.q_link[known, j]
    if len(link) < _FEW:
        return ""
    y = link - motor[:, j]
    off = _range(y) if zero is None else float(np.sqrt(((y + zero) ** 2).mean()))
    named = (_another(trial.joint, j, motor, link) if off > _APART else "") or _limit(motor[:, j], link)
    named = named or _slope(motor[:, j], link) or _jumps(y)
    return named or (f"{_UNNAMED} {off:.2g} rad (unit, whole turns?)" if off > _APART else "")


def _another(joints: Sequence[str], j: int, motor: np.ndarray, link: np.ndarray) -> str:
    """Which other joint's motor readings, of all (n, k), joint j's link readings (n,) follow."""
    others = {
        (other, how): _range(link - sign * motor[:, k])
        for k, other in enumerate(joints)
        for sign, how in ((1.0, "follows"), (-1.0, "runs against"))
        if k != j and _range(motor[:, k]) > 2.0 * _APART
    }
    other, how = min(others, key=lambda key: others[key], default=("", ""))
    return f"{how} the motor of {other}" if others and others[other, how] < _APART else ""


def _jumps(y: np.ndarray) -> str:
    """Whether link less motor readings y (n,) jump, by whole turns or otherwise."""
    steps = np.diff(y)
    at = np.flatnonzero(np.abs(steps) > _APART)
    if not len(at):
        return ""
    turns = abs(steps[at[0]]) / (2.0 * np.pi)
    whole = turns > 0.5 and abs(turns - round(turns)) < _NEAR
    return f"{'wraps' if whole else 'jumps'} by {steps[at[0]]:.2g} rad"


def _limit(motor: np.ndarray, link: np.ndarray) -> str:
    """Whether readings link (n,) stay at their largest or least while the motor (n,) moves on."""
    for end in (link.max(), link.min()):
        stays = link == end
        if stays.sum() >= _FEW and np.ptp(motor[stays]) > _APART:
            return "does not move" if stays.all() else f"does not exceed {end:.3g} rad while its motor does"
    return ""


def _slope(motor: np.ndarray, link: np.ndarray) -> str:
    """Whether readings link (n,) are the motor's (n,) by another factor, which leaves little of their difference."""
    if _range(motor) < 2.0 * _APART:
        return ""
    dq, y = motor - motor.mean(), link - motor
    a = float(dq @ (link - link.mean())) / float(dq @ dq)
    y = y - y.mean()
    left = y - (a - 1.0) * dq
    if abs(a - 1.0) < _SCALE or left @ left > _LEFT**2 * (y @ y):
        return ""
    named = [text for value, text in _SLOPES if abs(a - value) < _NEAR * abs(value)]
    return named[0] if named else f"has {a:.3g} of its motor's scale"


def _range(x: np.ndarray) -> float:
    """Between the 5th and the 95th percentile."""
    low, high = np.percentile(x, (5.0, 95.0))
    return float(high - low)
