"""Laboratory files into a dataset folder, and out of one: the commands `import` and `export`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios import folder, yaml_file
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from calibration.io.assemble import Reader
    from calibration.io.mapping import Mapping, MappingFile

PACKAGED = "tiago"
"""What a mapping calls the nominal robot that comes with this program."""


def import_files(
    kind: str, files: Sequence[Path], mapping: Path, out: Path, add_to: Path | None = None
) -> tuple[str, ...]:
    """Write the dataset folder `out` from files of one format; return what was recognised in them.

    Args:
        kind: `csv` or `c3d`.
        files: The files; each belongs to the trial of its name.
        mapping: The mapping file.
        out: The dataset folder; an earlier dataset there is replaced.
        add_to: A dataset imported before whose trials gain these files' channels.

    Raises:
        ScenarioError: The mapping is malformed, or `out` must not be overwritten.
        InputError: A file is not what the mapping says; every finding of every file.
    """
    from calibration.dataset import load
    from calibration.io.assemble import import_files as write
    from calibration.io.mapping import Mapping, MappingFile

    described = yaml_file.read(mapping, Mapping)
    source = MappingFile(mapping, described, _urdf(described, mapping))
    before = None if add_to is None else load(add_to)
    with folder.replacing(out, folder.DATASET) as new:
        return write(files, _reader(kind, source), source, new, before)


def _reader(kind: str, mapping: "MappingFile") -> "Reader":
    from calibration.io.c3d_read import c3d_reader
    from calibration.io.csv_read import csv_reader

    if not getattr(mapping.content, kind):
        raise mapping.error(kind, "missing; say what is what in the files")
    return {"csv": csv_reader, "c3d": c3d_reader}[kind](mapping.content)


def _urdf(mapping: "Mapping", path: Path) -> str:
    if mapping.urdf == PACKAGED:
        import mjcf

        return mjcf.urdf()
    found = path.parent / mapping.urdf
    try:
        return found.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: urdf: {found} cannot be read ({error}); or write `urdf: {PACKAGED}`") from error
