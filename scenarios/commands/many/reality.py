"""The command `reality`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.commands.options import Overrides, ScenarioName, Seed, overriding

if TYPE_CHECKING:
    from scenarios.realism.compare import Replayed, Swings
    from scenarios.realism.log import Recorded


def reality(  # noqa: PLR0913  an option each
    scenario: ScenarioName = "reality",
    out: Annotated[Path, typer.Option(metavar="FILE", help="The JSON to write.")] = Path("runs/reality.json"),
    n: Annotated[int, typer.Option("-n", min=5, metavar="N", help="How many robots.")] = 20,
    log: Annotated[
        Path | None, typer.Option(metavar="DATASET", help="A recording whose plate wrench is replayed on their bases.")
    ] = None,
    causes: Annotated[
        bool,
        typer.Option(
            "--causes", help="Replay, too, with markers that shift as the recording's, then with casters that turn."
        ),
    ] = False,
    swings: Annotated[bool, typer.Option(help="Swing their arms.")] = True,
    seed: Seed = None,
    overrides: Overrides = None,
) -> None:
    """Compare sampled robots with a recording of a real one."""
    from scenarios import steps
    from scenarios.commands import console
    from scenarios.files import output_folder
    from scenarios.realism.compare import as_json, compare_replay, compare_swings
    from scenarios.realism.replayed import AS_DRAWN, CAUSES

    loaded = steps.load(scenario, overriding(overrides, seed))
    recordings = () if log is None else _recordings(log)
    conditions = (AS_DRAWN, *CAUSES) if causes else (AS_DRAWN,)
    with console.progress() as progress:
        swung = [compare_swings(loaded, n, progress)] if swings else []
        replays = [compare_replay(loaded, recordings, n, c, progress) for c in conditions if recordings]
    for one in swung:
        _show_swings(one)
    for each in replays:
        _show_replay(each)
    with output_folder.one_file(out) as new:
        new.write_text(json.dumps(as_json(swung, replays), indent=1) + "\n", encoding="utf-8")
    typer.echo(f"Comparison: {out}")


def _recordings(log: Path) -> "tuple[Recorded, ...]":
    from calibration.recording import load
    from scenarios.realism.log import recorded

    return recorded(load(log))


def _show_swings(found: "Swings") -> None:
    from scenarios.commands import console

    rows = [
        {
            "figure": r.figure,
            "unit": r.unit,
            "log": f"{r.log[0]:.3g}" if r.log[0] == r.log[1] else f"{r.log[0]:.3g}-{r.log[1]:.3g}",
            "5 %": f"{r.low:.3g}",
            "median": f"{r.median:.3g}",
            "95 %": f"{r.high:.3g}",
            "inside": "yes" if r.inside else "no",
        }
        for r in found.rows
    ]
    console.show(console.records(rows))
    typer.echo(f"{found.n_inside} of {len(found.rows)} figures inside, {found.n} robots")
    words = ("linear", found.linear), ("with backlash operators", found.hysteretic)
    typer.echo(
        "Yaw by Mz, R2 on the second half: " + ", ".join(f"{w} {m:.2f} ({a:.2f} to {b:.2f})" for w, (a, m, b) in words)
    )
    for line in found.failed:
        typer.echo(line, err=True)


def _show_replay(found: "Replayed") -> None:
    from scenarios.commands import console
    from scenarios.realism.replayed import AXES

    rows = [
        {
            "trial": t.trial_id,
            "condition": found.condition.name,
            **dict(zip(AXES, (f"{v:.0%}" for v in t.share), strict=True)),
        }
        for t in found.trials
    ]
    whole = dict(zip(AXES, (f"{v:.0%}" for v in found.share), strict=True))
    console.show(console.records([*rows, {"trial": "all", "condition": found.condition.name, **whole}]))
