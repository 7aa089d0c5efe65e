"""Where in a YAML file a value stands."""

from collections.abc import Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq


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
