"""The command `process`."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.options import FAILED, Out


def process(
    source: Annotated[Path, typer.Argument(metavar="MAPPING|DATASET", help="A mapping file, or a dataset folder.")],
    out: Out,
) -> None:
    """Import, calibrate, evaluate and report laboratory recordings."""
    from scenarios.commands import console
    from scenarios.steps.process import process as run

    with console.progress() as progress:
        found = run(source, out, progress)
    for note in found.notes:
        typer.echo(note)
    console.show(console.verdicts(found.estimate.verdicts))
    if found.evaluated:
        console.show(console.ladder(out))
        console.show(console.points(out))
        typer.echo(f"\nReport: {out / 'report.html'}")
    else:
        typer.echo("\nNo validation trial: the error is the cross-validated one above; keep trials aside for a report.")
    typer.echo(f"Estimate: {out / 'estimate'}")
    if not found.estimate.calibrated:
        typer.echo("The estimate must not be used; the refused verdicts say why.", err=True)
        raise typer.Exit(FAILED)
