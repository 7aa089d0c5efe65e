"""Campaigns described in a file: simulate, calibrate, evaluate, report."""

from scenarios.steps import RunResult, load, run

__all__ = ["RunResult", "load", "run"]
