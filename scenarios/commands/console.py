"""What the command line shows: progress on stderr, tables on stdout."""

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from scenarios.steps import Progress

if TYPE_CHECKING:
    from rich.progress import TaskID

    from scenarios.datasets.index import Row

PLAIN_WIDTH = 120
"""Width of a table where there is no terminal [characters]."""

PLAIN_PERIOD = 5.0
"""Time between two progress lines of one step where there is no terminal [s]."""
_MOST = 5  # failed runs that are shown
_EARLY = 0.02  # share of a step from which the time left is stated [-]


@contextmanager
def progress() -> Iterator[Progress]:
    """Yield what shows the progress of the steps: a bar each on a terminal, a line now and then elsewhere."""
    console = Console(stderr=True)
    if console.is_terminal and not console.is_dumb_terminal:
        with _bars(console) as show:
            yield show
    else:
        yield _lines(console)


@contextmanager
def _bars(console: Console) -> Iterator[Progress]:
    from rich.progress import BarColumn, ProgressColumn, Task, TaskProgressColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    class Left(ProgressColumn):
        """Time left, which passes between two reports as well."""

        def render(self, task: Task) -> Text:
            done, since = task.completed, time.monotonic() - task.fields["at_time"]
            passed = (task.elapsed or 0.0) - since
            left = passed * (1.0 / done - 1.0) - since if _EARLY < done < 1.0 else 0.0
            return Text(f"{left:.0f} s left" if left > 0.0 else "", style="progress.remaining")

    steps: dict[str, TaskID] = {}
    step_name, at_what = (TextColumn(text, markup=False) for text in ("{task.description:<10}", "{task.fields[at]}"))
    times = TimeElapsedColumn(), Left()
    with Bars(step_name, BarColumn(), TaskProgressColumn(), *times, at_what, console=console) as bars:

        def show(step: str, at: str, fraction: float) -> None:
            if step not in steps:
                _finish(bars, steps)
                steps[step] = bars.add_task(step, total=1.0, at=at, at_time=time.monotonic())
            bars.update(steps[step], completed=fraction, at=at, at_time=time.monotonic())

        yield show
        _finish(bars, steps)


def _finish(bars: Any, steps: dict[str, "TaskID"]) -> None:
    for task in steps.values():
        bars.update(task, completed=1.0, at="")
        bars.stop_task(task)


def _lines(console: Console) -> Progress:
    last_step, last_time, start = "", 0.0, 0.0

    def show(step: str, at: str, fraction: float) -> None:
        nonlocal last_step, last_time, start
        now = time.monotonic()
        if step == last_step and now - last_time <= PLAIN_PERIOD:
            return
        start = now if step != last_step else start
        known = now > start and _EARLY < fraction < 1.0
        left = f", {(now - start) * (1.0 / fraction - 1.0):.0f} s left" if known else ""
        line = f"{step} {fraction:4.0%} {at}{left}" if fraction or at else step
        console.print(line, markup=False, highlight=False, soft_wrap=True)
        last_step, last_time = step, now

    return show


def note(text: str) -> None:
    """Print a line on stderr that stays, above the bars where there are some."""
    print(text, file=sys.stderr, flush=True)  # noqa: T201


def show(table: Table | None) -> None:
    """Print a table on stdout, where there is one."""
    if table is None:
        return
    console = Console()
    if not console.is_terminal:
        console = Console(width=PLAIN_WIDTH)
    console.print(table)


def show_rows(rows: "Sequence[Row]") -> None:
    """Print how many runs of a collection ended well, and on stderr why some did not."""
    bad = [row for row in rows if row.status != "ok"]
    Console().print(
        f"{len(rows) - len(bad)} of {len(rows)} runs, {sum(row.bytes for row in rows) / 1e6:.1f} MB", highlight=False
    )
    errors = Console(stderr=True)
    for row in bad[:_MOST]:
        errors.print(f"run {row.id} {row.status}: {row.reason}", markup=False, highlight=False, soft_wrap=True)
    if len(bad) > _MOST:
        errors.print(f"and {len(bad) - _MOST} more; index.csv has them all", highlight=False)


def summary(run: Path) -> list[str]:
    """Return the end of a run in six lines: verdict, rows, budget if known, worst finding, next step, report."""
    from scenarios.report.results.formatting import cell
    from scenarios.report.results.headline import headline
    from scenarios.report.results.ladder import best_of_each
    from scenarios.report.results.run_results import read
    from scenarios.report.results.section import run_view

    view = run_view(read(run))
    found, rows = headline(view.results, view.steps), best_of_each(view.steps)
    figures = (
        f"{s.model} {cell(s.main.position_rmse_component_mm)}, {cell(s.main.orientation_rmse_deg)}" for s in rows
    )
    worst = [f"{n.level}, {n.stage}: {n.message}" for n in found.notices] or ["none"]
    more = f" ({len(worst) - 1} more in the report)" if len(worst) > 1 else ""
    steps = (f"-{s.gain:.2f} mm: {s.text}" if s.gain else s.text for s in found.next_steps)
    following, budget = "; ".join(steps) or "nothing more from these recordings", view.results.evaluation.budget
    lines = (
        f"{found.badge.capitalize()}. {found.sentence}",
        f"RMSE per component [mm], of orientation [deg]: {'; '.join(figures)}",
        *([budget.sentence.partition("; next:")[0].rstrip(".") + "."] if budget else []),
        f"Worst finding: {worst[0]}{more}",
        f"Next: {following}",
        f"Report: {run / 'report.html'}",
    )
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]


def ladder(results: Path) -> Table:
    """Return the table of a folder's evaluation: against the truth where score.json has it, else against mocap."""
    path = results / "score.json"
    rows = _rows(path if path.is_file() else results / "evaluation.json", "rows")
    against = ", ".join(sorted({row["against"] for row in rows}))
    return _errors(f"Held-out error of the hand, against {against}", rows)


def confirmation(results: Path) -> Table | None:
    """Return the table of another session's errors, or None where no other session was recorded."""
    rows = _rows(results / "evaluation.json", "confirmation")
    return _errors("Another session, marker frames fitted again, against mocap", rows) if rows else None


def points(results: Path) -> Table | None:
    """Return the table of single markers and their bands, or None where there are none."""
    rows = json.loads((results / "evaluation.json").read_text(encoding="utf-8")).get("points", [])
    bands = ("95 % band\n[mm]", "inside\n[%]", "other day's\n95 % [mm]", "inside\n[%]")
    table = _table("marker", "row", "trial", "RMSE\nnorm [mm]", "largest\n[mm]", *bands)
    table.title, table.title_justify = "Markers; bands of the session calibrated in, and of any other", "left"
    for column in table.columns[3:]:
        column.justify = "right"
    for row in rows:
        figures = (f"{row[key]:.2f}" for key in ("rmse_norm_mm", "max_norm_mm"))
        inside = [
            text
            for day in ("", "other_day_")
            for text in (f"{row[f'{day}band_95_mm']:.2f}", f"{100.0 * row[f'{day}inside']:.0f}")
        ]
        table.add_row(row["marker"], row["model"], row["trial"], *figures, *inside)
    return table if rows else None


def _errors(title: str, rows: Sequence[dict[str, Any]]) -> Table:
    columns = ("position RMSE\nper component [mm]", "position RMSE\nnorm [mm]", "orientation\nRMSE [deg]")
    table = _table("row", "base", "encoder", "trials", *columns)
    table.title, table.title_justify = title, "left"
    for column in table.columns[4:]:
        column.justify = "right"
    for row in rows:
        position = (f"{row[key]:.2f}" for key in ("position_rmse_component_mm", "position_rmse_norm_mm"))
        names = (str(row[key]) for key in ("model", "base", "encoder", "trials"))
        turned = row["orientation_rmse_deg"]
        table.add_row(*names, *position, "-" if turned is None else f"{turned:.3f}")
    return table


def frames(results: Path) -> Table | None:
    """Return the table of estimated frames beside their truth; None unless the estimate is about frames."""
    main = json.loads((results / "estimate" / "estimate.json").read_text(encoding="utf-8"))["main"]
    if main != "arm_tool":
        return None
    table = _table("frame", "unit", "estimate", "truth", "error", "sigma")
    table.title, table.title_justify = "Frames, against truth", "left"
    for column in table.columns[2:]:
        column.justify = "right"
    for p in json.loads((results / "score.json").read_text(encoding="utf-8"))["parameters"]:
        if p["name"].startswith("frame.") and p["estimate"] is not None:
            values = (p["estimate"], p["truth"], p["estimate"] - p["truth"], p["sigma"])
            table.add_row(p["name"], f"m{p['unit']}", *(f"{1e3 * value:.3f}" for value in values))
    return table


def remarks(results: Path) -> list[str]:
    """Return an evaluation's findings on its trials and rows."""
    evaluation = json.loads((results / "evaluation.json").read_text(encoding="utf-8"))
    return [v["message"] for v in evaluation.get("verdicts", [])]


def verdicts(found: Sequence[Any]) -> Table:
    """Return the table of each stage's findings."""
    table = _table("stage", "verdict", "message")
    for verdict in found:
        table.add_row(*(escape(str(text)) for text in (verdict.stage, verdict.verdict, verdict.message)))
    return table


def records(found: Sequence[dict[str, str]]) -> Table:
    """Return a table with a line for each record, its names as columns."""
    table = _table(*found[0])
    for record in found:
        table.add_row(*(escape(text) for text in record.values()))
    return table


def _table(*columns: str) -> Table:
    """Return an empty table without lines; a unit in brackets is no markup."""
    table = Table(box=None, pad_edge=False)
    for name in columns:
        table.add_column(escape(name), overflow="fold")
    return table


def _rows(path: Path, key: str) -> list[dict[str, Any]]:
    """Return the rows of dynamic and of static trials; those of both together are in the file only."""
    rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8")).get(key, [])
    return [row for row in rows if row["trials"] != "all"]
