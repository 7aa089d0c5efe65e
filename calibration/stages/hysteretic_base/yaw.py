"""Yaw of a base that sticks and slips about the vertical, fitted as it is used: from the wrench to the angle.

    u = Mz + a_x Fx + a_y Fy,     psi = Maxwell-slip of u with m elements

(a_x, a_y) [m] place the point about which it turns. Parameters are logarithms, a_x and a_y as they are, with a normal
prior about a spring as stiff as the log's moment over its angle; least squares from several starts.

Maxwell-slip: a spring, a damper and elements that stick and slip side by side,

    c dpsi/dt + ke psi + sum_j k_j clamp(psi - s_j, +-D_j) = u,        the slider s_j follows beyond D_j

implicit in time. Reference: Al-Bender, Lampaert, Swevers, The generalized Maxwell-slip model, IEEE Trans. Autom.
Control 50 (2005).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from calibration.numerics.compiled import njit
from calibration.numerics.signals import RATE
from calibration.stages.hysteretic_base.log import BaseLog, compared

_SHARE = 0.1  # of the motion: error of the fit that counts as one [-]
_WIDTH, _ARM = 1.5, 0.3  # prior standard deviations of a logarithm [-] and of a_x, a_y [m]
_SETTLING = 0.01  # [s] c over stiffness
_SLIPS = (0.4, 0.05, 0.01)  # D over the largest angle
_FACTORS = (0.5, 1.0, 2.0)  # of D, between starts
_STEP = 1e-3  # of derivatives
_MOST, _NEAR = 30, 10  # steps from a start, and from one that is near
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


@dataclass(frozen=True)
class SlippingYaw:
    """A fit.

    Attributes:
        spring: ke [N.m/rad].
        elements: k_j (m,) [N.m/rad].
        slips_at: D_j (m,) [rad].
        damper: c [N.m.s/rad].
        arm: (2,) a_x, a_y [m].
    """

    spring: float
    elements: np.ndarray
    slips_at: np.ndarray
    damper: float
    arm: np.ndarray

    @classmethod
    def of(cls, p: np.ndarray) -> "SlippingYaw":
        """From (2 m + 4,) log ke, log k_j, log D_j, log c, a_x, a_y."""
        m = (len(p) - 4) // 2
        spring, k, slips_at, damper = np.split(np.exp(p[:-2]), [1, 1 + m, 1 + 2 * m])
        return cls(float(spring[0]), k, slips_at, float(damper[0]), p[-2:])

    @property
    def parameters(self) -> np.ndarray:
        """(2 m + 4,) as `of` takes them."""
        return np.concatenate([np.log([self.spring, *self.elements, *self.slips_at, self.damper]), self.arm])

    def predicted(self, w: np.ndarray) -> np.ndarray:
        """psi (n,) [rad] under wrenches (n, 6)."""
        u = w[:, 5] + w[:, :2] @ self.arm
        return maxwell_slip(u, self.elements, self.slips_at, self.spring, self.damper, 1.0 / RATE)


def fit_yaw(log: BaseLog, used: np.ndarray, elements: int, start: SlippingYaw | None = None) -> SlippingYaw:
    """The yaw that explains the samples used (n,), from a start where one is near."""
    size = max(float(log.x[used, 5].std()), np.finfo(float).tiny)
    prior = _prior(log, used, elements)
    width = np.array([_WIDTH] * (2 * elements + 2) + [_ARM] * 2)

    def errors(p: np.ndarray) -> np.ndarray:
        psi = compared(SlippingYaw.of(p).predicted(log.w)[:, None])[:, 0]
        return np.concatenate([(psi - log.x[:, 5])[used] / (_SHARE * size), (p - prior) / width])

    starts = _starts(prior, elements) if start is None else [start.parameters]
    most = _MOST if start is None else _NEAR
    found = [least_squares(errors, p, x_scale=width, diff_step=_STEP, max_nfev=most) for p in starts]
    return SlippingYaw.of(min(found, key=lambda f: float(f.cost)).x)


def _prior(log: BaseLog, used: np.ndarray, elements: int) -> np.ndarray:
    moment, angle = np.abs(log.slow_w[used, 5]).max(), max(float(np.abs(log.x[used, 5]).max()), 1e-9)
    k = np.log(np.full(elements + 1, moment / angle))
    return np.array([*k, *np.log(angle * np.array(_SLIPS[:elements])), np.log(_SETTLING) + k[0], 0.0, 0.0])


def _starts(prior: np.ndarray, elements: int) -> Iterator[np.ndarray]:
    for factor in _FACTORS:
        start = prior.copy()
        start[elements + 1 : -3] += np.log(factor)
        yield start
