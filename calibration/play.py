"""The play operator, as a basis for what friction-held gears do to a motion.

    p_k = clip(p_{k-1}, q_k - w, q_k + w)          w half the gap [rad, m]
Reference: Visintin, Differential Models of Hysteresis, 1994.
"""

import numpy as np


def play(q: np.ndarray, half_gap: np.ndarray) -> np.ndarray:
    """Output p of play operators of half gaps (k,) driven by columns q (n, k), starting centred on q[0]."""
    p = np.empty_like(q)
    last = q[0]
    for k, (low, high) in enumerate(zip(q - half_gap, q + half_gap, strict=True)):
        last = np.minimum(np.maximum(last, low), high)
        p[k] = last
    return p
