"""The commands that look at recordings and results: `look`, `show`, `picture`, `view`."""

import os
import sys
import webbrowser
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.options import Out, ScenarioName
from scenarios.files.ending import FAILED
from scenarios.files.errors import ScenarioError


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


def show(
    scenario: ScenarioName,
    word: Annotated[str, typer.Argument(metavar="[WORD]", help="Only values whose path or meaning contains it.")] = "",
) -> None:
    """Print a scenario and every value that --set can reach: unit, range, default, meaning."""
    from scenarios import steps
    from scenarios.files.value_paths import value_paths

    loaded = steps.load(scenario)
    found = [one for one in value_paths(loaded) if word.lower() in f"{one.path} {one.meaning}".lower()]
    if not found:
        raise ScenarioError(f"{word}: in no path and no meaning of {loaded.name}; without a word every value is shown")
    typer.echo(f"{loaded.name}: {loaded.description}. Seed {loaded.seed}.\n")
    for one in found:
        default = f"default {one.default}" if one.default and one.default != one.value else ""
        unit = f" [{one.unit}]" if one.unit else ""
        notes = "".join(f"; {note}" for note in (one.range, default, one.meaning) if note)
        typer.echo(f"{one.path} = {one.value}{unit}{notes}")


class Renderer(StrEnum):
    """What draws: a graphics driver, ray casting on the processor, or the driver where there is one."""

    auto = "auto"
    egl = "egl"
    rays = "rays"


def picture(  # noqa: PLR0913  an option each
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with its truth.")],
    trial: Annotated[str, typer.Option(metavar="ID", help="The trial.")] = "xyz",
    clip: Annotated[Path | None, typer.Option(metavar="FILE", help="The GIF to write.")] = None,
    still: Annotated[Path | None, typer.Option(metavar="FILE", help="The PNG to write, at --start.")] = None,
    magnify: Annotated[
        float, typer.Option(min=0.0, max=1e4, metavar="M", help="Show the base's motion M times as large.")
    ] = 1.0,
    start: Annotated[
        float, typer.Option(min=0.0, metavar="S", help="Start of the clip, or time of the still [s].")
    ] = 0.0,
    duration: Annotated[float, typer.Option(min=0.1, max=120.0, metavar="S", help="Length of the clip [s].")] = 10.0,
    ghost: Annotated[
        float, typer.Option(min=0.0, max=1.0, metavar="X", help="Opacity of the nominal robot beside it.")
    ] = 0.0,
    renderer: Annotated[
        Renderer, typer.Option(help="egl: graphics driver; rays: ray casting without one.")
    ] = Renderer.auto,
) -> None:
    """Render a trial of a simulated run, with markers and plate force."""
    if clip is None and still is None:
        raise ScenarioError("nothing to write; name a file: --clip FILE.gif, --still FILE.png, or both")

    wrong = [
        f"--{name} {path}: it is written as {ending[1:].upper()}; name a file that ends in {ending}"
        for name, path, ending in (("clip", clip, ".gif"), ("still", still, ".png"))
        if path is not None and path.suffix.lower() != ending
    ]
    if wrong:
        raise ScenarioError("\n".join(wrong))

    from scenarios.commands import console
    from scenarios.steps.video import film
    from twin.rendering import ClipOptions

    for path, seconds in ((still, 0.0), (clip, duration)):
        if path is not None:
            options = ClipOptions(magnify=magnify, start=start, duration=seconds, renderer=renderer.value, ghost=ghost)
            with console.progress() as progress:
                n = film(run_folder, trial, path, options, partial(progress, "picture", path.name))
            typer.echo(f"{path}: {n} picture{'s' if n > 1 else ''} of {trial}")


def _on_screen() -> bool:
    """Whether somebody at a terminal has a screen to open a page on."""
    return sys.stdout.isatty() and (
        sys.platform != "linux" or not {"DISPLAY", "WAYLAND_DISPLAY"}.isdisjoint(os.environ)
    )


def view(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="An evaluated run folder, simulated or real.")],
    open_: Annotated[
        bool,
        typer.Option(
            "--open/--no-open",
            default_factory=_on_screen,
            show_default=False,
            help="Open it in a browser; done on a desktop unless given.",
        ),
    ],
    trial: Annotated[
        str | None, typer.Option(metavar="ID", help="A held-out trial; the first that moves unless given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The page; RUN/view.html unless given.")] = None,
    magnify: Annotated[
        float, typer.Option(min=0.0, max=1e4, metavar="M", help="Show errors and base motion M times as large.")
    ] = 20.0,
) -> None:
    """Write and open a 3D page of a trial: robot, markers, force, predicted hands."""
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
