"""The command `tiago-twin look`."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.options import Out


def look(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="A dataset folder, the twin's or a real one.")],
    out: Out,
    trial: Annotated[list[str] | None, typer.Option(metavar="ID", help="Only this trial; repeatable.")] = None,
) -> None:
    """Plot recordings, a page a trial: markers and gaps, wrench, encoder differences."""
    from scenarios.commands import console
    from scenarios.quicklook.page import look as draw

    with console.progress() as progress:
        found = draw(dataset, out, trial or (), progress)
    for one in found:
        typer.echo(f"{one.entry.id}: {one.entry.role}, {one.entry.kind}")
        for line in one.findings:
            typer.echo(f"  {line}")
    typer.echo(f"Pictures: {out}")
