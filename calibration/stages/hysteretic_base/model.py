"""A base on a floor as six axes, each of a form that is chosen for it.

    rz        still | linear in w | Maxwell-slip with 1 or 2 elements
    rx, ry    still | linear in w | linear in w and play operators of the own moment
    x, y, z   still | linear in w | linear in (rx, ry, rz), as predicted

Coefficients by least squares with a ridge. Rocking on six wheels is no symmetric compliance: none is demanded.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.numerics.signals import play
from calibration.stages.hysteretic_base.log import BaseLog, compared
from calibration.stages.hysteretic_base.yaw import SlippingYaw, fit_yaw

Form = Literal["still", "linear", "play", "follows", "slip 1", "slip 2"]
AXES = ("x", "y", "z", "rx", "ry", "rz")
ORDER = (5, 3, 4, 0, 1, 2)  # what follows after what it follows
_FOLLOWING: tuple[Form, ...] = ("still", "linear", "follows")
_TILTING: tuple[Form, ...] = ("still", "linear", "play")
_TURNING: tuple[Form, ...] = ("still", "linear", "slip 1", "slip 2")
FORMS = (_FOLLOWING, _FOLLOWING, _FOLLOWING, _TILTING, _TILTING, _TURNING)
_WIDTHS = (0.1, 0.2, 0.4)  # of play operators, over the largest moment
_RIDGE = 1e-3  # of the columns' mean square


@dataclass(frozen=True)
class LinearAxis:
    """An axis that is linear in its columns.

    Attributes:
        form: Which columns.
        coefficients: (c,).
        widths: (k,) of play operators [N.m].
    """

    form: Form
    coefficients: np.ndarray
    widths: np.ndarray


Axis = LinearAxis | SlippingYaw


@dataclass(frozen=True)
class HystereticBase:
    """A fitted base.

    Attributes:
        forms: Of the six axes.
        axes: Their models.
        variance: (6,) of the displacement, from parts of the log that were left out [m2, rad2].
        left_out: Of each axis, rms errors there of the forms in the order of FORMS [m, rad].
    """

    forms: tuple[Form, ...]
    axes: tuple[Axis, ...]
    variance: np.ndarray
    left_out: tuple[tuple[float, ...], ...]

    def displacement(self, w: np.ndarray) -> np.ndarray:
        """Displacement (n, 6) [m, rad, frame 0] under changes of the wrench w (n, 6), RATE samples a second."""
        x = np.zeros((len(w), 6))
        for a in ORDER:
            x[:, a] = axis_motion(self.axes[a], a, w, x)
        return x


def axis_motion(axis: Axis, a: int, w: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Motion (n,) of axis a under w (n, 6); x (n, 6) has the axes before it."""
    if isinstance(axis, SlippingYaw):
        return compared(axis.predicted(w)[:, None])[:, 0]
    return np.asarray(columns(axis.form, a, w, x, axis.widths) @ axis.coefficients)


def columns(form: Form, a: int, w: np.ndarray, x: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """What axis a is linear in (n, c)."""
    if form == "still":
        return np.zeros((len(w), 0))
    if form == "follows":
        return x[:, 3:]
    if form == "play":
        moment = np.tile(np.append(0.0, w[:, a])[:, None], len(widths))
        return np.column_stack([compared(w), compared(play(moment, widths)[1:])])
    return compared(w)


def fit_axis(log: BaseLog, used: np.ndarray, a: int, form: Form, x: np.ndarray, near: Axis | None = None) -> Axis:
    """Axis a in one form by the samples used (n,); x (n, 6) has the axes before it, `near` a fit to start from."""
    if form.startswith("slip"):
        start = near if isinstance(near, SlippingYaw) else None
        return fit_yaw(log, used, int(form[-1]), start)
    widths = float(np.abs(log.w[used, a]).max()) * np.array(_WIDTHS)
    A = columns(form, a, log.w, x, widths)[used]
    size = np.maximum(np.sqrt((A**2).mean(axis=0)), np.finfo(float).tiny)
    A = A / size
    ridge = _RIDGE * len(A) * np.eye(A.shape[1])
    return LinearAxis(form, np.linalg.solve(A.T @ A + ridge, A.T @ log.x[used, a]) / size, widths)
