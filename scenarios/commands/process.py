"""The commands `process`, `base` and `predict`: recordings of the whole robot, of its base alone, of another day."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.options import Out
from scenarios.files.ending import FAILED


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
    end = [f"\nStatus: {found.estimate.extent}", f"Report: {out / 'report.html'}"]
    if found.evaluated:
        console.show(console.ladder(out))
        console.show(console.points(out))
        end = ["", *console.summary(out)]
    elif found.estimate.has_geometry:
        typer.echo("\nNo validation trial: the error is the cross-validated one above; keep trials aside for another.")
    typer.echo("\n".join([*end, f"Estimate: {out / 'estimate'}"]))
    if not found.estimate.calibrated:
        typer.echo("The estimate must not be used; the refused verdicts state why.", err=True)
        raise typer.Exit(FAILED)


def base(  # noqa: PLR0913  an option each
    sources: Annotated[list[Path], typer.Argument(metavar="DATASET|FILE...", help="A dataset folder, or log files.")],
    out: Out,
    mapping: Annotated[
        Path | None, typer.Option("--map", metavar="YAML", help="Mapping file of the log files.")
    ] = None,
    fit: Annotated[
        float | None, typer.Option(min=0.0, metavar="S", help="Fit to the first S seconds, predict the rest.")
    ] = None,
    steady: Annotated[
        float | None, typer.Option(min=0.0, metavar="S", help="Leave out steady cycles in turn, from S seconds on.")
    ] = None,
    cycle: Annotated[float, typer.Option(min=0.5, metavar="S", help="Length of a cycle [s].")] = 5.0,
) -> None:
    """Fit the base's motion to base markers and plate alone, predict the rest of the log, and score it."""
    from scenarios.commands import console
    from scenarios.files.errors import ScenarioError
    from scenarios.steps.base_motion import Cycles, base_motion

    if mapping is None and not (len(sources) == 1 and sources[0].is_dir()):
        raise ScenarioError("base: name a dataset folder, or log files with their mapping (--map)")
    cycles = None if steady is None else Cycles(steady, cycle)
    with console.progress() as progress:
        found = base_motion(sources, mapping, out, fit, cycles, progress)
    for note in found.notes:
        typer.echo(note)
    typer.echo(
        "Forms: "
        + ", ".join(f"{a} {form}" for a, form in zip("x y z roll pitch yaw".split(), found.base.forms, strict=True))
    )
    rows = [
        {
            "part": name,
            "s": f"{s.seconds:.1f}",
            "hand [mm]": f"{1e3 * s.hand:.2f}",
            "base at rest": f"{1e3 * s.still:.2f}",
            "about its mean": f"{1e3 * s.about_mean:.2f}",
            "yaw R2": f"{s.yaw_r2:.2f}",
            "yaw R2, mean off": f"{s.yaw_r2_about_mean:.2f}",
            "in 95 % band": f"{s.covered.mean():.0%}",
        }
        for name, s in found.scores.items()
    ]
    console.show(console.records(rows))
    typer.echo(f"Base motion: {out}")


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
