"""Where the base slipped in held-out trials: motion in the floor's plane with its band, loop of yaw, use of friction.

x, y, yaw [mm, mrad] since the first second, in the base's axes at rest; Mz [N.m] on the floor; friction use [-]
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure

from calibration.stages.stick_slip import SlippingMotion
from calibration.stages.suspension import REST
from scenarios.plots.slipping_base import Banded, banded, friction_use, loop
from scenarios.plots.style import drawing, figure
from scenarios.report.results.section import Drawn, RunView

_AXES = (("x", "mm", 0), ("y", "mm", 1), ("yaw", "mrad", 5))
_UNIT = 1e3  # mm in a metre, mrad in a radian
_TWO_SIDED = 1.96
_SLIDES = 0.999  # of the friction
_HEIGHT = 5.0  # [inch] of the figure


@dataclass(frozen=True)
class Slipped:
    """The base in one trial.

    Attributes:
        trial: Its name.
        t: (n,) [s from the trial's start].
        measured: (n, 6) displacement [m, rad], NaN where not seen.
        motion: Predicted.
    """

    trial: str
    t: np.ndarray
    measured: np.ndarray
    motion: SlippingMotion

    def axis(self, k: int) -> Banded:
        """Axis k [mm, mrad]."""
        sigma = np.sqrt(self.motion.variance[:, k])
        return Banded(self.t, *(_UNIT * v for v in (self.measured[:, k], self.motion.x[:, k], sigma)))


@dataclass(frozen=True)
class SlipLine:
    """One trial.

    Attributes:
        trial: Its name.
        moved: Rms (3,) of x, y, yaw as measured [mm, mrad].
        left: Rms (3,) that the prediction leaves.
        inside: (3,) share of the samples in the 95 % band, the markers' noise at rest added [%].
        slides: Share of the time in which a wheel slides [%].
        predictable: Whether yaw is predicted to move by more than its standard deviation.
    """

    trial: str
    moved: np.ndarray
    left: np.ndarray
    inside: np.ndarray
    slides: float
    predictable: bool


@dataclass(frozen=True)
class Slip:
    """The base that sticks and slips, predicted from the plate in trials kept aside."""

    view: RunView
    title: ClassVar[str] = "Slip of the base"
    template: ClassVar[str] = "slip.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """The first held-out trial that moves."""
        return {"slip": drawn(self._trials[0]) if self._trials else None}

    def context(self) -> Mapping[str, Any] | None:
        """A line for each held-out trial; None without a base that slips."""
        if not self._trials:
            return None
        return {"slip_lines": [line(one) for one in self._trials], "slip_trial": self._trials[0].trial}

    @cached_property
    def _trials(self) -> tuple[Slipped, ...]:
        return tuple(
            Slipped(p.trial_id, p.t - p.t[0], p.base.measured, p.base.slipping)
            for p in self.view.results.predicted.values()
            if p.base is not None and p.base.slipping is not None
        )


def line(one: Slipped) -> SlipLine:
    """Share of a trial inside the band."""
    rows = one.t > REST
    seen, axes = rows & np.isfinite(one.measured[:, 0]), [one.axis(k) for _, _, k in _AXES]
    measured = np.stack([a.measured[seen] for a in axes], axis=1)
    error = measured - np.stack([a.predicted[seen] for a in axes], axis=1)
    noise = np.array([np.nanstd(a.measured[~rows]) for a in axes])
    inside = np.abs(error) <= _TWO_SIDED * np.hypot(np.stack([a.sigma[seen] for a in axes], axis=1), noise)
    slides = (one.motion.use[rows] > _SLIDES).any(axis=1).mean()
    return SlipLine(
        one.trial,
        _rms(measured),
        _rms(error),
        100.0 * inside.mean(axis=0),
        100.0 * float(slides),
        one.motion.predictable,
    )


def drawn(one: Slipped) -> Figure:
    """Motion on the left; loop of yaw and use of friction on the right."""
    with drawing():
        page = figure(10.0, _HEIGHT)
        grid = page.add_gridspec(6, 2, left=0.06, right=0.99, bottom=0.09, top=0.93, hspace=0.5, wspace=0.42)
        for row, (name, unit, k) in enumerate(_AXES):
            ax = page.add_subplot(grid[2 * row : 2 * row + 2, 0])
            banded(one.axis(k), f"{name} [{unit}]", ax)
        ax.set_xlabel("time since the start of the trial [s]")
        handles, labels = ax.get_legend_handles_labels()
        page.legend(handles, labels, loc="upper left", bbox_to_anchor=(0.05, 1.0), ncols=3)
        ax = loop(one.motion.moment, one.axis(5), page.add_subplot(grid[:3, 1]))
        ax.set_xlabel("Mz on the floor [N.m]")
        ax.set_ylabel("yaw [mrad]")
        ax = friction_use(one.t, one.motion.use, one.motion.wheels, page.add_subplot(grid[4:, 1]))
        ax.set_xlabel("time [s]; white: no friction used, dark: the wheel slides")
    return page


def _rms(x: np.ndarray) -> np.ndarray:
    return np.sqrt((x**2).mean(axis=0))
