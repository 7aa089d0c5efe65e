"""The reader of laboratory files: of one format, or of each file's own."""

from collections.abc import Sequence
from functools import reduce
from pathlib import Path

from calibration.formats.bag.read import read_bag
from calibration.formats.c3d.read import read_c3d
from calibration.formats.csv.read import read_csv, table_of
from calibration.formats.importer import format_of
from calibration.formats.mapping.channels import Reader, Recorded
from calibration.formats.mapping.mapping import MappingFile


def reader_of(kind: str | None, mapping: MappingFile) -> Reader:
    """Of one format, or of each file by its suffix.

    Args:
        kind: `c3d`, `csv` or `bag`; None: each by its suffix.
        mapping: What is what in the files.

    Raises:
        InputError: The mapping says nothing of that format.
    """
    if kind is not None:
        return _reader_of(kind, mapping)

    def read(paths: Sequence[Path]) -> Recorded:
        kinds = dict.fromkeys(format_of(p) for p in paths)
        parts = (_reader_of(k, mapping).read([p for p in paths if format_of(p) == k]) for k in kinds)
        return reduce(Recorded.with_channels_of, parts)

    return Reader(read, lambda path: _reader_of(format_of(path), mapping).stem(path))


def _reader_of(kind: str, mapping: MappingFile) -> Reader:
    csv, c3d, bag, setup = mapping.content.csv, mapping.content.c3d, mapping.content.bag, mapping.content.setup
    if kind == "csv" and csv:
        return Reader(lambda paths: read_csv(paths, csv, setup), lambda p: p.name.removesuffix(table_of(p, csv).suffix))
    if kind == "c3d" and c3d is not None:
        return Reader(lambda paths: read_c3d(paths, c3d, setup), lambda path: path.stem)
    if kind == "bag" and bag is not None:  # a ROS 2 bag may be a folder
        return Reader(lambda paths: read_bag(paths, bag), lambda path: path.name if path.is_dir() else path.stem)
    raise mapping.error(kind, "missing; state the channels of the files")
