"""report.html and the figures beside it: the same results give the same bytes, wherever the run folder is."""

import base64
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

from calibration.prediction import NOMINAL
from scenarios.plots import svg
from scenarios.report.results import figures, formatting
from scenarios.report.results.ladder import BASES, MEANINGS, headline_model, ladder, predictive
from scenarios.report.results.parameters import coverage, groups, known, left_out
from scenarios.report.results.recordings import instruments
from scenarios.report.results.run_results import Results, read
from scenarios.report.sections import paper_models, verdict
from scenarios.report.sections.models import section

_TEMPLATES = Path(__file__).with_name("templates")
_NAMES = ("frames", "paper", "wheels", "sway", "joint", "loops", "errors", "traces", "parameters", "z_scores")


@dataclass(frozen=True)
class Drawing:
    """A figure as the page shows it and as a file of its own."""

    inline: str
    file: str


def write(run_dir: Path | str) -> None:
    """Write RUN/report.html and RUN/figures/*.svg from what is saved in RUN.

    Raises:
        ScenarioError: There is no evaluation, or a file cannot be read.
        InputError: The dataset or the estimate cannot be read.
    """
    run = Path(run_dir)
    results = read(run)
    values, drawings = context(results)
    folder = run / "figures"
    folder.mkdir(exist_ok=True)
    for name in _NAMES:
        if name in drawings:
            _replace(folder / f"{name}.svg", drawings[name].file)
        else:
            (folder / f"{name}.svg").unlink(missing_ok=True)
    _replace(run / "report.html", render(values, drawings))


def _replace(path: Path, text: str) -> None:
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8", newline="\n")
    os.replace(part, path)


def context(results: Results) -> tuple[dict[str, Any], dict[str, Drawing]]:
    """What the template shows, and the figures."""
    ladders = {trials: ladder(results, trials) for trials in ("dynamic", "static")}
    ladders = {trials: steps for trials, steps in ladders.items() if steps} or {"all": ladder(results, "all")}
    steps = next(iter(ladders.values()))
    model, found = headline_model(results, steps), known(results)
    before, after = predictive(steps, NOMINAL), predictive(steps, model)
    has_truth = results.score is not None
    models = section(results, steps)
    made = {
        **models.figures,
        "errors": figures.boxes(results, paper_models.readable(steps)),
        "traces": figures.traces(results, steps),
        "parameters": figures.forest(found, has_truth),
        "z_scores": figures.z_scores(found, has_truth),
    }
    values = {
        "results": results,
        "scenario": results.scenario,
        "has_truth": has_truth,
        "ladders": ladders,
        "steps": steps,
        "headline": after,
        "changes": verdict.changes(before.main, after.main) if before and after else (),
        "sentences": tuple(verdict.sentences(results, steps)),
        "notices": verdict.notices(results, steps, coverage(found) if has_truth else (0, 0)),
        "claim": verdict.CLAIM if has_truth else verdict.CLAIM_REAL,
        "conventions": verdict.CONVENTIONS,
        "meanings": {m: MEANINGS[m] for m in MEANINGS if any(s.model == m for s in steps)},
        "bases": {b: BASES[b] for b in BASES if any(s.base == b for s in steps)},
        "figure": _numbered(("picture", results.picture), *made.items()),
        "table": _numbered(
            *ladders.items(),
            *models.tables,
            ("axes", made["errors"]),
            ("trials", results.recorded),
            ("clocks", results.recorded and results.estimate and results.estimate.clocks),
            ("parameters", found),
        ),
        "instruments": instruments(results.description, results.recorded) if results.description else {},
        "trial": figures.traced_trial(results, steps),
        "known": groups(found),
        "coverage": coverage(found),
        "left_out": left_out(results.score, results.estimate),
        "picture": _png(results.picture),
        **models.values,
    }
    return values, {name: _drawing(name, drawn) for name, drawn in made.items() if drawn is not None}


def _numbered(*parts: tuple[str, object]) -> dict[str, int]:
    """Numbers from 1 of the parts there are."""
    return {name: number for number, name in enumerate((name for name, part in parts if part), start=1)}


def _drawing(name: str, drawn: Figure) -> Drawing:
    text = svg(drawn, name)
    return Drawing(text[text.index("<svg") :].strip(), text)


def _png(data: bytes | None) -> str | None:
    return None if data is None else "data:image/png;base64," + base64.b64encode(data).decode("ascii")


def render(values: Mapping[str, Any], drawings: Mapping[str, Drawing]) -> str:
    """The page."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "fixed": formatting.fixed,
        "significant": formatting.significant,
        "count": formatting.count,
        "cell": formatting.cell,
        "decimals": formatting.decimals,
    }
    style = (_TEMPLATES / "report.css").read_text(encoding="utf-8")
    return environment.get_template("report.html").render(**values, drawings=drawings, style=style)
