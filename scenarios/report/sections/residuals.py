"""What the delivered row leaves on held-out trials, and how much of each defect other parameters absorb.

    e = predicted - measured position [mm]        bias = mean e        T = dt (1 + 2 sum_k rho_k) [s]

rho_k: autocorrelation of e - bias over lags k dt, x, y and z together, as far as it is positive. Samples less than T
apart repeat each other; white noise has T = dt.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure

from calibration.inference import Model
from calibration.numerics.robust_covariance import correlations
from scenarios.plots.histogram import z_histogram
from scenarios.plots.style import ESTIMATE, MISSED, ORACLE, OTHER, TRUTH, drawing, figure
from scenarios.plots.trace import Line, error_traces
from scenarios.report.results.run_results import Results
from scenarios.report.results.section import Drawn, RunView
from scenarios.report.results.traces import Trace

_COLOURS = (ESTIMATE, MISSED, OTHER, TRUTH, ORACLE)
_TAIL = 3.0  # root mean squares; a normal distribution has 0.27 % of its values beyond
_SHOWN = 2.0  # of the longest correlation time drawn
_SIZE = (10.0, 2.5)  # [inch]


@dataclass(frozen=True)
class Left:
    """What is left of one trial.

    Attributes:
        trial: Its name.
        e: (n, 3) residuals [mm].
        rho: (k,) their autocorrelation, the bias removed [-].
        step: Time between two of them [s]; None of postures.
    """

    trial: str
    e: np.ndarray
    rho: np.ndarray
    step: float | None

    @property
    def bias(self) -> np.ndarray:
        """Mean (3,) [mm]."""
        return np.asarray(self.e.mean(axis=0))

    @property
    def rmse(self) -> float:
        """Per component [mm]."""
        return float(np.sqrt((self.e**2).mean()))

    @property
    def constant(self) -> float:
        """Share of the bias in the square of the error [%]."""
        return 100.0 * float((self.bias**2).mean()) / max(self.rmse**2, np.finfo(float).tiny)

    @property
    def time(self) -> float | None:
        """Correlation time [s]."""
        return None if self.step is None else self.step * float(2.0 * self.rho.sum() - 1.0)

    @property
    def independent(self) -> float:
        """About how many independent samples there are."""
        return len(self.e) if self.step is None or not self.time else len(self.e) * self.step / self.time

    @property
    def z(self) -> np.ndarray:
        """(3 n,) over their own root mean square, the bias removed [-]."""
        centred = self.e - self.bias
        return np.asarray((centred / max(float(np.sqrt((centred**2).mean())), np.finfo(float).tiny)).ravel())

    @property
    def tail(self) -> float:
        """Share of z beyond 3 [%]."""
        return 100.0 * float((np.abs(self.z) > _TAIL).mean())


@dataclass(frozen=True)
class Residuals:
    """Bias, correlation and distribution of the residuals; random errors of the calibration postures beside."""

    view: RunView
    title: ClassVar[str] = "Residuals of the delivered row"
    template: ClassVar[str] = "residuals.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """Distribution, and autocorrelation by trial."""
        return {"residuals": drawn(self._left)}

    def context(self) -> Mapping[str, Any] | None:
        """A line a trial; left out where no errors over time were saved."""
        model = main_model(self.view.results)
        noise = [] if model is None else [(j, 1e3 * s) for j, s in zip(model.joints, model.reading_sigma, strict=False)]
        hand = model.hand_error if model is not None and len(model.hand_error) else None
        return {"left": self._left, "reading_noise": noise, "hand_noise": hand} if self._left else None

    @cached_property
    def _left(self) -> tuple[Left, ...]:
        step = self.view.headline
        key = None if step is None else (step.model, step.base, step.encoder)
        return tuple(
            left(t) for t in self.view.results.traces if (t.model, t.base, t.encoder) == key and len(t.scored_angle)
        )


def left(trace: Trace) -> Left:
    """The residuals of a trial that count."""
    e = trace.scored_position
    moves = trace.kind != "static" and len(trace.t) > 1
    centred = e - e.mean(axis=0)
    return Left(trace.trial, e, correlations([centred]), float(np.median(np.diff(trace.t))) if moves else None)


def drawn(found: Sequence[Left]) -> Figure | None:
    """Residuals over their root mean square beside a normal distribution, and their autocorrelation."""
    moving = [one for one in found if one.step is not None]
    if not found:
        return None
    with drawing():
        page = figure(*_SIZE)
        ax, over = page.subplots(1, 2)
        page.subplots_adjust(0.06, 0.19, 0.995, 0.97, 0.18)
        z_histogram(np.concatenate([one.z for one in found]), ax, "(residual − bias) / its RMS [-]", "components")
        longest = _SHOWN * max((one.time or 0.0 for one in moving), default=0.0) or 1.0
        lines = [Line(one.trial, *_lags(one, longest), colour) for one, colour in zip(moving, _COLOURS, strict=False)]
        error_traces(lines, "autocorrelation [-]", over)
        over.set_xlabel("lag [s]")
        if lines:
            over.legend(loc="upper right", fontsize=7)
    return page


def _lags(one: Left, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Lags [s] up to `longest` and autocorrelation at them."""
    lag = (one.step or 0.0) * np.arange(len(one.rho))
    return lag[lag <= longest], one.rho[lag <= longest]


@dataclass(frozen=True)
class Absorbed:
    """How much of each class of defect is hidden in other parameters; left out where that was not computed."""

    view: RunView
    title: ClassVar[str] = "Absorption: defects that hide in other parameters"
    template: ClassVar[str] = "absorption.html"
    folded: ClassVar[bool] = True

    def figures(self) -> Mapping[str, Drawn]:
        """None."""
        return {}

    def context(self) -> Mapping[str, Any] | None:
        """The shares, and the row they are of."""
        model = main_model(self.view.results)
        if model is None or model.absorption is None:
            return None
        return {
            "absorbed": model.absorption,
            "row_name": model.name,
            "hidden": tuple(hidden(model)),
            "meanings": MEANINGS,
        }


MEANINGS = {
    "load": "compliance of gears under gravity",
    "side": "backlash and friction on the side of the load",
    "bending": "bending of links under gravity",
    "wobble": "joint axes that wobble",
    "eccentric": "joints and encoders out of centre",
}
"""What the names of defects mean that are no parameters of the model."""


def main_model(results: Results) -> Model | None:
    """The delivered row of the estimate, or where its absorption is not known the last one that has it."""
    models = results.estimate.models if results.estimate else ()
    own = [m for m in models if m.name == (results.estimate.main if results.estimate else "")]
    known = [m for m in models if m.absorption is not None]
    return next((m for m in (*own, *reversed(known)) if m.absorption is not None), own[0] if own else None)


def hidden(model: Model) -> Iterator[tuple[str, str, float]]:
    """Class, the one that absorbs most of it, and what all others together absorb [%]; the most hidden first."""
    found = model.absorption
    if found is not None:
        for i in np.argsort(-found.share[:, -1]):
            row = found.share[i]
            yield found.classes[i], found.absorbers[int(np.argmax(row[:-1]))], 100.0 * float(row[-1])
