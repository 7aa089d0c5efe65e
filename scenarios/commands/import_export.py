"""The commands `import` and `export`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from scenarios.files.errors import ScenarioError

FORMATS = ("c3d", "csv", "bag")


def import_(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FORMAT] FILE...", help="Files, matched to trials by name; those the mapping names unless given."
        ),
    ] = None,
    mapping: Annotated[Path | None, typer.Option("--map", metavar="YAML", help="Frames, units, trial roles.")] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="The dataset folder to write.")] = None,
    add_to: Annotated[
        Path | None, typer.Option(metavar="DATASET", help="Add these instruments to the trials of this dataset.")
    ] = None,
    init: Annotated[
        Path | None, typer.Option(metavar="YAML", help="Draft this mapping from the files instead.")
    ] = None,
    urdf: Annotated[Path | None, typer.Option(metavar="URDF", help="Your robot, with --init.")] = None,
) -> None:
    """Write a dataset from laboratory files, or draft the mapping that reads them (--init)."""
    from scenarios.commands import console
    from scenarios.steps import import_export

    given = list(files or [])
    kind = str(given.pop(0)) if given and str(given[0]) in FORMATS else None
    if init is not None:
        typer.echo(import_export.init_mapping(given, init, urdf), nl=False)
        typer.echo(f"\nMapping: {init}; check its lines marked CHOOSE, and GUESS where wrong", err=True)
        return
    if mapping is None or out is None:
        raise ScenarioError("import: name a mapping with --map and a folder with --out; --init drafts a mapping")
    with console.progress() as progress:
        notes = import_export.import_files(kind, given, mapping, out, add_to, progress=progress)
    for note in notes:
        typer.echo(note)
    typer.echo(f"Dataset: {out}")


def export(
    kind: Annotated[Literal["c3d", "csv", "bag", "urdf"], typer.Argument(metavar="FORMAT", help="To write.")],
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="A dataset folder; an estimate for urdf.")],
    out: Annotated[Path, typer.Option(metavar="PATH", help="The folder to write; the file for urdf.")],
    ros: Annotated[int, typer.Option(min=1, max=2, metavar="1|2", help="Bags of ROS 1, or of ROS 2 (mcap).")] = 1,
) -> None:
    """Write laboratory files from a dataset, or the calibrated URDF of an estimate."""
    from scenarios.commands import console
    from scenarios.steps import import_export

    with console.progress() as progress:
        notes = () if kind == "urdf" else import_export.export_files(kind, source, out, ros, progress)
    if kind == "urdf":
        import_export.export_urdf(source, out)
    for note in notes:
        typer.echo(note)
    typer.echo(f"Written: {out}")
