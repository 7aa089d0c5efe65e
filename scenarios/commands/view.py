"""The command `view`."""

import webbrowser
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from scenarios.files.ending import FAILED


def view(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="An evaluated run folder, simulated or real.")],
    trial: Annotated[
        str | None, typer.Option(metavar="ID", help="A held-out trial; the first that moves unless given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The page; RUN/view.html unless given.")] = None,
    magnify: Annotated[float, typer.Option(min=0.0, help="How many times as large errors and base motion are.")] = 20.0,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open it in a browser.")] = False,
) -> None:
    """Write a 3D page of a trial: robot, markers, force, predicted hands."""
    from scenarios.commands import console

    page = out or run_folder / "view.html"
    with console.progress() as progress:
        progress("view", "", 0.0)
        try:
            from scenarios.view.page import write
        except ModuleNotFoundError as error:
            if error.name not in ("trimesh", "viser"):
                raise
            typer.echo(f"{error}; install the extra in a clone of the repository: pip install '.[view]'", err=True)
            raise typer.Exit(FAILED) from error
        shown = write(run_folder, trial, page, magnify, partial(progress, "view"))
    typer.echo(f"View of {shown}: {page}")
    if open_:
        webbrowser.open(page.resolve().as_uri())
