"""The command `show`."""

from typing import Annotated

import typer

from scenarios.commands.options import ScenarioName


def show(
    scenario: ScenarioName,
    word: Annotated[str, typer.Argument(metavar="[WORD]", help="Only values whose path or meaning contains it.")] = "",
) -> None:
    """Print a scenario and every value that --set can reach: unit, range, default, meaning."""
    from scenarios import steps
    from scenarios.files.value_paths import value_paths

    loaded = steps.load(scenario)
    typer.echo(f"{loaded.name}: {loaded.description}. Seed {loaded.seed}.\n")
    for one in value_paths(loaded):
        if word.lower() in f"{one.path} {one.meaning}".lower():
            notes = [
                one.range,
                f"default {one.default}" if one.default and one.default != one.value else "",
                one.meaning,
            ]
            unit = f" [{one.unit}]" if one.unit else ""
            typer.echo(f"{one.path} = {one.value}{unit}" + "".join(f"; {note}" for note in notes if note))
