"""The report of a run: one HTML file, from saved results alone."""

from scenarios.report.page import write

__all__ = ["write"]
