"""The command `tiago-twin`.

Exit code 0: done. 1: the simulation or the fit failed, or its result must not be used. 2: wrong input.
"""

import logging
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from scenarios.commands import check as command_check
from scenarios.commands import design as command_design
from scenarios.commands import import_export, results
from scenarios.commands import process as command_process
from scenarios.commands.many import benchmark as command_benchmark
from scenarios.commands.many import dataset as command_dataset
from scenarios.commands.many import reality as command_reality
from scenarios.commands.many import study as command_study
from scenarios.commands.options import Grouped, Out, Overrides, Quick, ScenarioName, Seed, overriding
from scenarios.files.ending import FAILED, Ending

TERMINATED = 128 + signal.SIGTERM


_SIMULATE, _CALIBRATE, _RECORD = "Simulate", "Calibrate and evaluate", "Laboratory recordings"
_LOOK, _MANY, _TEST = "Look at results", "Many robots", "Test a calibration program"


def _example(arguments: str) -> str:
    return f"\b\nExample: tiago-twin {arguments}"


app = typer.Typer(
    no_args_is_help=True,
    cls=Grouped,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Simulate a TIAGo with known errors, calibrate it from its recordings, evaluate the result on unseen motion.",
    epilog="Start: tiago-twin run short --quick",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"tiago-twin {version('tiago-twin')}")
        raise typer.Exit


@app.callback()
def options(
    verbose: Annotated[bool, typer.Option("--verbose", help="Log more on stderr.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Set up logging."""
    level = logging.INFO if verbose else logging.WARNING
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")


@app.command("list", epilog=_example("list"), rich_help_panel=_SIMULATE)
def list_scenarios() -> None:
    """List the scenarios, each with the length of its recordings."""
    from scenarios.files import registry, yaml_file

    width = max(map(len, registry.names()), default=0)
    for name in registry.names():
        typer.echo(f"{name:{width}}  {yaml_file.mapping(registry.find(name))['description']}")


@app.command(
    epilog=_example("run humanoids2024 --seed 7 --set twin.arm.arm_6_joint.gap=0.012"), rich_help_panel=_SIMULATE
)
def run(
    scenario: ScenarioName,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="The run folder; runs/NAME unless given.")] = None,
    seed: Seed = None,
    quick: Quick = False,
    overrides: Overrides = None,
) -> None:
    """Simulate, calibrate, evaluate and report."""
    from scenarios import steps
    from scenarios.commands import console

    loaded = steps.load(scenario, overriding(overrides, seed))
    out = out or Path("runs") / loaded.name
    with console.progress() as progress:
        result = steps.run(loaded, out, quick=quick, progress=progress)
    if (table := console.frames(out)) is not None:
        console.show(console.verdicts([v for v in result.estimate.verdicts if v.stage in ("base_frame", "arm_tool")]))
        console.show(table)
    console.show(console.confirmation(out))
    for line in console.summary(out):
        typer.echo(line)


@app.command(epilog=_example("simulate short --quick --out runs/short"), rich_help_panel=_SIMULATE)
def simulate(
    scenario: ScenarioName,
    out: Out,
    seed: Seed = None,
    quick: Quick = False,
    overrides: Overrides = None,
    also: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Record the postures of a record_next.yaml, too.")
    ] = None,
) -> None:
    """Write dataset/ and truth/ of a scenario."""
    from scenarios import steps
    from scenarios.commands import console

    loaded = steps.load(scenario, overriding(overrides, seed))
    if also is not None:
        from scenarios.steps.design import recording_too

        loaded = recording_too(loaded, also)
    with console.progress() as progress:
        steps.simulate(loaded.quick() if quick else loaded, out, progress)
    typer.echo(f"Dataset: {out / 'dataset'}\nTruth: {out / 'truth'}")


@app.command(epilog=_example("calibrate runs/short/dataset --out runs/short/estimate"), rich_help_panel=_CALIBRATE)
def calibrate(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="A dataset folder, the twin's or a real one.")],
    out: Out,
    stages: Annotated[str | None, typer.Option(metavar="A,B,...", help="Only these stages, in this order.")] = None,
    terms: Annotated[
        str | None, typer.Option(metavar="printed|tensor|total", help="Terms of the joint models; total by default.")
    ] = None,
    suspension: Annotated[
        str | None, typer.Option(metavar="diagonal|full", help="Each wheel's springs; diagonal by default.")
    ] = None,
    plan_next: Annotated[
        bool, typer.Option("--next", help="Search for what to record next, too: record_next.yaml.")
    ] = False,
) -> None:
    """Write an estimate from a dataset folder alone."""
    from scenarios import steps
    from scenarios.commands import console

    chosen = None if stages is None else [stage.strip() for stage in stages.split(",")]
    with console.progress() as progress:
        options = steps.options(terms=terms, suspension=suspension)
        estimate = steps.calibrate(dataset, out, chosen, progress, options, plan_next)
    console.show(console.verdicts(estimate.verdicts))
    typer.echo(f"\nStatus: {estimate.extent}\nEstimate: {out}")
    if not estimate.calibrated:
        typer.echo("The estimate must not be used; the refused verdicts state why.", err=True)
        raise typer.Exit(FAILED)


@app.command(
    epilog=_example("evaluate runs/short/estimate runs/short/dataset --out runs/evaluation"), rich_help_panel=_CALIBRATE
)
def evaluate(
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE", help="An estimate folder or file.")],
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="A dataset folder.")],
    out: Out,
    truth: Annotated[Path | None, typer.Option(metavar="TRUTH", help="A truth folder: adds score.json.")] = None,
    zeros: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Encoder zeros of a URDF: YAML or CSV of joint, offset."),
    ] = None,
) -> None:
    """Write the error of an estimate, a URDF or predicted poses on unseen trials."""
    from scenarios import steps
    from scenarios.commands import console

    with console.progress() as progress:
        steps.evaluate(estimate, dataset, out, truth, progress, zeros)
    console.show(console.ladder(out))
    console.show(console.points(out))
    for line in console.remarks(out):
        typer.echo(line)
    console.show(console.confirmation(out))


@app.command(epilog=_example("report runs/short"), rich_help_panel=_LOOK)
def report(run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, or an estimate.")]) -> None:
    """Write report.html from a run folder or an estimate."""
    from scenarios import steps
    from scenarios.commands import console

    with console.progress() as progress:
        page = steps.report(run_folder, progress)
    typer.echo(f"Report: {page}")


import_ = app.command(
    "import", epilog=_example("import csv lab/*.csv --map lab.yaml --out dataset"), rich_help_panel=_RECORD
)(import_export.import_)
export = app.command(epilog=_example("export urdf runs/short/estimate --out tiago.urdf"), rich_help_panel=_RECORD)(
    import_export.export
)
dataset = app.command(epilog=_example("dataset swing20 -n 10 --out runs/swing20"), rich_help_panel=_MANY)(
    command_dataset.dataset
)
design = app.command(epilog=_example("design short -n 30 --out postures.yaml"), rich_help_panel=_RECORD)(
    command_design.design
)
study = app.command(epilog=_example("study coverage short -n 20 --out runs/coverage"), rich_help_panel=_MANY)(
    command_study.study
)
process = app.command(epilog=_example("process lab.yaml --out runs/lab"), rich_help_panel=_CALIBRATE)(
    command_process.process
)
base = app.command(epilog=_example("base log.csv --map log.yaml --fit 28 --out runs/base"), rich_help_panel=_CALIBRATE)(
    command_process.base
)
predict = app.command(
    epilog=_example("predict runs/lab/estimate day2/*.csv --map lab.yaml --out runs/day2"), rich_help_panel=_CALIBRATE
)(command_process.predict)
look = app.command(epilog=_example("look runs/short/dataset --out runs/look"), rich_help_panel=_LOOK)(results.look)
picture = app.command(epilog=_example("picture runs/short --still posture.png --magnify 50"), rich_help_panel=_LOOK)(
    results.picture
)
view = app.command(epilog=_example("view runs/short --trial xyz --magnify 50"), rich_help_panel=_LOOK)(results.view)
reality = app.command(epilog=_example("reality -n 20 --out runs/reality.json"), rich_help_panel=_MANY)(
    command_reality.reality
)
show = app.command(epilog=_example("show humanoids2024 gap"), rich_help_panel=_SIMULATE)(results.show)
benchmark = app.command(epilog=_example("benchmark make --out runs/bench"), rich_help_panel=_TEST)(
    command_benchmark.benchmark
)
peer = app.command(epilog=_example("peer runs/short/dataset --out runs/peer"), rich_help_panel=_TEST)(
    command_benchmark.peer
)
check = app.command(epilog=_example("check runs/short --max model_2.mm=2.5"), rich_help_panel=_TEST)(
    command_check.check
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command and exit with its code; what a user can mend is one message without a traceback."""
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        with Ending():
            app(args=arguments, prog_name="tiago-twin")
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: FrameType | None) -> None:
    """Leave through the same clean-up as on Ctrl-C."""
    sys.exit(TERMINATED)
