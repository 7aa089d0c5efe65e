"""A run of a study: a robot simulated, calibrated and judged by its truth; the recordings are not kept."""

import shutil
from pathlib import Path

from calibration.prediction import BASELINE
from scenarios.datasets.run_spec import Magnitude
from scenarios.files.scenario import Scenario

BETTER = (BASELINE, "model_2")
"""Rows whose order a study of power detects."""


def judged(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """Write evaluation.json and score.json of one robot; measured base, motor encoders, dynamic trials in the figures.

    Raises:
        CalibrationError: There is no result that may be used.
    """
    import calibration
    import twin
    from calibration.evaluation import compare
    from scenarios.score.score import score

    work = out / "work"
    twin.record(scenario.twin, scenario.seed, work, threads=1)
    dataset = calibration.load(work / "dataset")
    estimate = calibration.calibrate(dataset)
    evaluation = calibration.evaluate(estimate, dataset)
    scored = score(estimate, evaluation, work / "truth")
    evaluation.save(out)
    (out / "evaluation.nc").unlink(missing_ok=True)
    scored.save(out)
    shutil.rmtree(work)
    a, b = ((name, "measured") for name in BETTER)
    found = compare(evaluation.traces, a, b)
    rmse = (
        Magnitude(f"{row.model}_mm", row.metrics.position_rmse_component_mm)
        for row in scored.rows
        if (row.trials, row.base) == ("dynamic", "measured") and (row.encoder == "motor" or row.model == "floor")
    )
    return (
        Magnitude("coverage_95", scored.coverage_95),
        Magnitude("n_judged", float(scored.n_judged)),
        Magnitude("nees_per_dof", scored.nees / scored.dof),
        *rmse,
        Magnitude("difference_mm", found.difference_mm),
        Magnitude("detected", float(found.finding == "better")),
    )
