"""Why a model that only moves the base is better or worse than `nominal`, in one sentence of measured figures.

    e_fixed = e + b        e error of the nominal hand with the base measured, b what the base moved the hand by
    mean e_fixed^2 - mean e^2 = mean b^2 + 2 mean e.b

The base's motion taken off exactly lowers the error only if b^2 outweighs -2 e.b: where the hand's own errors are
larger and happen to point against b, the right motion of the base makes the hand worse.
"""

from collections.abc import Mapping

import numpy as np


def base_reason(errors: Mapping[str, np.ndarray], finding: str) -> str:
    """The sentence, from errors (n, 3) [m] of the nominal hand with the base `fixed`, `measured` and `predicted`.

    Empty where one of them is missing.
    """
    if errors.keys() < {"fixed", "measured", "predicted"}:
        return ""
    fixed, measured, predicted = (errors[name] for name in ("fixed", "measured", "predicted"))
    moved, missed = _rms(fixed - measured), _rms(predicted - measured)
    stays, left = _rms(fixed), _rms(measured)
    told = f"the base moved the hand by {moved:.2f} mm rms per component"
    even = f"the base measured would leave {left:.2f} mm of {stays:.2f}"
    if finding == "worse" and left >= stays:
        return f"{told}, against the larger errors of the nominal hand itself: even {even}"
    if finding == "worse":
        return f"{told}, its prediction misses that by {missed:.2f} mm; {even}"
    return f"{told}, predicted to {missed:.2f} mm; {even}, the rest are the nominal hand's own errors"


def _rms(e: np.ndarray) -> float:
    return 1e3 * float(np.sqrt((e**2).mean()))
