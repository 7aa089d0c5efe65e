"""The parameter section of a C3D file, walked before ezc3d reads it: a wrong byte there makes ezc3d loop or crash.

    record    length of name (int8, negative: locked), group id (int8, negative: a group), name, offset to the next
    group     length of description (uint8), description
    parameter type (int8: -1 char, 1 byte, 2 int16, 4 float32), number of dimensions (uint8), dimensions, data, as above

Source: C3D user guide, parameter section.
"""

import struct
from collections.abc import Iterator, Mapping
from math import prod

_TYPES = {-1: "c", 1: "B", 2: "h", 4: "f"}
_MOST_DIMENSIONS = 7
_TO_AGREE = {("POINT", "USED"): "points", ("ANALOG", "USED"): "channels"}
_PLAIN = 126  # largest character of a name


def faults(section: bytes, expected: Mapping[str, int]) -> Iterator[str]:
    """What is wrong with a parameter section, its four leading bytes included.

    Args:
        section: From the section's first byte to the data.
        expected: Numbers of `points` and `channels` by the file's header.
    """
    try:
        found = dict(_records(section))
    except (struct.error, IndexError, ValueError) as error:
        yield f"its parameter section is damaged ({error})"
        return
    for name, header in _TO_AGREE.items():
        value = found.get(name)
        if value is None and header == "channels" and not expected[header]:
            continue
        if value is None or len(value) != 1 or value[0] % 65536 != expected[header]:
            yield f"{':'.join(name)} is {value}, its header has {expected[header]} {header}"
    counts = {name: len(value) for name, value in found.items() if name[0] in ("POINT", "ANALOG")}
    for name in (("ANALOG", "SCALE"), ("ANALOG", "OFFSET")):
        if expected["channels"] and counts.get(name, 0) < min(expected["channels"], 255):
            yield f"{':'.join(name)} has {counts.get(name, 0)} values for {expected['channels']} channels"


def _records(section: bytes) -> Iterator[tuple[tuple[str, str], tuple]]:
    """Parameters by group and name.

    Raises:
        ValueError, IndexError, struct.error: A record leaves the section, or is of no known form.
    """
    groups: dict[int, str] = {}
    named: list[tuple[int, str, tuple]] = []
    at = 4
    while at + 2 <= len(section):
        length, group = struct.unpack_from("<2b", section, at)
        if length == 0 or group == 0:
            break
        end = at + 2 + abs(length)
        name = section[at + 2 : end].decode("latin-1").strip().upper()
        if not name or any(ord(c) > _PLAIN or ord(c) < ord(" ") for c in name):
            raise ValueError(f"a name that is none at byte {at}")
        (step,) = struct.unpack_from("<H", section, end)
        if group < 0:
            stop = end + 3 + section[end + 2]
            if groups.setdefault(-group, name) != name:
                raise ValueError(f"two groups of number {-group}")
        else:
            values, stop = _values(section, end + 2)
            named.append((group, name, values))
        if stop > len(section) or (step and not stop - end <= step <= len(section) - end):
            raise ValueError(f"{name} leaves the section")
        if not step:
            break
        at = end + step
    yield from _grouped(groups, named)


def _grouped(groups: Mapping[int, str], named: list[tuple[int, str, tuple]]) -> Iterator[tuple[tuple[str, str], tuple]]:
    if not {group for group, *_ in named} <= groups.keys():
        raise ValueError("parameters without their group")
    twice = len(named) - len({(group, name) for group, name, _ in named})
    if twice:
        raise ValueError(f"{twice} parameters more than once")
    yield from (((groups[group], name), values) for group, name, values in named)


def _values(section: bytes, at: int) -> tuple[tuple, int]:
    """Values of a parameter whose type is at a byte, and where its record ends."""
    kind, n = struct.unpack_from("<bB", section, at)
    if kind not in _TYPES or n > _MOST_DIMENSIONS:
        raise ValueError(f"type {kind} with {n} dimensions at byte {at}")
    dimensions = section[at + 2 : at + 2 + n]
    if len(dimensions) < n:
        raise ValueError("cut off")
    begin, count = at + 2 + n, prod(dimensions)
    values = struct.unpack_from(f"<{count}{_TYPES[kind]}", section, begin)
    end = begin + count * abs(kind)
    return values, end + 1 + section[end]
