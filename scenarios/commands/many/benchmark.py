"""The commands `benchmark` and `peer`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from scenarios.commands.options import Out, Workers
from scenarios.files.ending import FAILED
from scenarios.files.errors import ScenarioError

Tier = Annotated[str, typer.Option(metavar="quick|full", help="4 or 20 robots.")]


def benchmark(  # noqa: PLR0913  an option each
    action: Annotated[
        Literal["make", "calibrate", "score"],
        typer.Argument(metavar="make|calibrate|score", help="Simulate it, calibrate it with this program, or score."),
    ],
    out: Out,
    entries: Annotated[list[Path] | None, typer.Argument(metavar="ENTRY...", help="score: folders of entries.")] = None,
    bench: Annotated[
        Path | None, typer.Option("--in", metavar="DIR", help="calibrate, score: the folder that `make` wrote.")
    ] = None,
    tier: Tier = "quick",
    workers: Workers = 0,
    python: Annotated[
        Path | None, typer.Option("--peer", metavar="FILE", help="calibrate: FIGAROH's entry, by its interpreter.")
    ] = None,
) -> None:
    """Make the frozen tasks bench-v1, or score calibrations of its robots."""
    from scenarios.benchmarks import baselines, make, scoring
    from scenarios.benchmarks.peer import Peer
    from scenarios.commands import console
    from scenarios.datasets import workers as engine

    if (action == "make") != (bench is None) or (action == "score") != bool(entries):
        raise ScenarioError(
            "benchmark: make --out DIR; calibrate --in DIR [--peer FILE] --out ENTRY; score ENTRY... --in DIR --out DIR"
        )
    with console.progress() as progress:
        if bench is None:
            found = make.make(tier, out, engine.Workers(workers), lambda at, share: progress("benchmark", at, share))
        elif action == "score":
            found = scoring.score(entries or (), bench, out, tier, progress)
        else:
            peer = None if python is None else Peer(python.absolute(), "map")
            found = baselines.calibrate(bench, out, tier, progress, peer)
    for line in found:
        typer.echo(line, err=True)
    if action == "score":
        typer.echo((out / "scores.md").read_text(encoding="utf-8"))
    elif action == "make":
        typer.echo(f"Datasets: {out / 'data'}\nTruth, for `benchmark score` alone: {out / 'truth'}")
    if found and action != "score":
        raise typer.Exit(FAILED)


def peer(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="A dataset folder.")],
    out: Out,
    python: Annotated[
        Path, typer.Option(metavar="FILE", help="The interpreter that has FIGAROH; `make peer` makes it.")
    ] = Path(".venv-peer/bin/python"),
    estimate: Annotated[
        Path | None, typer.Option(metavar="ESTIMATE", help="Ours; calibrated here unless named.")
    ] = None,
    truth: Annotated[Path | None, typer.Option(metavar="TRUTH", help="A truth folder to compare with.")] = None,
) -> None:
    """Calibrate a dataset with FIGAROH 1.0.2 and score its rows beside ours."""
    from scenarios.benchmarks.beside_peer import compare
    from scenarios.commands import console

    with console.progress() as progress:
        compare(python.absolute(), dataset, out, estimate, truth, progress)
    typer.echo((out / "peer.md").read_text(encoding="utf-8"))
