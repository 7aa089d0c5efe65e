"""Cells of a table with the heading of their column, which a narrow screen shows beside them.

On a phone a row is a block of labelled figures: nothing is cut, nothing is scrolled sideways.
"""

import re
from collections.abc import Iterator

_TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
_ROW = re.compile(r"<tr\b.*?</tr>", re.DOTALL)
_CELL = re.compile(r"<(t[hd])\b([^>]*)>(.*?)(?=</\1>)", re.DOTALL)
_SPAN = re.compile(r'colspan="(\d+)"')


def labelled(page: str) -> str:
    """The page with `data-label` on every cell of the body of its tables."""
    return _TABLE.sub(lambda table: _labelled(table[0]), page)


def _labelled(table: str) -> str:
    head, mark, body = table.partition("<tbody>")
    columns = [list(_headings(row)) for row in _ROW.findall(head)]
    names = [" ".join(filter(None, parts)) for parts in zip(*columns, strict=True)]
    return head + mark + _ROW.sub(lambda row: _cells(row[0], names), body)


def _headings(row: str) -> Iterator[str]:
    """The text of a row of headings, once for each column below it."""
    for _, attributes, text in _CELL.findall(row):
        span = _SPAN.search(attributes)
        plain = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", text)).strip().replace('"', "&quot;")
        yield from [plain] * (int(span[1]) if span else 1)


def _cells(row: str, names: list[str]) -> str:
    names_left = iter(names)

    def named(cell: re.Match[str]) -> str:
        name = next(names_left, "")
        return f'<td data-label="{name}"{cell[2]}>{cell[3]}' if cell[1] == "td" else cell[0]

    return _CELL.sub(named, row)
