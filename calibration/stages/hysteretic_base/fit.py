"""Which form each axis has: leave one part of the log out.

    form_a = argmin sum_k sqrt(mean_(t in part k) (x_a - x_a(-k))^2)

Parts are equally long, from where the wrench begins to move. A jerk that nothing else in the log resembles counts as
one part, however large its errors. Axes that follow others follow them as they are predicted without that part.
"""

import numpy as np

from calibration.errors import NotEnoughData
from calibration.stages.hysteretic_base.log import SETTLED, BaseLog
from calibration.stages.hysteretic_base.model import FORMS, ORDER, Axis, Form, HystereticBase, axis_motion, fit_axis

PARTS = 4
_BEGINS = 0.1  # of the largest moment: the log moves
_LEAST = 4.0  # [s] of motion


def fit_base(log: BaseLog, used: np.ndarray) -> HystereticBase:
    """The base by the samples used (n,) of a log, forms by parts of it that are left out.

    Raises:
        NotEnoughData: It moves for less than four seconds of them.
    """
    parts = parts_of(log, used)
    wholes, outs = np.zeros_like(log.x), [np.zeros_like(log.x) for _ in parts]
    forms: list[Form] = ["still"] * 6
    axes: dict[int, Axis] = {}
    variance, tried = np.zeros(6), [()] * 6
    for a in ORDER:
        found = [_tried(log, used, parts, a, form, wholes, outs) for form in FORMS[a]]
        errors = np.array([[_square(log, part, a, x) for part, x in zip(parts, f[1], strict=True)] for f in found])
        best = int(np.sqrt(errors).mean(axis=1).argmin())
        forms[a], axes[a] = FORMS[a][best], found[best][0]
        variance[a], tried[a] = errors[best].mean(), tuple(np.sqrt(errors.mean(axis=1)))
        wholes[:, a] = axis_motion(axes[a], a, log.w, wholes)
        for out, x in zip(outs, found[best][1], strict=True):
            out[:, a] = x
    return HystereticBase(tuple(forms), tuple(axes[a] for a in range(6)), variance, tuple(tried))


def refitted(base: HystereticBase, log: BaseLog, used: np.ndarray) -> HystereticBase:
    """The base in the same forms by other samples (n,)."""
    x, axes = np.zeros_like(log.x), dict(enumerate(base.axes))
    for a in ORDER:
        axes[a] = fit_axis(log, used, a, base.forms[a], x, base.axes[a])
        x[:, a] = axis_motion(axes[a], a, log.w, x)
    return HystereticBase(base.forms, tuple(axes.values()), base.variance, base.left_out)


def parts_of(log: BaseLog, used: np.ndarray) -> list[np.ndarray]:
    """Samples (n,) of each part.

    Raises:
        NotEnoughData: The log moves too little.
    """
    moment = np.abs(log.slow_w[:, 3:]).max(axis=1)
    moving = np.flatnonzero(used & (moment > _BEGINS * moment[used].max()) & (log.t > SETTLED))
    first = moving[0] if len(moving) else len(log.t)
    rows = np.flatnonzero(used & (np.arange(len(log.t)) >= first))
    if len(rows) < 2 or log.t[rows[-1]] - log.t[rows[0]] < _LEAST:
        raise NotEnoughData(f"the log moves for less than {_LEAST:.0f} s before its end or where the fit ends")
    return [np.isin(np.arange(len(log.t)), part) for part in np.array_split(rows, PARTS)]


def _tried(
    log: BaseLog, used: np.ndarray, parts: list[np.ndarray], a: int, form: Form, x: np.ndarray, outs: list[np.ndarray]
) -> tuple[Axis, list[np.ndarray]]:
    """An axis in one form by all samples, and its motion (n,) by those without each part."""
    whole = fit_axis(log, used, a, form, x)
    others = (fit_axis(log, used & ~part, a, form, out, whole) for part, out in zip(parts, outs, strict=True))
    return whole, [axis_motion(other, a, log.w, out) for other, out in zip(others, outs, strict=True)]


def _square(log: BaseLog, part: np.ndarray, a: int, x: np.ndarray) -> float:
    return float(((log.x[part, a] - x[part]) ** 2).mean())
