"""The command `predict`."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.options import Out


def predict(  # noqa: PLR0913  an option each
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE", help="An estimate folder.")],
    mapping: Annotated[Path, typer.Option("--map", metavar="YAML", help="Mapping file of these files.")],
    out: Out,
    files: Annotated[
        list[Path] | None, typer.Argument(metavar="[FILE]...", help="Recordings; the mapping's unless given.")
    ] = None,
    register: Annotated[
        int, typer.Option(min=0, metavar="N", help="Register the marker bodies with the first N static postures.")
    ] = 0,
) -> None:
    """Predict a session recorded later; its error where the hand was seen."""
    from scenarios.commands import console
    from scenarios.steps.another_day import PREDICTED
    from scenarios.steps.another_day import predict as run

    with console.progress() as progress:
        found = run(estimate, tuple(files or ()), mapping, out, register, progress)
    for note in found.notes:
        typer.echo(note)
    if found.scored:
        console.show(console.ladder(out))
        console.show(console.points(out))
        typer.echo(f"\nReport: {out / 'report.html'}")
    else:
        typer.echo("\nBase and hand were not seen in every trial: poses are predicted, and not scored.")
    typer.echo(f"Predicted: {out / PREDICTED}")
