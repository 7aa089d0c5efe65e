"""Plots of results: each function takes data and an `ax`, draws and returns it; none reads a file or shows a window."""

from scenarios.plots.boxes import Sample, error_boxes
from scenarios.plots.forest import Interval, intervals
from scenarios.plots.frame_chain import FRAME_CHAIN, frame_chain
from scenarios.plots.histogram import z_histogram
from scenarios.plots.hysteresis import BACK, FORTH, Flank, hysteresis
from scenarios.plots.joint_chain import JOINT_CHAIN, joint_chain
from scenarios.plots.style import ESTIMATE, MISSED, NOMINAL, ORACLE, OTHER, TRUTH, drawing, figure, svg
from scenarios.plots.trace import Line, error_traces, measured_beside
from scenarios.plots.wheeled_base import WHEELED_BASE, wheeled_base

__all__ = [
    "BACK",
    "ESTIMATE",
    "FORTH",
    "FRAME_CHAIN",
    "JOINT_CHAIN",
    "MISSED",
    "NOMINAL",
    "ORACLE",
    "OTHER",
    "TRUTH",
    "WHEELED_BASE",
    "Flank",
    "Interval",
    "Line",
    "Sample",
    "drawing",
    "error_boxes",
    "error_traces",
    "figure",
    "frame_chain",
    "hysteresis",
    "intervals",
    "joint_chain",
    "measured_beside",
    "svg",
    "wheeled_base",
    "z_histogram",
]
