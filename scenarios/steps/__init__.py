"""The steps of a campaign as functions; importing them is cheap, the engines load with the first step that runs."""

from scenarios.steps.run_steps import (
    Progress,
    RunResult,
    calibrate,
    evaluate,
    evaluated,
    load,
    options,
    report,
    run,
    silent,
    simulate,
)
from scenarios.steps.versions import versions

__all__ = [
    "Progress",
    "RunResult",
    "calibrate",
    "evaluate",
    "evaluated",
    "load",
    "options",
    "report",
    "run",
    "silent",
    "simulate",
    "versions",
]
