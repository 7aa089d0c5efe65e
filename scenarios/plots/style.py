"""One look for all figures, and SVG text that is the same every time.

Measured black dots, nominal grey, estimate blue, truth dashed green. Text stays text, so that it can be read aloud and
searched; its width is computed with the widest of the usual fonts, so that no reader's font overlaps.
"""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.figure import Figure

NOMINAL = "#777777"
ESTIMATE = "#1a5fa8"
ORACLE = "#7fb0dd"
OTHER = "#b08a4a"
TRUTH = "#1b7f3b"
MISSED = "#c2410c"

_LOOK: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e2e4e8",
    "grid.linewidth": 0.6,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelcolor": "#222222",
    "ytick.labelcolor": "#222222",
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "figure.dpi": 72.0,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "svg.fonttype": "none",
}
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


@contextmanager
def drawing() -> Iterator[None]:
    """The look, for the time of a `with` block in which figures are made; no setting of the user's comes through."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_LOOK)
        yield


def figure(width: float, height: float) -> Figure:
    """An empty figure of a width and height [inch], without a window."""
    return Figure(figsize=(width, height))


def svg(drawn: Figure, name: str) -> str:
    """The figure as a standalone SVG; the same figure gives the same text, and `name` keeps its ids its own."""
    buffer = io.StringIO()
    with drawing():
        matplotlib.rcParams["svg.hashsalt"] = name
        drawn.savefig(buffer, format="svg", metadata=_NO_METADATA)
    text = re.sub(r"<!DOCTYPE.*?>\s*|<metadata>.*?</metadata>\s*", "", buffer.getvalue(), flags=re.DOTALL)
    text = re.sub(r'\b(id=")', rf"\g<1>{name}-", text)
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", text)
    return re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)
