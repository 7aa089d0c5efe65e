"""Arguments and options that several commands have."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup


def _scenarios(beginning: str) -> list[str]:
    from scenarios.files import registry

    return [name for name in registry.names() if name.startswith(beginning)]


ScenarioName = Annotated[
    str,
    typer.Argument(metavar="SCENARIO", help="A name from `list`, or a YAML file.", autocompletion=_scenarios),
]
Out = Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")]
Seed = Annotated[int | None, typer.Option(min=0, metavar="N", help="Random seed; the scenario's unless given.")]
Quick = Annotated[bool, typer.Option("--quick", help="A shorter campaign, about 3 minutes of recordings.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        help="Override a scenario value; repeatable; see `show`.",
    ),
]
Workers = Annotated[int, typer.Option(min=0, metavar="K", help="Worker processes; 0: in this process.")]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS", help="A running dask scheduler instead.")]


def overriding(given: Sequence[str] | None, seed: int | None) -> list[str]:
    """The overrides with the seed among them."""
    return [*(given or ()), *(() if seed is None else (f"seed={seed}",))]


class Grouped(TyperGroup):
    """Commands in help by their `rich_help_panel`, a line each; without rich and pydantic, which import slowly."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Its options; a flag that is not set is False from the start, for typer converts None by pydantic."""
        found = super().get_params(ctx)
        for flag in found:
            if flag.type_descriptor.annotation is bool and flag.default is None:
                flag.default = False
        return found

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each panel, in the order in which they first occur."""
        found: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command: Any = self.get_command(ctx, name)
            text = str(command.help).strip().partition("\n\n")[0]
            found.setdefault(command.rich_help_panel or "Commands", []).append((name, " ".join(text.split())))
        for panel, lines in found.items():
            with formatter.section(panel):
                formatter.write_dl(lines)
