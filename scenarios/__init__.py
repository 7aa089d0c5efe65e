"""Campaigns described in a file: simulate, calibrate, evaluate, report."""

from scenarios.steps.run import RunResult, load, run

__all__ = ["RunResult", "load", "run"]
