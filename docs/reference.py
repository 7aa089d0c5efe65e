"""Pages of the site that are generated: `docs/reference/*.md` from the types, docstrings, scenarios and commands."""

import importlib
import inspect
import itertools
import json
import sys
from collections.abc import Iterable
from pathlib import Path

import typer.main

from scenarios import load
from scenarios.commands.main import app
from scenarios.files import registry
from scenarios.files.value_paths import value_paths
from scenarios.report.results.parameters import KINDS
from twin import laboratory
from twin.rendering import picture

OUT = Path(__file__).parent / "reference"
RUNS = Path(__file__).parent / "results" / "runs.json"
FACES = (
    "scenarios",
    "calibration",
    "calibration.recording",
    "calibration.robot",
    "calibration.prediction",
    "calibration.evaluation",
    "calibration.estimate",
    "calibration.design",
    "calibration.formats",
    "twin",
    "twin.defects",
    "twin.motions",
    "mjcf",
)
DEFAULT = "humanoids2024"
MEANINGS = {
    "geometry": "twist (x, y, z, rx, ry, rz) of each joint placement, on the right: M exp6(xi)",
    "frame": "rigid transform `frame.A.B` = T_A_B, translation and rotation vector; of a marker body: the twist of its "
    "placement on its link",
    "encoder": "reading at angle zero, cosine and sine of the error once and twice per turn, of the motor or link side",
    "backlash": "total width of the dead zone between motor and link",
    "gear": "compliance is deflection over torque; damping, inertias and servo gains of the drive",
    "friction": "Coulomb and viscous friction on the link side",
    "flexibility": "stiffness and damping of the column or of a link, about x and y",
    "link": "relative error of the mass, shift (cx, cy, cz) of the centre of mass in the link's axes",
    "payload": "mass, centre of mass and edge lengths of the payload",
    "suspension": "stiffness k and damping c of each wheel's bushing, along x, y, z and about rx, ry, rz",
    "contact": "normal stiffness kn and damping bn, friction coefficient mu of each wheel on the floor",
    "marker": "position of a marker in the frame of its body",
    "clock": "offset and drift of an instrument: t_mocap = t (1 + drift) + offset",
    "mocap": "noise and errors of the motion capture",
    "plate": "noise and errors of the force plate",
    "wrist": "noise and errors of the wrist's force-torque sensor",
    "log": "errors of the robot's log",
}


def table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    names = list(columns)
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def configuration() -> str:
    """Every value of the default scenario that `--set` reaches, grouped by what holds it."""
    parts = [
        "# Configuration\n\nEvery value `--set PATH=VALUE` reaches, as in the default scenario; another's: "
        "`tiago-twin show SCENARIO`. A path is the heading, a dot and the name.\n"
    ]
    for holder, values in itertools.groupby(value_paths(load(DEFAULT)), lambda v: v.path.rpartition(".")[0]):
        rows = (
            (f"`{v.path.rpartition('.')[2]}`", f"{v.value} {v.unit}", v.range, v.default, v.meaning) for v in values
        )
        parts.append(f"## {holder or 'scenario'}\n\n{table(('name', 'value', 'range', 'default', 'meaning'), rows)}\n")
    return "\n".join(parts)


def parameters() -> str:
    """Names, meanings, units and values of the truth of the default robot."""
    lab = laboratory(load(DEFAULT).twin, load(DEFAULT).seed)
    truth = (*lab.twin.truth, *(p for instrument in lab.instruments for p in instrument.parameters()))
    parts = [
        "# Parameters\n\nNames and units in `truth.json`, `estimate.json` and `score.json`; values are those of the "
        "default robot.\n"
    ]
    for kind, meaning in MEANINGS.items():
        rows = [(f"`{p.name}`", p.unit, f"{p.value:.6g}") for p in truth if p.name.split(".")[0] == kind]
        if rows:
            values = table(("name", "unit", "value"), rows)
            parts.append(f"## {KINDS[kind].capitalize()}\n\n`{kind}.*`: {meaning}.\n\n{values}\n")
    if unknown := {p.name.split(".")[0] for p in truth} - set(MEANINGS):
        raise SystemExit(f"docs/reference.py: say what these parameters are: {sorted(unknown)}")
    return "\n".join(parts)


def api() -> str:
    """Public names of each package, with their docstrings."""
    return "# Python API\n\n" + "\n".join(_face(importlib.import_module(name)) for name in FACES)


def _face(module: object) -> str:
    name, names = getattr(module, "__name__", ""), getattr(module, "__all__", ())
    return f"## {name}\n\n{inspect.getdoc(module)}\n\n" + "\n".join(
        _entry(n, getattr(module, n)) for n in sorted(names)
    )


def _entry(name: str, value: object) -> str:
    if inspect.ismodule(value) or not callable(value):
        return f"### {name}\n\n"
    kind = "class " if inspect.isclass(value) else ""
    try:
        signature = str(inspect.signature(value))
    except ValueError:
        signature = "(...)"
    methods = "".join(
        f"\n\n{n}{inspect.signature(m)}\n    {inspect.getdoc(m)}"
        for n, m in inspect.getmembers(value, inspect.isfunction if inspect.isclass(value) else lambda _: False)
        if not n.startswith("_") and n in vars(value)
    )
    return f"### {name}\n\n```text\n{kind}{name}{signature}\n\n{inspect.getdoc(value)}{methods}\n```\n"


def commands() -> str:
    """`--help` of every command."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="tiago-twin")
    parts = [f"# Help of every command\n\n```text\n{group.get_help(context)}\n```\n"]
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        below = typer.Context(command, info_name=name, parent=context, max_content_width=110)
        parts.append(f"## {name}\n\n```text\n{command.get_help(below)}\n```\n")
    return "\n".join(parts)


def scenarios() -> str:
    """Purpose and picture of every scenario."""
    parts = ["# Scenarios\n\nPurpose, robot and result of a run of each; errors against the motion capture.\n"]
    runs = json.loads(RUNS.read_text(encoding="utf-8"))
    for name in registry.names():
        loaded = load(name)
        picture(loaded.twin, loaded.seed, OUT / f"{name}.png", (450, 350))
        run = f"```bash\ntiago-twin run {name}\n```"
        parts.append(f"## {name}\n\n{loaded.description}.\n\n![The robot of {name}]({name}.png)\n\n{run}\n\n")
        parts.append(_result(runs, name))
    parts.append("More: [evidence](../results/README.md).\n")
    return "\n".join(parts)


def _result(runs: dict[str, dict[str, object]], name: str) -> str:
    """What a run of the scenario found, and the bars of its rows in millimetres."""
    if name not in runs:
        return ""
    one = runs[name]
    head, row = (" | ".join(cells) for cells in zip(*one["rows"], strict=True))
    how = f"Seed {one['seed']}{', `--quick`' if one['quick'] else ''}: {one['badge']}. {one['sentence']}"
    rows = f"| RMSE per component [mm] | {head} |\n|---{'|---' * len(one['rows'])}|\n| | {row} |"
    return f"{how}\n\n{rows}\n"


def main() -> int:
    """Write every page."""
    OUT.mkdir(exist_ok=True)
    for page in (configuration, parameters, api, commands, scenarios):
        name = "help" if page is commands else page.__name__
        (OUT / f"{name}.md").write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
