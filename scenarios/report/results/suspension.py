"""The base's springs: elements of K and C, identified beside true, and what one wrench identifies of the wheels."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calibration.inference import Model
from calibration.recording import Description
from calibration.stages.suspension import STAGE, Point, wheel_model
from scenarios.report.results.run_results import Results

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_UNITS = {"K": ("N/m", "N", "N.m/rad"), "C": ("N.s/m", "N.s", "N.m.s/rad")}
_NOISE = 0.5  # sigma over the truth above which a departure is noise [-]
_TINY = 1e-9  # of the geometric mean of the diagonal pair: an element that is none [-]


@dataclass(frozen=True)
class Element:
    """One element of K or C, with its transpose.

    Attributes:
        axes: Of force or moment, and of displacement or rotation.
        unit: `N/m`, `N` (per radian) or `N.m/rad`; of C times seconds.
        value: Identified.
        sigma: Its standard deviation, None where not known.
        status: `estimated`, or why not.
        truth: None where not known.
    """

    axes: str
    unit: str
    value: float
    sigma: float | None
    status: str
    truth: float | None

    @property
    def departure(self) -> float | None:
        """Identified over true, minus one [%]; None where it would say nothing: not identified, no truth, or noise."""
        if not self.truth or self.status != "estimated" or (self.sigma or 0.0) > _NOISE * abs(self.truth):
            return None
        return 100.0 * (self.value / self.truth - 1.0)


@dataclass(frozen=True)
class Structure:
    """What the richest motion identifies of the wheels' stiffnesses: n of them, `rank` combinations, by their point."""

    point: str
    n: int
    rank: int


@dataclass(frozen=True)
class WheelCombination:
    """A combination of the wheels' parameters that the data fix; `terms` beside its leading one."""

    name: str
    terms: int
    value: float
    sigma: float


@dataclass(frozen=True)
class AxisLine:
    """R2 of one axis of the base on left-out trials, against a base at rest, and whether it is predicted, by source."""

    axis: str
    found: tuple[tuple[float, bool], ...]


def elements(results: Results, letter: Literal["K", "C"]) -> tuple[Element, ...]:
    """The upper triangle of K or C as far as it is not zero in both; none without a suspension."""
    suspension = results.estimate.suspension if results.estimate else None
    if suspension is None:
        return ()
    truth = results.stiffness if letter == "K" else results.damping
    found = suspension.K if letter == "K" else suspension.C
    return tuple(_elements(letter, found, _model(results), truth))


def _model(results: Results) -> Model:
    """Row model_1 of the estimate, empty where it has none."""
    models = results.estimate.models if results.estimate else ()
    return next((m for m in models if m.name == "model_1"), Model("model_1", ()))


def _elements(letter: str, matrix: np.ndarray, model: Model, truth: np.ndarray | None) -> Iterator[Element]:
    known = {p.name: p for p in model.parameters}
    root = np.sqrt(np.abs(np.diag(matrix)))
    for i in range(6):
        for j in range(i, 6):
            p, true = known.get(f"suspension.{letter}.{i + 1}{j + 1}"), None if truth is None else float(truth[i, j])
            if p is not None or true or abs(matrix[i, j]) > _TINY * root[i] * root[j]:
                unit = _UNITS[letter][(i >= 3) + (j >= 3)]
                status = str(p.status).replace("_", " ") if p else "zero by the wheels' geometry"
                yield Element(f"{AXES[i]}, {AXES[j]}", unit, float(matrix[i, j]), p.sigma if p else None, status, true)


def structures(description: Description | None) -> tuple[Structure, ...]:
    """Ranks of the printed form for the declared wheels, r_i their hubs and their contact points."""
    if description is None or not description.wheels:
        return ()
    points: tuple[Point, ...] = ("centre", "contact")
    models = {point: wheel_model(description.wheels, point) for point in points}
    return tuple(Structure(point, len(m.names), m.structure.rank) for point, m in models.items())


def combinations(results: Results) -> tuple[WheelCombination, ...]:
    """What the data fix of the wheels' own stiffnesses and dampings; none where the printed form was refused."""
    return tuple(
        WheelCombination(c.name, int((c.coefficients != 0.0).sum()) - 1, c.value, c.sigma)
        for c in _model(results).combinations
        if c.name.startswith("suspension.")
    )


def sources(results: Results) -> tuple[str, ...]:
    """Sources of the wrench the suspension was tried with."""
    suspension = results.estimate.suspension if results.estimate else None
    return tuple(source for source, _ in suspension.held_out) if suspension else ()


def axis_lines(results: Results) -> tuple[AxisLine, ...]:
    """The axes of the base, by source of the wrench."""
    suspension = results.estimate.suspension if results.estimate else None
    if suspension is None:
        return ()
    tried = [(np.maximum(h.r2, -9.99), h.moves) for _, h in suspension.held_out]
    return tuple(
        AxisLine(axis, tuple((float(r2[k]), bool(moves[k])) for r2, moves in tried)) for k, axis in enumerate(AXES)
    )


def held_out_yaw(results: Results) -> dict[str, float]:
    """R2 of yaw on left-out trials, by source of the wrench."""
    lines = axis_lines(results)
    return {s: lines[5].found[k][0] for k, s in enumerate(sources(results))}


def messages(results: Results) -> tuple[str, ...]:
    """Messages of the stage; those of each source of the wrench are in a table."""
    verdicts = results.estimate.verdicts if results.estimate else ()
    return tuple(v.message for v in verdicts if v.stage == STAGE and not v.message.startswith("from "))
