"""The report of a run whose data do not allow a result: why, what was recorded, what to record."""

import os
from pathlib import Path

import calibration
from scenarios.report.page import environment, write_page
from scenarios.report.results.recordings import recorded
from scenarios.report.results.run_results import read_scenario

REASON = "refused.txt"
"""File of a run folder with the reasons, one a line."""


def write_refusal(run_dir: Path | str) -> None:
    """Write RUN/report.html from RUN/refused.txt and the dataset beside it.

    Raises:
        InputError: The dataset cannot be read.
    """
    run = Path(run_dir)
    dataset = calibration.load(run / "dataset")
    estimate = run / "estimate"
    values = {
        "reasons": (run / REASON).read_text(encoding="utf-8").splitlines(),
        "scenario": read_scenario(run / "scenario.yaml"),
        "trials": [recorded(run / "dataset" / entry.file, entry) for entry in dataset.description.trials],
        "verdicts": calibration.load_estimate(estimate).verdicts if (estimate / "estimate.json").is_file() else (),
        "has_plan": os.path.isfile(estimate / "record_next.yaml"),
    }
    style = (Path(__file__).parent / "report.css").read_text(encoding="utf-8")
    write_page(run, environment().get_template("refusal.html").render(**values, style=style))
