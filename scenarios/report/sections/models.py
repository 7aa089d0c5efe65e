"""The section on the paper's models: what they are, what was identified, and how well it predicts held-out trials."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenarios.plots import (
    FRAME_CHAIN,
    JOINT_CHAIN,
    WHEELED_BASE,
    drawing,
    figure,
    frame_chain,
    joint_chain,
    wheeled_base,
)
from scenarios.report.results.ladder import Step
from scenarios.report.results.run_results import Results
from scenarios.report.sections import base_motion, joint_regimes, joints, paper_models, payload
from scenarios.report.sections import suspension as stiffness


@dataclass(frozen=True)
class Section:
    """What the page needs of a section.

    Attributes:
        values: For the template.
        figures: By name, None where there is nothing to draw.
        tables: Their names and what is in them, in their order.
    """

    values: dict[str, Any]
    figures: dict[str, Figure | None]
    tables: tuple[tuple[str, object], ...]


def section(results: Results, steps: Sequence[Step]) -> Section:
    """The section of a run."""
    swayed, why_no_sway = base_motion.sway(results)
    looped, why_no_loops = joints.loops(results)
    trials = payload.loaded_trials(results)
    evaluation, suspension = results.evaluation, results.estimate.suspension if results.estimate else None
    values = {
        "protocols": evaluation.protocols,
        "comparisons": evaluation.comparisons,
        "sway": swayed,
        "sway_axes": base_motion.lines(swayed) if swayed else (),
        "why_no_sway": why_no_sway,
        "axis_lines": paper_models.axis_lines(results),
        "suspension_sources": paper_models.suspension_sources(results),
        "held_out_yaw": paper_models.held_out_yaw(results),
        "suspension_form": suspension.form if suspension else "",
        "suspension_said": stiffness.said(results),
        "elements": stiffness.elements(results, "K"),
        "damping": stiffness.elements(results, "C"),
        "base_scores": results.score.base if results.score else (),
        "structures": stiffness.structures(results.description),
        "wheel_combinations": stiffness.combinations(results),
        "loops": looped,
        "why_no_loops": why_no_loops,
        "joint_lines": paper_models.joint_lines(results),
        "regimes": joint_regimes.by_regime(evaluation.regimes),
        "loaded": trials,
        "load_rows": payload.load_rows(results, steps, trials),
    }
    figures = {
        "frames": _diagram(frame_chain, *FRAME_CHAIN) if _has_frames(results) else None,
        "paper": paper_models.boxes(results, steps),
        "wheels": _diagram(wheeled_base, *WHEELED_BASE),
        "sway": base_motion.drawn(swayed) if swayed else None,
        "joint": _diagram(joint_chain, *JOINT_CHAIN),
        "loops": joints.drawn(looped),
    }
    names = (
        "protocols",
        "comparisons",
        "loads",
        "sway",
        "stiffness",
        "damping",
        "held_out",
        "wheels",
        "joints",
        "regimes",
    )
    contents = (
        "protocols",
        "comparisons",
        "load_rows",
        "sway_axes",
        "elements",
        "damping",
        "axis_lines",
        "wheel_combinations",
    )
    tables = zip(names, (values[c] for c in (*contents, "joint_lines", "regimes")), strict=True)
    return Section(values, figures, tuple(tables))


def _has_frames(results: Results) -> bool:
    return results.estimate is not None and any(m.name in ("base_frame", "arm_tool") for m in results.estimate.models)


def _diagram(draw: Callable[[Axes], Axes], width: float, height: float) -> Figure:
    with drawing():
        page = figure(width, height)
        draw(page.add_axes((0.0, 0.0, 1.0, 1.0)))
    return page
