"""Mistakes of a laboratory at random, and clean campaigns, of sampled robots and instruments: counted for the page.

    python -m tests.hostile.random_cases FIRST ROBOTS MISTAKES      one process a core, robots of their own

Each robot is simulated once (`short --quick`), calibrated with all stages, evaluated, and spoilt so many times; a row
a campaign goes into docs/results/random_cases.csv, in place of those of the same robot.
"""

import csv
import logging
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from calibration import calibrate, load
from calibration.errors import CalibrationError
from calibration.evaluation.evaluate import evaluate
from tests.hostile.rows.wrong_data import at_random
from tests.hostile.spoilt import Tried, reference_of, tried

TABLE = Path(__file__).parents[2] / "docs/results/random_cases.csv"
COLUMNS = ("robot", "mistake", "calibrated", "message", "error [mm]", "clean [mm]")
MENDED = (406, 500, 722, 765, 767, 784, 807, 881, 931)
_LACKS = "not identifiable"  # true of a short campaign
_WIDTH = 90  # characters of a verdict in the table


def clean(dataset) -> tuple[str, ...]:
    """What is found, wrongly, in a clean campaign: warnings and refusals of all stages and of its evaluation."""
    try:
        estimate = calibrate(dataset)
        found = [*estimate.verdicts, *(evaluate(estimate, dataset).verdicts if estimate.calibrated else ())]
    except CalibrationError as error:
        return (str(error),)
    messages = tuple(v.message for v in found if v.verdict in ("warning", "refused") and _LACKS not in v.message)
    return messages if estimate.calibrated else (*messages, "not calibrated")


def tried_robot(seed: int, mistakes: int, place: Path) -> Iterator[Tried]:
    """The clean campaign of a robot (its name empty), then its mistakes."""
    from scenarios.steps import run_steps
    from twin import record

    logging.disable(logging.WARNING)
    scenario = run_steps.load("short", [f"seed={seed}"]).quick()
    record(scenario.twin, scenario.seed, place / "run")
    good = load(place / "run/dataset")
    messages = clean(good)
    logging.disable(logging.NOTSET)
    yield Tried("", "not calibrated" not in messages, messages, np.nan, np.nan)
    if mistakes and not messages:
        campaign, reference = reference_of(good)
        for mistake in at_random(np.random.default_rng(seed), mistakes):
            yield tried(mistake, campaign, good, reference, place / "at")
            shutil.rmtree(place / "at", ignore_errors=True)


def rows() -> list[list[str]]:
    """Of the table."""
    return list(csv.reader(TABLE.open(encoding="utf-8")))[1:] if TABLE.is_file() else []


def counts() -> str:
    """What came of them, for docs/reliability.md."""
    every = rows()
    spoilt, good = [r for r in every if r[1]], [r for r in every if not r[1]]
    wrong, alarms = [r for r in spoilt if silent(r)], [r for r in good if r[3]]
    named = sum(bool(r[3]) for r in spoilt)
    lines = [
        "Kind, size, joint, body and time at random, on campaigns of a minute of sampled robots (`short --quick`);",
        "`python -m tests.hostile.random_cases FIRST ROBOTS MISTAKES` adds to `results/random_cases.csv`, a row each.",
        "",
        f"- {len(spoilt)} mistakes on {len({r[0] for r in spoilt})} robots: {named} named, "
        f"{len(spoilt) - named - len(wrong)} harmless, {len(wrong)} silently wrong",
        "  (no verdict, the error on unseen motion over 1 mm and twice the clean one)",
        *(f"    - robot {r[0]}, {r[1]}: {r[4]} mm, clean {r[5]} mm" for r in wrong),
        f"- {len(good)} clean campaigns: {len(alarms)} warned of or refused; not counted are robots whose false alarms",
        f"  were mended, others took their place: {', '.join(map(str, MENDED))}",
        "  (links that cross their backlash, late, or lie alone on its other side; a clock extrapolated by a minute)",
        *(f"    - robot {r[0]}: {r[3]}" for r in alarms),
    ]
    return "\n".join(lines) + "\n"


def silent(row: Sequence[str]) -> bool:
    """Whether a row is of a mistake that no verdict names and that matters."""
    return Tried(row[1], row[2] == "True", (row[3],) if row[3] else (), float(row[4]), float(row[5])).silently_wrong


def _write(found: Sequence[Sequence[object]]) -> None:
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *found])


def main(first: int, robots: int, mistakes: int) -> None:
    """Try the robots of these seeds; write the table after each."""
    for seed in range(first, first + robots):
        found = []
        with tempfile.TemporaryDirectory() as place:
            for t in tried_robot(seed, mistakes, Path(place)):
                message = t.messages[0][:_WIDTH].replace("\n", " ") if t.messages else ""
                found.append([str(seed), t.name, str(t.calibrated), message, f"{t.error:.3f}", f"{t.clean:.3f}"])
                if (silent(found[-1]) and t.name) or (message and not t.name):
                    print(*found[-1], flush=True)
        kept = [r for r in rows() if r[0] != str(seed)]  # of another process, too
        _write(sorted([*kept, *found], key=lambda r: int(r[0])))


if __name__ == "__main__":
    from tests.hostile.page import write

    main(*map(int, sys.argv[1:4]))
    write()
