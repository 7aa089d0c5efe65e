"""Laboratory files into a dataset folder, and out of one: the commands `import` and `export`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.files import output_folder, yaml_file
from scenarios.files.errors import ScenarioError

if TYPE_CHECKING:
    from calibration.formats.mapping.channels import Reader
    from calibration.formats.mapping.mapping import Mapping, MappingFile

PACKAGED = "tiago"
"""What a mapping calls the nominal robot that comes with this program."""

MAPPING = "mapping.yaml"
"""The mapping file beside exported files."""


def import_files(
    kind: str, files: Sequence[Path], mapping: Path, out: Path, add_to: Path | None = None
) -> tuple[str, ...]:
    """Write the dataset folder `out` from files of one format; return what was recognised in them.

    Args:
        kind: `c3d`, `csv` or `bag`.
        files: The files; each belongs to the trial of its name.
        mapping: The mapping file.
        out: The dataset folder; an earlier dataset there is replaced.
        add_to: A dataset imported before whose trials gain these files' channels.

    Raises:
        ScenarioError: The mapping is malformed, or `out` must not be overwritten.
        InputError: A file is not what the mapping says; every finding of every file.
    """
    from calibration.formats.importer import import_files as write
    from calibration.formats.importer import refuse_foreign
    from calibration.formats.mapping.mapping import Mapping, MappingFile
    from calibration.recording import load

    refuse_foreign(kind, files)
    described = yaml_file.read(mapping, Mapping)
    source = MappingFile(mapping, described, _urdf(described, mapping))
    before = None if add_to is None else load(add_to)
    with output_folder.replacing(out, output_folder.DATASET) as new:
        return write(files, _reader(kind, source), source, new, before)


def export_files(kind: str, dataset: Path, out: Path, ros: int = 1) -> tuple[str, ...]:
    """Write the trials of a dataset as files of one format into the folder `out`, with the mapping that reads them.

    Returns:
        Trials the format has nothing of, and why.

    Raises:
        ScenarioError: `out` must not be overwritten.
        InputError: The dataset cannot be read, or the format cannot hold it.
    """
    from calibration.formats.exporter import export_trials
    from calibration.recording import load

    source = load(dataset)
    with output_folder.replacing(out, _exported(kind, [t.id for t in source.description.trials])) as new:
        mapping, notes = export_trials(kind, source, new, ros)
        yaml_file.write(new / MAPPING, mapping)
    return notes


def export_urdf(estimate: Path, out: Path) -> None:
    """Write the calibrated URDF of an estimate as the file `out`.

    Raises:
        InputError: There is no estimate, or it must not be used.
    """
    from calibration.errors import NotCalibrated
    from calibration.estimate.files import CALIBRATED, load_estimate

    found = load_estimate(estimate)
    path = (estimate if estimate.is_dir() else estimate.parent) / CALIBRATED
    if not found.calibrated or not path.is_file():
        raise NotCalibrated([v.message for v in found.verdicts if v.verdict == "refused"])
    if out.exists() and out.is_dir():
        raise ScenarioError(f"{out}: is a folder; name a file")
    with output_folder.updating(out.parent, [out.name]) as new:
        (new / out.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")


def _exported(kind: str, trials: Sequence[str]) -> output_folder.Kind:
    """Folders of exported files that may be replaced: those of the same trials."""
    suffixes = {
        "csv": (".mocap.csv", ".robot.csv", ".plate.csv", ".postures.csv"),
        "c3d": (".c3d",),
        "bag": (".bag", ""),
    }
    files = {f"{trial}{suffix}" for trial in trials for suffix in suffixes[kind]}
    return output_folder.Kind(f"{kind} export", MAPPING, frozenset(files | {MAPPING, "nominal.urdf"}))


def _reader(kind: str, mapping: "MappingFile") -> "Reader":
    from calibration.formats.bag.read import bag_reader
    from calibration.formats.c3d.read import c3d_reader
    from calibration.formats.csv.read import csv_reader

    content = mapping.content
    if kind == "csv" and content.csv:
        return csv_reader(content.csv, content.setup)
    if kind == "c3d" and content.c3d is not None:
        return c3d_reader(content.c3d, content.setup)
    if kind == "bag" and content.bag is not None:
        return bag_reader(content.bag)
    raise mapping.error(kind, "missing; say what is what in the files")


def _urdf(mapping: "Mapping", path: Path) -> str:
    if mapping.urdf == PACKAGED:
        import mjcf

        return mjcf.urdf()
    found = path.parent / mapping.urdf
    try:
        return found.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: urdf: {found} cannot be read ({error}); or write `urdf: {PACKAGED}`") from error
