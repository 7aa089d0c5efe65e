"""Figures of the claims: kept by the tests that check them, shown in docs/claims.md.

`make claims` runs the tests of claims, keeps their figures in docs/results/claims.json and writes the page from it and
from the sentences in claims.toml.
"""

import json
import tomllib
from datetime import date
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "runs/claims.json"
RESULTS = ROOT / "docs/results/claims.json"
PAGE = ROOT / "docs/claims.md"
SENTENCES = Path(__file__).with_name("claims.toml")


def keep(name: str, figures: np.ndarray) -> None:
    """Merge the figures of a claim, one a robot, into runs/claims.json."""
    KEPT.parent.mkdir(exist_ok=True)
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    kept[name] = {"date": date.today().isoformat(), "figures": [float(x) for x in np.atleast_1d(figures)]}
    KEPT.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def page(results: dict) -> str:
    """docs/claims.md from the kept figures."""
    sentences = tomllib.loads(SENTENCES.read_text(encoding="utf-8"))
    lines = [sentences["title"], "", sentences["intro"].strip(), ""]
    for section in sentences["section"]:
        lines += [f"## {section['title']}", "", section["text"].strip(), "", f"Test: `{section['test']}`.", ""]
        lines += [f"| {section['rows']} | n | median | least | most | measured on |", "|---|---|---|---|---|---|"]
        for name in sorted(results):
            if name.startswith(section["figures"]):
                lines.append(_line(name.removeprefix(section["figures"]), results[name], section.get("decimals", 2)))
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _line(name: str, result: dict, decimals: int) -> str:
    x = np.array(result["figures"])
    figures = " | ".join(f"{value:.{decimals}f}" for value in (np.median(x), x.min(), x.max()))
    return f"| {name.strip('/').replace('/', ', ')} | {len(x)} | {figures} | {result['date']} |"


def main() -> None:
    """Bring the kept figures into the documents."""
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    results |= json.loads(KEPT.read_text(encoding="utf-8"))
    RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    PAGE.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
