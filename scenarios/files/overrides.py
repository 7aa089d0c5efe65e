"""A value given beside a file, `path.to.field=value`: on the command line, or in a file that extends it.

The place of a value in a YAML file.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq


@dataclass(frozen=True)
class Override:
    """A value and where it goes.

    Attributes:
        path: Field names, and positions in lists, joined by dots.
        value: What to put there.
        file: Name of its file; empty: it is from the command line.
        tree: The mapping of that file that holds it, `path` its key there, with the line and column of every value.
    """

    path: str
    value: Any
    file: str = ""
    tree: CommentedMap = field(default_factory=CommentedMap, repr=False)

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

    def holds(self, path: tuple[str, ...]) -> bool:
        """Whether the value at `path` is this one or a part of it."""
        return path[: len(self.keys)] == self.keys

    def where(self, path: Sequence[str], of_key: bool = True) -> tuple[int, int, str]:
        """Line and column, from 0, of what is wrong at `path`, or of its name, and where that is in words."""
        if not self.file:
            return 0, 0, "--set "
        line, column, _ = place(self.tree, (self.path, *path[len(self.keys) :]), of_key)
        return line, column, f"{self.file}:{line + 1}:{column + 1}: "


def explaining(overrides: Sequence[Override], path: tuple[str, ...], in_file: bool) -> int | None:
    """Which override a finding at `path` is about: the last that holds it, or the first that brought its name in."""
    holding = [k for k, override in enumerate(overrides) if override.holds(path)]
    if holding:
        return holding[-1]
    under = (k for k, override in enumerate(overrides) if not in_file and path == override.keys[: len(path)])
    return next(under, None)


def place(tree: CommentedMap, path: Sequence[str], of_key: bool) -> tuple[int, int, bool]:
    """Return line and column, from 0, of the last part of `path` the file holds, and whether it holds all.

    Args:
        tree: The file, or a mapping in it, as loaded.
        path: Keys, and positions in lists, from there on.
        of_key: The place of the key, not of its value.
    """
    node: Any = tree
    line, column = 0, 0
    for step in path:
        if isinstance(node, CommentedSeq) and step.isdecimal() and int(step) < len(node):
            line, column = node.lc.item(int(step))
            node = node[int(step)]
        elif isinstance(node, CommentedMap) and (key := next((k for k in node if str(k) == step), None)) is not None:
            if key in (node.lc.data or {}):  # a merged key (`<<`) has no place of its own
                line, column = node.lc.key(key) if of_key or node[key] is None else node.lc.value(key)
            node = node[key]
        else:
            return line, column, False
    return line, column, True
