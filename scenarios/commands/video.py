"""The command `tiago-twin picture`."""

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from scenarios.files.errors import ScenarioError


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
    magnify: Annotated[float, typer.Option(min=0.0, help="How many times as large the base's motion is drawn.")] = 1.0,
    start: Annotated[float, typer.Option(min=0.0, metavar="S", help="From the trial's start.")] = 0.0,
    duration: Annotated[float, typer.Option(min=0.1, max=120.0, metavar="S", help="Of the clip.")] = 10.0,
    ghost: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Share of the nominal robot that is mixed in, 0 to 1.")
    ] = 0.0,
    renderer: Annotated[Renderer, typer.Option(help="What draws.")] = Renderer.auto,
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
