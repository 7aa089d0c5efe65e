"""Plots of results: each function takes data and an `ax`, draws and returns it; none reads a file or shows a window."""

from scenarios.plots.boxes import Sample, error_boxes
from scenarios.plots.forest import Interval, intervals
from scenarios.plots.histogram import z_histogram
from scenarios.plots.style import ESTIMATE, MISSED, NOMINAL, ORACLE, OTHER, TRUTH, drawing, figure, svg
from scenarios.plots.trace import Line, error_traces

__all__ = [
    "ESTIMATE",
    "MISSED",
    "NOMINAL",
    "ORACLE",
    "OTHER",
    "TRUTH",
    "Interval",
    "Line",
    "Sample",
    "drawing",
    "error_boxes",
    "error_traces",
    "figure",
    "intervals",
    "svg",
    "z_histogram",
]
