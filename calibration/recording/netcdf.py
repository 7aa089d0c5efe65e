"""netCDF4 files, written and read by the format's own C library.

Signals are compressed, but for errors and predictions in f4, of which it saves a quarter of the bytes and takes longer
than writing them. The same data give the same bytes. The library is not safe for threads: one file at a time.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import prod
from pathlib import Path
from threading import RLock
from typing import Any

import netCDF4
import numpy as np

from calibration.errors import InputError

Group = netCDF4.Dataset | netCDF4.Group
_NO_UNIT = {"units": "none", "frame": "none", "clock": "none"}
_one_at_a_time = RLock()
_MOST_NUMBERS = 20_000_000  # of a variable: 160 MB
_MOST_LABELS, _LONGEST_LABEL = 1000, 200


@contextmanager
def created(path: Path) -> Iterator[netCDF4.Dataset]:
    """A new file; what was there is gone.

    Raises:
        OSError: It cannot be written.
    """
    try:
        with _one_at_a_time, netCDF4.Dataset(path, "w", format="NETCDF4") as file:
            yield file
    except (RuntimeError, PermissionError) as error:  # the library's words for a full disk
        raise OSError(f"{path}: cannot be written ({error}); is the disk full?") from error


@contextmanager
def opened(path: Path, remedy: str = "copy or record it again") -> Iterator[netCDF4.Dataset]:
    """A file to read, whose numbers come as they were written, not masked.

    Raises:
        InputError: It is not such a file, or lacks what is asked of it.
    """
    try:
        with _one_at_a_time, netCDF4.Dataset(path, "r") as file:
            file.set_auto_mask(False)
            yield file
    except (OSError, RuntimeError, KeyError, ValueError, IndexError, AttributeError) as error:
        why = error.args[0] if isinstance(error, KeyError) and error.args else error
        raise InputError(path, f"not a readable netCDF4 file ({why}); {remedy}") from error


def add_dimensions(group: Group, sizes: Mapping[str, int]) -> None:
    """Name the dimensions; one of no length is of the kind that may grow, the only one that may be empty."""
    for name, size in sizes.items():
        group.createDimension(name, size)


def write_labels(group: Group, names: Mapping[str, tuple[str, ...]]) -> None:
    """Write names along their dimension; `marker_body` lies along `marker`."""
    for label, values in names.items():
        variable = group.createVariable(label, str, ("marker" if label == "marker_body" else label,))
        variable.setncatts(_NO_UNIT)
        variable[:] = np.array(values, dtype=object)


def write_variable(
    group: Group,
    name: str,
    data: np.ndarray,
    dims: tuple[str, ...],
    kind: str,
    attributes: Mapping[str, str],
    compressed: bool = True,
) -> None:
    """Write an array, compressed or as it is, with its attributes; one that is empty says `none`."""
    zlib: dict[str, Any] = {"compression": "zlib", "complevel": 1, "shuffle": True}
    options = zlib if compressed and data.size else {}
    variable = group.createVariable(name, kind, dims, fill_value=False, **options)
    variable.setncatts({key: value or "none" for key, value in attributes.items()})
    variable[...] = data.astype(kind)


def labels(group: Group, name: str) -> tuple[str, ...]:
    """Names along a dimension; none where the file has no such variable.

    Raises:
        KeyError: They are no plain names, or too many.
    """
    if name not in group.variables:
        return ()
    variable = group.variables[name]
    if variable.size > _MOST_LABELS:
        raise KeyError(f"{name} has {variable.size} names")
    found = tuple(str(value) for value in np.ravel(variable[...]))
    if any(len(text) > _LONGEST_LABEL or not text.isprintable() for text in found):
        raise KeyError(f"{name} has names that are too long, or unprintable")
    return found


def array(group: Group, name: str) -> np.ndarray:
    """The numbers of a variable, f8.

    Raises:
        KeyError: There is none of that name, it holds no numbers, or too many.
    """
    variable = group.variables[name]
    if getattr(variable.dtype, "kind", "O") not in "iuf":
        raise KeyError(f"{name} holds no numbers")
    check_size(name, variable.shape)
    return np.asarray(variable[...], dtype=float)


def check_size(name: str, shape: tuple[int, ...]) -> None:
    """See that an array has room, before it is asked for.

    Raises:
        KeyError: It has not.
    """
    if prod(shape) > _MOST_NUMBERS:
        raise KeyError(f"{name} has {' x '.join(map(str, shape))} numbers; at most {_MOST_NUMBERS:.0e} are read")
