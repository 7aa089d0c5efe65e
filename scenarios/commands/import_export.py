"""The commands `import` and `export`."""

from pathlib import Path
from typing import Annotated, Literal

import typer


def import_(
    kind: Annotated[Literal["c3d", "csv", "bag"], typer.Argument(metavar="FORMAT", help="Of the files.")],
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Files are matched to trials by name.")],
    mapping: Annotated[
        Path,
        typer.Option("--map", metavar="YAML", help="Mapping: frames, units, roles; see docs/recording.md."),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    add_to: Annotated[
        Path | None, typer.Option(metavar="DATASET", help="Add these instruments to the trials of this dataset.")
    ] = None,
) -> None:
    """Write a dataset from laboratory files."""
    from scenarios.steps import import_export

    for note in import_export.import_files(kind, files, mapping, out, add_to):
        typer.echo(note)
    typer.echo(f"Dataset: {out}")


def export(
    kind: Annotated[Literal["c3d", "csv", "bag", "urdf"], typer.Argument(metavar="FORMAT", help="To write.")],
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="A dataset folder; an estimate for urdf.")],
    out: Annotated[Path, typer.Option(metavar="PATH", help="The folder to write; the file for urdf.")],
    ros: Annotated[int, typer.Option(min=1, max=2, metavar="1|2", help="Bags of ROS 1, or of ROS 2 (mcap).")] = 1,
) -> None:
    """Write laboratory files from a dataset, or the calibrated URDF of an estimate."""
    from scenarios.steps import import_export

    notes = () if kind == "urdf" else import_export.export_files(kind, source, out, ros)
    if kind == "urdf":
        import_export.export_urdf(source, out)
    for note in notes:
        typer.echo(note)
    typer.echo(f"Written: {out}")
