"""The card of a collection: how it was sampled, its parts, units, splits, licence."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibration.recording import Trial
from scenarios.datasets.index import Row

_SAMPLED = """Every run is one robot: seed `SeedSequence(root, spawn_key=(id,))`, so that a run depends on neither the
others nor the order. What is sampled and how widely is in `collection.json` (`scenario.twin`; `widths.spread` is the
relative half width of encoder zeros and gaps). Splits are by robot: all motions of a robot are in one part."""
_BLIND = "The collection is blind: seeds, scenario values and truth are with its author."


def text(folder: Path, rows: Sequence[Row]) -> str:
    """Markdown text."""
    about = json.loads((folder / "collection.json").read_text(encoding="utf-8"))
    blind = about["blind"]
    status = Counter(row.status for row in rows)
    split = Counter(row.split for row in rows if row.status == "ok")
    lines = [
        f"# {about['name']}: {about['n']} runs",
        "",
        about["description"],
        "",
        "Synthetic: a MuJoCo twin of a TIAGo mobile manipulator, measured by simulated instruments. No real robot.",
        "",
        "## How it was sampled",
        "",
        _BLIND if blind else _SAMPLED,
        "",
        "## What is there",
        "",
        f"- runs: {', '.join(f'{n} {name}' for name, n in sorted(status.items()))}; "
        "`index.csv` has a line for each, with the reason where there is no result",
        f"- splits: {', '.join(f'{n} {name}' for name, n in sorted(split.items()))}, by the last digit of the id "
        "(0-7 train, 8 validation, 9 test)",
        f"- size: {sum(row.bytes for row in rows) / 1e6:.1f} MB; `sha256` is over the sorted files of a run",
        "- `runs/<id>/dataset/`: what the laboratory has" + ("" if blind else "; `runs/<id>/truth/`: what was true"),
        "- made by: " + ", ".join(f"{name} {v}" for name, v in sorted(about["versions"].items())),
        "- licence: that of the program; state the scenario and the versions when you publish results",
        "",
        *_figures(rows),
        "## Uses and limits",
        "",
        "For training and judging calibrations where the truth must be known. It is simulated: what a real TIAGo shows",
        "beyond the twin's defects is not in it. Validate an error model that is learnt here on your robot.",
        "",
        *_variables(),
    ]
    return "\n".join(lines) + "\n"


def _figures(rows: Sequence[Row]) -> list[str]:
    names = list(dict.fromkeys(m.name for row in rows for m in row.magnitudes))
    if not names:
        return []
    lines = ["## How the runs spread", "", "| figure | 5 % | median | 95 % |", "|---|---|---|---|"]
    for name in names:
        values = [m.value for row in rows for m in row.magnitudes if m.name == name]
        low, middle, high = np.nanquantile(values, [0.05, 0.5, 0.95])
        lines.append(f"| {name} | {low:.4g} | {middle:.4g} | {high:.4g} |")
    return [*lines, ""]


def _variables() -> list[str]:
    lines = [
        "## Variables of a trial",
        "",
        "| name | dimensions | unit | frame | clock | meaning |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {v.name} | {', '.join(v.dims)} | {v.units} | {v.frame} | {v.clock} | {v.meaning} |" for v in Trial.variables
    ]
    return lines
