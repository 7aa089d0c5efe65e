"""Link readings that cannot be those of their joint, told by name before a joint model is fitted to them.

    y = q_motor - q_link - zero         rms y > 0.1 rad over calibration trials: ten times the play of a worn gear
    q_link ~ a q_motor + b              a = -1 sign, a = 180 / pi degrees, a = 0 stands still; by least squares

A polynomial of the angle explains such a discrepancy perfectly, so its R2 says nothing.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.joint_verdicts import STAGE
from calibration.recording import Trial
from calibration.verdict import Verdict

_BEYOND = 0.1  # rms [rad, m]
_NEAR = 0.1  # of the slope [-]
_FOLLOWS = 0.99  # correlation with another joint's motor side [-]
_SLOPES = ((-1.0, "its sign is turned"), (180.0 / np.pi, "it is in degrees"), (0.0, "it stands still"))


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
            yield Verdict(STAGE, "refused", message)


def _reason(measured: Sequence[str], j: int, motor: np.ndarray, link: np.ndarray) -> str:
    """What explains the readings `link` (n,), or nothing; motor (n, n_measured)."""
    spread, across = motor.std(axis=0), link.std()
    covariance = ((motor - motor.mean(axis=0)) * (link - link.mean())[:, None]).mean(axis=0)
    follows = np.abs(covariance) > _FOLLOWS * np.maximum(spread * across, np.finfo(float).tiny)
    if follows.any() and not follows[j]:
        return f": it follows {measured[int(np.argmax(follows))]}"
    slope = covariance[j] / max(float(spread[j]) ** 2, np.finfo(float).tiny)
    said = [text for value, text in _SLOPES if abs(slope - value) < _NEAR * max(abs(value), 1.0)]
    return f": {said[0]}" if said else " (sign, unit, whole turns, order of the joints?)"
