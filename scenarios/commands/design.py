"""The command `design`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from scenarios.commands.options import Overrides, ScenarioName, Seed, overriding
from scenarios.files.errors import ScenarioError

_SHOWN = 0.3  # of a logarithm: what the motions identify


def design(  # noqa: PLR0913  an option each
    scenario: ScenarioName,
    out: Annotated[Path, typer.Option(metavar="FILE", help="The YAML file to write.")],
    n: Annotated[int, typer.Option("-n", min=5, max=500, metavar="N", help="How many postures.")] = 30,
    criterion: Annotated[
        Literal["D", "E", "G"],
        typer.Option(help="D: least volume; E: least worst direction; G: least worst-case error of the hand."),
    ] = "G",
    campaign: Annotated[
        Path | None, typer.Option(metavar="YAML", help="Write the scenario that records them, too.")
    ] = None,
    play: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write the tour as play_motion and JointTrajectory YAML and as CSV, too."),
    ] = None,
    base: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write motions that make the base's wheels stick and slip as CSV, too."),
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
) -> None:
    """Choose calibration postures and approach directions."""
    from scenarios import steps
    from scenarios.commands import console
    from scenarios.steps.design import design as designed
    from scenarios.steps.design import with_base_motions

    for path in (p for p in (out, campaign) if p is not None and p.is_dir()):
        raise ScenarioError(f"{path}: is a folder; name a file")
    loaded = steps.load(scenario, overriding(overrides, seed))
    if base is not None:
        loaded, shown = with_base_motions(loaded, base)
        known = [f"{n} {100.0 * s:.0f} %" for n, s in zip(shown.names, shown.sigma, strict=True) if s < _SHOWN]
        typer.echo(
            f"Base motions: {base}, {len(shown.motions)}; expected standard deviations after them: {', '.join(known)}"
        )
    with console.progress() as progress:
        found = designed(loaded, n, criterion, out, campaign, play, progress)
    plan, against = found.plan, found.comparison
    typer.echo(
        f"{n} postures, {plan.design.prospect.B.shape[2]} identifiable combinations; predicted error of the hand at "
        f"worst {1e3 * against.designed:.2f} mm, {100.0 * against.gain:.0f} % below the median of "
        f"{len(against.random)} random sets"
    )
    typer.echo(
        f"Approach: backlash would move the hand by {1e3 * plan.sides.one_sided.max():.2f} mm if every joint "
        f"approached from below; {1e3 * plan.sides.bias.max():.2f} mm with the approach directions in the file"
    )
    if plan.tour.contact:
        typer.echo(f"Not reached by a straight move clear of the robot: postures {list(plan.tour.contact)} (from 0)")
    typer.echo(
        f"Postures: {out}" + (f"\nScenario: {campaign}" if campaign else "") + (f"\nTour: {play}" if play else "")
    )
