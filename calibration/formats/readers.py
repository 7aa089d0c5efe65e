"""The reader of laboratory files: of one format, or of each file's own."""

from collections.abc import Sequence
from functools import reduce
from pathlib import Path

from calibration.formats.bag.read import bag_reader
from calibration.formats.c3d.read import c3d_reader
from calibration.formats.csv.read import csv_reader
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
    content = mapping.content
    if kind == "csv" and content.csv:
        return csv_reader(content.csv, content.setup)
    if kind == "c3d" and content.c3d is not None:
        return c3d_reader(content.c3d, content.setup)
    if kind == "bag" and content.bag is not None:
        return bag_reader(content.bag)
    raise mapping.error(kind, "missing; state the channels of the files")
