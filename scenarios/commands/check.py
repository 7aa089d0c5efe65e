"""The command `check`: limits on the figures of an evaluation, for continuous integration without pytest.

A figure is `ROW[:BASE[:ENCODER[:TRIALS]]].METRIC`, or `coverage`. The base is, unless named, the best source of its
motion that does not measure it; encoder `motor`; trials `dynamic`. Against the truth where score.json is there.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from scenarios.files.ending import FAILED
from scenarios.files.errors import ScenarioError

_SHORT = {
    "mm": "position_rmse_component_mm",
    "norm": "position_rmse_norm_mm",
    "p95": "position_p95_norm_mm",
    "max": "position_max_norm_mm",
    "deg": "orientation_rmse_deg",
    "skill": "skill",
}


def check(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run or evaluation folder.")],
    highest: Annotated[
        list[str] | None,
        typer.Option("--max", metavar="ROW.METRIC=VALUE", help="Fail above this value; repeatable."),
    ] = None,
    lowest: Annotated[
        list[str] | None,
        typer.Option("--min", metavar="ROW.METRIC=VALUE", help="Fail below this value; repeatable."),
    ] = None,
) -> None:
    """Compare figures of an evaluation with limits; exit 1 beyond one.

    Metrics: mm (RMSE per component), norm, p95, max [mm], deg, skill; and coverage of 95 % intervals.
    """
    limits = [(text, 1.0) for text in highest or ()] + [(text, -1.0) for text in lowest or ()]
    if not limits:
        raise ScenarioError("check: no limit; name one, such as --max model_2.mm=2.5")
    exceeded = 0
    for text, sign in limits:
        name, equals, value = text.partition("=")
        if not equals or not _is_number(value):
            raise ScenarioError(f"check: {text}: write ROW.METRIC=VALUE, such as model_2.mm=2.5")
        found, limit = _figure(run_folder, name), float(value)
        failed = sign * found > sign * limit
        exceeded += failed
        typer.echo(
            f"{'FAILED' if failed else 'ok':6} {name} = {found:.4g}, {'at most' if sign > 0 else 'at least'} {limit:g}"
        )
    if exceeded:
        raise typer.Exit(FAILED)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _figure(folder: Path, name: str) -> float:
    score = folder / "score.json"
    if name == "coverage":
        found = _json(score).get("coverage_95")
    else:
        row, _, metric = name.rpartition(".")
        key = _SHORT.get(metric, metric)
        entry = _row(_json(score if score.is_file() else folder / "evaluation.json").get("rows", []), row)
        if key not in entry or not isinstance(entry[key], float | int | None):
            raise ScenarioError(f"check: {name}: no metric {metric!r}; there are {', '.join(_SHORT)} and coverage")
        found = entry[key]
    if not isinstance(found, float | int):
        raise ScenarioError(f"check: {name} is not known in {folder}")
    return float(found)


def _row(rows: Sequence[dict[str, Any]], text: str) -> dict[str, Any]:
    from calibration.estimate import SOURCES

    model, base, encoder, trials = (*text.split(":"), "", "", "", "")[:4]
    wanted = (model, encoder or "motor", trials or "dynamic")
    found = {row["base"]: row for row in rows if (row["model"], row["encoder"], row["trials"]) == wanted}
    source = base or next((b for b in SOURCES if b in found), "")
    if source not in found:
        known = [f"{r['base']}:{r['encoder']}:{r['trials']}" for r in rows if r["model"] == model]
        known = [f"{model}:{of}" for of in known] or [*dict.fromkeys(str(r["model"]) for r in rows)]
        raise ScenarioError(f"check: no row {text!r}; there are {', '.join(known)}")
    return found[source]


def _json(path: Path) -> dict[str, Any]:
    from calibration.untrusted import read_json

    content = read_json(path, "make it with tiago-twin evaluate")
    rows = content.get("rows", []) if isinstance(content, dict) else None
    if not isinstance(rows, list) or not all(_is_row(row) for row in rows):
        raise ScenarioError(f"{path}: contains no results; make them with tiago-twin evaluate")
    return content


def _is_row(row: Any) -> bool:
    return isinstance(row, dict) and all(isinstance(row.get(k), str) for k in ("model", "base", "encoder", "trials"))
