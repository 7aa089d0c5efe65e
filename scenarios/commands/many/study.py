"""The command `study`."""

import json
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scenarios.commands.options import Out, Overrides, Scheduler, Seed, Workers, overriding
from scenarios.files.ending import FAILED
from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scenarios.datasets.workers import Workers as Pool
    from scenarios.files.scenario import Scenario
    from scenarios.steps import Progress
    from scenarios.studies.statistics import Level, Parameter


def study(  # noqa: PLR0913  an option each
    kind: Annotated[
        Literal["coverage", "power", "joints", "compare"],
        typer.Argument(metavar="coverage|power|joints|compare", help="What to find out."),
    ],
    names: Annotated[
        list[str],
        typer.Argument(metavar="SCENARIO|FOLDER...", help="A scenario, joints: several; compare: studies or scores."),
    ],
    out: Out,
    n: Annotated[
        int | None, typer.Option("-n", min=2, metavar="N", help="How many robots, for each value; 20, joints: 50.")
    ] = None,
    vary: Annotated[
        str | None, typer.Option(metavar="PATH=V1,V2,...", help="power: a value of the scenario and what it is set to.")
    ] = None,
    matched: Annotated[
        bool, typer.Option("--matched", help="Robots that follow the geometric model exactly, without physics.")
    ] = False,
    effect: Annotated[
        Literal["time", "reversal", "load", "posture"] | None,
        typer.Option(
            metavar="NAME", help="power: size at which an unmodelled effect is detected: time, reversal, load, posture."
        ),
    ] = None,
    workers: Workers = 0,
    scheduler: Scheduler = None,
    seed: Seed = None,
    overrides: Overrides = None,
) -> None:
    """Calibrate many robots: coverage, power, corrections of the joints head to head; or compare studies, paired."""
    from scenarios import steps
    from scenarios.datasets import workers as engine

    if kind == "compare":
        _compare([Path(name) for name in names], out)
        return
    if (workers and scheduler) or (kind != "joints" and len(names) != 1):
        raise ScenarioError(f"study {kind}: one scenario, and one of --workers and --scheduler")
    who, changes = engine.Workers(workers, scheduler), overriding(overrides, seed)
    if kind == "joints":
        _joints({name: steps.load(name, changes) for name in names}, n or 50, out, who, changes)
    elif effect is not None:
        _power_of_effect(kind, steps.load(names[0], changes), effect, n or 20, out)
    else:
        path, values = _varied(kind, vary)
        scenarios = {
            value: steps.load(names[0], [*changes, *([f"{path}={value}"] if path else [])]) for value in values
        }
        _levels(kind, path, scenarios, n or 20, out, who, matched)


def _levels(  # noqa: PLR0913  a study by its options
    kind: str, path: str, scenarios: "Mapping[str, Scenario]", n: int, out: Path, workers: "Pool", matched: bool
) -> None:
    """Robots of each value of what is varied, judged."""
    from scenarios.commands import console
    from scenarios.datasets.collection import Plan, collect
    from scenarios.studies import statistics as study
    from scenarios.studies.full_run import judged
    from scenarios.studies.matched_run import matched as without_physics

    produce = without_physics if matched else judged
    levels, found = [], []
    with console.progress() as progress:
        for k, (value, scenario) in enumerate(scenarios.items()):
            folder, at = (out / f"level_{k}", f"{path}={value} ") if path else (out, "")
            rows = collect(
                Plan(scenario, n, folder, produce), workers, partial(_tell, progress, at), announce=console.note
            )
            levels.append(study.level(value, rows))
            found = list(study.parameters(folder, rows))
    study.save(out / "study.json", levels, found if kind == "coverage" else [])
    _show(levels, found if kind == "coverage" else [], out)


def _joints(scenarios: "Mapping[str, Scenario]", n: int, out: Path, workers: "Pool", changes: "Sequence[str]") -> None:
    from scenarios.commands import console
    from scenarios.datasets.collection import Plan, collect
    from scenarios.datasets.index import write_whole
    from scenarios.studies.joint_run import head_to_head
    from scenarios.studies.joint_table import page

    with console.progress() as progress:
        found = {
            name: collect(
                Plan(scenario, n, out / name, head_to_head),
                workers,
                partial(_tell, progress, f"{name} "),
                announce=console.note,
            )
            for name, scenario in scenarios.items()
        }
    options = "".join(f" --set {change}" for change in changes)
    text = page(found, f"Made by `tiago-twin study joints {' '.join(scenarios)} -n {n}{options} --out DIR`.")
    write_whole(out / "joints.md", text)
    typer.echo(text)
    if all(row.status != "ok" for rows in found.values() for row in rows):
        raise typer.Exit(FAILED)


def _power_of_effect(
    kind: str, scenario: "Scenario", effect: Literal["time", "reversal", "load", "posture"], n: int, out: Path
) -> None:
    from scenarios.commands import console
    from scenarios.datasets.index import write_whole
    from scenarios.studies.effect_power import entry, power

    if kind != "power":
        raise ScenarioError("--effect: belongs to power")
    found = power(scenario, effect, n)
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "study.json", json.dumps(entry(found), indent=1) + "\n")
    console.show(console.records([_flat(asdict(one)) for one in found]))
    typer.echo(f"Study: {out / 'study.json'}")


def _show(levels: "list[Level]", found: "list[Parameter]", out: Path) -> None:
    from scenarios.commands import console

    console.show(console.records([_flat(asdict(x)) for x in levels]))
    if found:
        console.show(console.records([_flat(asdict(p)) for p in sorted(found, key=lambda p: p.coverage_95)[:10]]))
    typer.echo(f"Study: {out / 'study.json'}")
    if all(x.calibrated.value == 0.0 for x in levels):
        raise typer.Exit(FAILED)


def _compare(folders: list[Path], out: Path) -> None:
    from scenarios.commands import console
    from scenarios.datasets.index import write_whole
    from scenarios.studies.compare import compare

    found = [asdict(d) for d in compare(folders)]
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"schema": 1, "differences": found}, indent=1).replace("NaN", "null")
    write_whole(out / "differences.json", text + "\n")
    console.show(console.records([_flat(d) for d in found]))
    typer.echo(f"Differences: {out / 'differences.json'}")


def _tell(progress: "Progress", value: str, at: str, share: float) -> None:
    progress("study", value + at, share)


def _varied(kind: str, vary: str | None) -> tuple[str, list[str]]:
    """Path and values of --vary; one level without a value where there is none."""
    if vary is None:
        return "", [""]
    path, sign, values = vary.partition("=")
    if kind != "power" or not sign or not all(values.split(",")):
        raise ScenarioError(f"--vary {vary}: belongs to power, as path.to.field=value,value,...")
    return path, values.split(",")


def _flat(record: dict[str, object]) -> dict[str, str]:
    """Words of a record's values; an interval as value [low, high]."""
    return {name: _word(value) for name, value in record.items() if value != ""}


def _word(value: object) -> str:
    if isinstance(value, dict):
        return f"{value['value']:.3g} [{value['low']:.3g}, {value['high']:.3g}]"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
