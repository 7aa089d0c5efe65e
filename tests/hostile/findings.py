"""What trying the program found, and the row or test that shows it mended: `findings.csv`, checked against both.

A finding's letters and numbers are its trial's: `use` and a section of friendly use, A to E by part, u units, a axes,
o order, n names, c clocks, d and e data, f hand-overs.
"""

import csv
import re
from collections.abc import Iterator
from pathlib import Path

from tests.hostile.rows import datasets, folders, laboratory_kinds, results_and_tables, wrong_data

HERE = Path(__file__).parent
FINDINGS = tuple((f, s) for f, s in list(csv.reader((HERE / "findings.csv").open(encoding="utf-8")))[1:])
_ARGUED = "argued: "


def names() -> set[str]:
    """Of all rows of all tables."""
    groups = (*datasets.GROUPS.values(), *results_and_tables.GROUPS.values(), *folders.GROUPS.values())
    mistakes = (wrong_data.TABLE, wrong_data.VALIDATION, *laboratory_kinds.TABLES)
    return {row.name for rows in (*groups, *mistakes) for row in rows}


def unshown(findings: tuple[tuple[str, str], ...]) -> Iterator[tuple[str, str]]:
    """Findings that no row of that name, test of that folder or argument shows."""
    rows = names()
    for finding, shown in findings:
        place, _, test = shown.partition("::")
        known = shown in rows or shown.startswith(_ARGUED) or (bool(test) and test in _tests(place))
        if not known:
            yield finding, shown


def _tests(place: str) -> set[str]:
    files = (HERE.parents[1] / place).rglob("test_*.py")
    return {name for f in files for name in re.findall(r"^def (test_\w+)", f.read_text(encoding="utf-8"), re.M)}


def counts() -> str:
    """For docs/reliability.md."""
    tests, argued = (sum(mark in shown for _, shown in FINDINGS) for mark in ("::", _ARGUED))
    return f"{len(FINDINGS)} findings: {len(FINDINGS) - tests - argued} by a row, {tests} by a test, {argued} argued"
