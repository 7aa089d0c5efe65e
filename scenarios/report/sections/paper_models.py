"""The paper's four models in our prediction, with its published figures drawn in; and what its models were fitted to.

Published: medians of |error| per axis, read off the boxplots by eye, and the two RMSE of the text. Nguyen et al. 2024.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from calibration.prediction import LADDER
from calibration.stages.joints import JointModel, limit_of
from scenarios.report.results import figures, formatting
from scenarios.report.results.ladder import Step
from scenarios.report.results.run_results import Results

MODELS = tuple(row for row in LADDER if row.published is not None)
_MEDIANS = ((12.7, 8.4, 4.6, 2.8), (5.1, 2.9, 2.6, 1.3), (18.4, 14.3, 6.8, 5.4))  # |x|, |y|, |z| of the models [mm]
_ORIENTATION = {0: 8.57, 3: 2.71}  # RMSE of nominal and model_3 [deg]
_AXES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class JointLine:
    """What the joint model of one joint is: degree (none: no correction), rho [s/rad], R2, discrepancy rms [mrad].

    `rho` says so where the search for it ended at a limit.
    """

    joint: str
    degree: str
    rho: str
    rms: float
    r2: float
    r2_out: float


@dataclass(frozen=True)
class AxisLine:
    """R2 of one axis of the base on left-out trials, against a base that stays, and whether it is moved, by source."""

    axis: str
    found: tuple[tuple[float, bool], ...]


def paper_steps(steps: Sequence[Step]) -> tuple[Step, ...]:
    """One predictive row a model: motor encoders, the best source of the base's motion there is."""
    found = []
    for model in MODELS:
        mine = {s.base: s for s in steps if (s.model, s.encoder) == (model.name, "motor")}
        base = model.predictive_base(mine)
        found += [] if base is None else [mine[base]]
    return tuple(found)


def readable(steps: Sequence[Step]) -> tuple[Step, ...]:
    """The rows a boxplot can hold: every prediction, and of the oracles the ones with the base measured."""
    return tuple(s for s in steps if s.encoder == "motor" or s.base == "measured")


def boxes(results: Results, steps: Sequence[Step]) -> Figure | None:
    """The paper's boxplot, None unless all four models are there."""
    rows = paper_steps(steps)
    drawn = figures.boxes(results, rows) if len(rows) == len(MODELS) else None
    if drawn is None:
        return None
    for ax, medians in zip(drawn.axes[:3], _MEDIANS, strict=True):
        ax.plot(medians, range(4), "D", color="#b5179e", markersize=5, markerfacecolor="none", zorder=5)
        ax.set_xlim(0.0, max(ax.get_xlim()[1], 1.08 * max(medians)))
    widest = max(ax.get_xlim()[1] for ax in drawn.axes[:3])
    for ax in drawn.axes[:3]:
        ax.set_xlim(0.0, widest)
    ax = drawn.axes[4]
    ax.plot(list(_ORIENTATION.values()), list(_ORIENTATION), "s", color="#b5179e", markersize=5, markerfacecolor="none")
    return drawn


def joint_lines(results: Results) -> tuple[JointLine, ...]:
    """The joint models of an estimate."""
    models = results.estimate.joint_models if results.estimate else ()
    return tuple(
        JointLine(
            m.joint,
            "none" if m.degree is None else str(m.degree),
            _rho(m),
            1e3 * m.quality.rms,
            m.quality.r2,
            m.quality.r2_out,
        )
        for m in models
    )


def _rho(model: JointModel) -> str:
    if model.degree is None:
        return formatting.fixed(None, 0)
    at = {"lowest": "≤ ", "highest": "≥ ", None: ""}[limit_of(model.rho)]
    return at + formatting.significant(model.rho)


def suspension_sources(results: Results) -> tuple[str, ...]:
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
        AxisLine(axis, tuple((float(r2[k]), bool(moves[k])) for r2, moves in tried)) for k, axis in enumerate(_AXES)
    )


def held_out_yaw(results: Results) -> dict[str, float]:
    """R2 of yaw on left-out trials, by source of the wrench."""
    lines = axis_lines(results)
    return {s: lines[5].found[k][0] for k, s in enumerate(suspension_sources(results))}
