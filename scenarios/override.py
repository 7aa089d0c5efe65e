"""A value given beside the file, `path.to.field=value`."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Override:
    """A value and where it goes.

    Attributes:
        path: Field names, and positions in lists, joined by dots.
        value: What to put there.
    """

    path: str
    value: Any

    @property
    def keys(self) -> tuple[str, ...]:
        """The path as the names and positions it is made of."""
        return tuple(self.path.split("."))

    def apply(self, values: dict[str, Any]) -> str | None:
        """Put the value into `values`, in place; return what is wrong with the path, if anything.

        A name that is not there yet is put there: the validation, which knows all names, judges it.
        """
        node: Any = values
        for depth, key in enumerate(self.keys):
            place: str | int = key
            if isinstance(node, list):
                if not key.isdecimal() or int(key) >= len(node):
                    return f"{key!r} is not a position, counted from 0, in a list of {len(node)}"
                place = int(key)
            elif not isinstance(node, dict):
                return f"{'.'.join(self.keys[:depth])} is a single value, it has no field {key!r}"
            if depth == len(self.keys) - 1:
                node[place] = self.value
            elif isinstance(place, str):
                node = node.setdefault(place, {})
            else:
                node = node[place]
        return None

    def explains(self, path: tuple[str, ...], in_file: bool) -> bool:
        """Whether a finding at `path` is about this override: at or under its value, or a name it brought in."""
        above = path == self.keys[: len(path)] and not in_file
        return above or path[: len(self.keys)] == self.keys
