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
    versions,
)
from scenarios.steps.threads import one_blas_thread

__all__ = [
    "Progress",
    "RunResult",
    "calibrate",
    "evaluate",
    "evaluated",
    "load",
    "one_blas_thread",
    "options",
    "report",
    "run",
    "silent",
    "simulate",
    "versions",
]
