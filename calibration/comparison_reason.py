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
    told = f"the base moved the hand by {moved:.2f} mm per component"
    if finding == "worse" and left >= stays:
        return (
            f"{told} against the nominal hand's own errors, which are larger and stay: even with the base measured "
            f"{left:.2f} mm are left of {stays:.2f}"
        )
    if finding == "worse":
        return (
            f"{told} and the prediction of it misses by {missed:.2f}; measured, it would leave {left:.2f} mm of "
            f"{stays:.2f}"
        )
    return (
        f"{told}, predicted within {missed:.2f}; measured, it would leave {left:.2f} mm of {stays:.2f}, the nominal "
        "hand's own errors"
    )


def _rms(e: np.ndarray) -> float:
    return 1e3 * float(np.sqrt((e**2).mean()))
