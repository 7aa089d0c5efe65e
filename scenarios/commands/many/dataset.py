"""The commands that make many runs: `dataset`."""

from typing import Annotated

import typer

from scenarios.commands.options import Out, Overrides, ScenarioName, Scheduler, Seed, Workers, overriding
from scenarios.files.ending import FAILED
from scenarios.files.errors import ScenarioError

_SPREAD = "twin.widths.spread"


def dataset(  # noqa: PLR0913  an option each
    scenario: ScenarioName,
    out: Out,
    n: Annotated[int, typer.Option("-n", min=1, metavar="N", help="How many robots.")],
    workers: Workers = 0,
    scheduler: Scheduler = None,
    blind: Annotated[bool, typer.Option("--blind", help="Leave truth, seeds and scenario out.")] = False,
    aligned: Annotated[bool, typer.Option("--aligned", help="Each trial on one clock, too, in aligned/.")] = False,
    seed: Seed = None,
    overrides: Overrides = None,
) -> None:
    """Simulate N robots sampled around a scenario (gears and wheels from half to 1.5 times its values); resumable."""
    from scenarios import steps
    from scenarios.commands import console
    from scenarios.datasets import run_content
    from scenarios.datasets import workers as engine
    from scenarios.datasets.collection import Plan, collect

    if workers and scheduler:
        raise ScenarioError("--workers and --scheduler: name one of them")
    loaded = steps.load(scenario, overriding(overrides, seed))
    if loaded.twin.widths.spread == 0.0 and not any(given.startswith(_SPREAD) for given in overrides or ()):
        loaded = steps.load(scenario, [*overriding(overrides, seed), f"{_SPREAD}=0.5"])
    produce = run_content.PRODUCE[blind, aligned]
    plan = Plan(loaded, n, out, produce, blind)
    with console.progress() as progress:
        rows = collect(
            plan,
            engine.Workers(workers, scheduler),
            lambda at, share: progress("dataset", at, share),
            announce=console.note,
        )
    console.show_rows(rows)
    typer.echo(f"Index: {out / 'index.csv'}")
    if all(row.status != "ok" for row in rows):
        raise typer.Exit(FAILED)
