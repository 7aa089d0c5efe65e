"""Figures of the claims: kept by the tests that check them, shown in docs/claims.md and pages of docs/results.

Tests and benchmarks add lines to runs/claims.jsonl; `make claims` merges them into docs/results/claims.json and writes
every page of claims.toml from it. Names that differ behind `#` alone, robots or trials, are one row.
"""

import json
import subprocess
import tomllib
from collections.abc import Iterator
from datetime import date
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "runs/claims.jsonl"
RESULTS = ROOT / "docs/results/claims.json"
SENTENCES = Path(__file__).with_name("claims.toml")
_MOST = 100  # figures that are kept one by one


def measured() -> dict[str, str]:
    """Date of today and commit of this tree, empty outside a clone: what a figure is kept with."""
    return {"date": date.today().isoformat(), "tree": _tree()}


@cache
def _tree() -> str:
    command = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True).stdout.strip()


def when(figures: list[dict]) -> str:
    """Last date and the trees of figures of one row."""
    return ", ".join(
        x for x in (max(f["date"] for f in figures), *dict.fromkeys(f.get("tree", "") for f in figures)) if x
    )


def keep(name: str, figures: np.ndarray | float) -> None:
    """Add the figures of a claim, one a robot, to runs/claims.jsonl; of more than a hundred their percentiles."""
    KEPT.parent.mkdir(exist_ok=True)
    content, found = measured(), np.atleast_1d(figures)
    if len(found) > _MOST:
        content, found = {**content, "n": len(found)}, np.percentile(found, np.arange(_MOST + 1))
    content = {**content, "figures": [float(x) for x in found]}
    with KEPT.open("a", encoding="utf-8") as file:
        file.write(json.dumps({name: content}) + "\n")


def pages(results: dict) -> Iterator[tuple[Path, str]]:
    """Each page and its text from the kept figures."""
    for page in tomllib.loads(SENTENCES.read_text(encoding="utf-8"))["page"]:
        lines = [f"# {page['title']}", "", page["intro"].strip(), ""]
        for section in page["section"]:
            lines += _section(section, results)
        yield ROOT / page["file"], "\n".join(lines).rstrip() + "\n"


def _section(section: dict, results: dict) -> list[str]:
    rows: dict[str, list[dict]] = {}
    for name in sorted(results):
        if name.startswith(section.get("figures", "#")):
            rows.setdefault(name.removeprefix(section["figures"]).split("#")[0], []).append(results[name])
    lines = [f"## {section['title']}", "", section["text"].strip(), ""]
    lines += [f"Test: `{section['test']}`.", ""] if "test" in section else []
    if rows:
        figures = {
            name: section.get("scale", 1.0) * np.concatenate([r["figures"] for r in row]) for name, row in rows.items()
        }
        single = all(len(x) == 1 for x in figures.values())
        columns = ("value",) if single else ("n", "median", "least", "most")
        lines += [f"| {' | '.join((section['rows'], *columns, 'measured on'))} |", "|---" * (len(columns) + 2) + "|"]
        for name, x in figures.items():
            shown = [f"{value:.{section.get('decimals', 2)}f}" for value in (np.median(x), x.min(), x.max())]
            n = sum(r.get("n", len(r["figures"])) for r in rows[name])
            cells = shown[:1] if single else [str(n), *shown]
            label = name.strip("/ []").replace("/", ", ").replace(" [", ", ").replace("[", ", ")
            lines.append(f"| {' | '.join((label, *cells, when(rows[name])))} |")
        lines.append("")
    elif "figures" in section:
        lines += ["Not measured yet.", ""]
    return lines


def main() -> None:
    """Bring the kept figures into the documents."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for line in KEPT.read_text(encoding="utf-8").splitlines() if KEPT.exists() else ():
        results |= json.loads(line)
    RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    for path, text in pages(results):
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
