"""Random damage to files: bytes of any, values of JSON and YAML, cells of CSV, arrays of netCDF.

A change is a pair of integers, (where, what): the same pair damages the same file in the same way.
"""

import json
from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path

import netCDF4
import numpy as np

Change = tuple[int, int]

VALUES = (
    None, True, 0, -1, 1, 10**9, 10**30, -(10**400), 0.5, -0.0, 1e-300, 1e300, float("nan"), float("inf"), "", "x",
    "../x", "/etc/passwd",
    "a\0b", "\ud800", "<b>",
    "x" * 10_000, [], [[]], {}, {"": 1}, [1, 2, 3], [None] * 1000, "nan", "2024-02-30", "$\\frac{$",
    "base", "arm_1_joint", "calibration", "1e5",
)  # fmt: skip
CELLS = ("", "nan", "inf", "-inf", "1e308", "x", "0", "-1", "1" * 5000, '"', '"a\nb"', "1,2", "\0", "1e-320", "0x10")
NUMBERS = (np.nan, np.inf, -np.inf, 0.0, 1e30, -1e30, 1e-30, 1e3, -1.0)


def of_bytes(path: Path, changes: Sequence[Change]) -> None:
    """Set, flip, insert, remove or repeat bytes, or cut the file."""
    content = bytearray(path.read_bytes())
    for where, what in changes:
        if not content:
            break
        at = where % min(len(content), 4096 if what % 3 else len(content))  # heads are where formats are
        kind, value = what // 3 % 7, what // 21 % 256
        if kind == 0:
            content[at] = value
        elif kind == 1:
            content[at] ^= 1 << value % 8
        elif kind == 2:
            content[at:at] = bytes([value] * (1 + value % 9))
        elif kind == 3:
            del content[at : at + 1 + value]
        elif kind == 4:
            del content[at:]
        elif kind == 5:
            content[at : at + 2] = b"\xff\xff"
        else:
            content[at:at] = content[at : at + 300]
    path.write_bytes(bytes(content))


def of_json(path: Path, changes: Sequence[Change]) -> None:
    """Put a value anywhere, remove an entry, double one, or exchange two."""
    tree = json.loads(path.read_text())
    for where, what in changes:
        nodes = list(_nodes(tree))
        holder, key = nodes[where % len(nodes)]
        kind, value = what % 8, deepcopy(VALUES[what // 8 % len(VALUES)])
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, list):
            holder.append(holder[key])
        elif kind == 2:
            other, name = nodes[what // 8 % len(nodes)]
            holder[key] = json.loads(json.dumps(other[name]))
        elif kind == 3 and isinstance(holder[key], int | float) and abs(holder[key]) < 1e300:
            holder[key] = holder[key] * (-1.0, 1e3, 1e-3, 57.3, 0.0)[what // 8 % 5]
        else:
            holder[key] = value
        if not list(_nodes(tree)):
            break
    path.write_bytes(json.dumps(tree).encode("utf-8", "replace"))


def of_yaml(path: Path, changes: Sequence[Change]) -> None:
    """As of JSON, or as of bytes."""
    from ruamel.yaml import YAML

    if changes[0][1] % 4 == 0:
        of_bytes(path, changes)
        return
    path.write_text(json.dumps(YAML(typ="safe", pure=True).load(path.read_text()), default=str))  # JSON is YAML
    of_json(path, changes)


def of_csv(path: Path, changes: Sequence[Change]) -> None:
    """Other cells, rows twice, exchanged or gone, or as of bytes."""
    if changes[0][1] % 4 == 0:
        of_bytes(path, changes)
        return
    rows = [line.split(",") for line in path.read_text().splitlines()]
    for where, what in changes:
        row, kind = where % len(rows), what // 4 % 5
        if kind == 0:
            rows.insert(row, list(rows[row]))
        elif kind == 1 and len(rows) > 1:
            del rows[row]
        elif kind == 2:
            rows[row], rows[-1] = rows[-1], rows[row]
        else:
            rows[row % 3 if kind == 3 else row][what // 20 % len(rows[0]) if rows[row % 3] else 0] = CELLS[
                what // 500 % len(CELLS)
            ]
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")


def of_netcdf(path: Path, changes: Sequence[Change]) -> None:
    """Other numbers in an array: one, a block, all; or as of bytes."""
    if changes[0][1] % 4 == 0:
        of_bytes(path, changes)
        return
    with netCDF4.Dataset(path, "r+") as file:
        file.set_auto_mask(False)
        names = sorted(n for n, v in file.variables.items() if v.dtype is not str and v.size)
        for where, what in changes:
            name = names[where % len(names)]
            x = file.variables[name][...]
            flat, n = x.reshape(-1), x.size
            at, number, kind = where // len(names) % n, NUMBERS[what // 20 % len(NUMBERS)], what // 4 % 5
            part = slice(at, at + 1) if kind < 2 else slice(at, at + n // 10 + 1) if kind < 4 else slice(0, n)
            with np.errstate(all="ignore"):
                flat[part] = (
                    flat[part] * np.asarray(number).astype(x.dtype)
                    if what // 200 % 2
                    else np.asarray(number).astype(x.dtype)
                )
            file.variables[name][...] = x


def _nodes(tree: object):
    """Every (container, key)."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in list(items):
        yield tree, key
        yield from _nodes(value)
