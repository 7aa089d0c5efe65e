"""The report of a run: one HTML file, from saved results alone."""

from scenarios.report.page import write
from scenarios.report.refusal import REASON, write_refusal

__all__ = ["REASON", "write", "write_refusal"]
