"""Operators of hysteresis, driven by a force.

Maxwell-slip: a spring, a damper and elements that stick and slip side by side,

    c dpsi/dt + ke psi + sum_j k_j clamp(psi - s_j, +-D_j) = u,        the slider s_j follows beyond D_j

implicit in time. Play of width r: p follows u when it is farther than r from it (Prandtl-Ishlinskii: sum_j w_j p_j).
Reference: Al-Bender, Lampaert, Swevers, The generalized Maxwell-slip model, IEEE Trans. Autom. Control 50 (2005).
"""

import numpy as np
from numba import njit

_ITERATIONS = 40  # of Newton on a monotone, piecewise linear function
_SOLVED = 1e-12  # [rad]


@njit(cache=True, error_model="numpy")
def maxwell_slip(u: np.ndarray, k: np.ndarray, D: np.ndarray, ke: float, c: float, h: float) -> np.ndarray:
    """psi (n,) [rad] under u (n,) [N.m], samples h [s] apart.

    Args:
        u: (n,).
        k: (m,) stiffness of the elements [N.m/rad].
        D: (m,) where they slip [rad].
        ke: Of the spring [N.m/rad].
        c: Of the damper [N.m.s/rad].
        h: [s].
    """
    psi, s, before = np.empty(len(u)), np.zeros(len(k)), 0.0
    for t in range(len(u)):
        x = before
        for _ in range(_ITERATIONS):
            force, slope = c / h * (x - before) + ke * x - u[t], c / h + ke
            for j in range(len(k)):
                e = x - s[j]
                force += k[j] * min(max(e, -D[j]), D[j])
                slope += k[j] * (abs(e) <= D[j])
            x -= force / slope
            if abs(force) < _SOLVED * slope:
                break
        for j in range(len(k)):
            s[j] = min(max(s[j], x - D[j]), x + D[j])
        psi[t] = before = x
    return psi


@njit(cache=True)
def plays(u: np.ndarray, r: np.ndarray) -> np.ndarray:
    """p (n, m) of play operators of half widths r (m,) driven by u (n,), at 0 before."""
    p = np.zeros((len(u), len(r)))
    for j in range(len(r)):
        last = 0.0
        for t in range(len(u)):
            last = min(max(last, u[t] - r[j]), u[t] + r[j])
            p[t, j] = last
    return p
