"""From laboratory files or a dataset to everything that can be computed from them, in one folder.

mapping.yaml -> dataset/ -> estimate/, report.html; evaluation.json where validation trials were recorded
"""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.files import output_folder as folder
from scenarios.steps import run_steps
from scenarios.steps.import_export import import_files
from scenarios.steps.run_steps import Progress, silent
from scenarios.steps.threads import one_blas_thread

if TYPE_CHECKING:
    from calibration import Estimate

PROCESSED = replace(folder.RUN, name="processed", marker="dataset")


@dataclass(frozen=True)
class Processed:
    """What was made.

    Attributes:
        estimate: What the calibration found.
        evaluated: Whether trials were kept aside, so that there is an evaluation.
        notes: What was recognised in the files.
    """

    estimate: "Estimate"
    evaluated: bool
    notes: tuple[str, ...]


def process(source: Path, out: Path, progress: Progress = silent) -> Processed:
    """Import (where `source` is a mapping file), calibrate, evaluate and report into the folder `out`.

    Raises:
        ScenarioError: `out` must not be overwritten, or the mapping is malformed.
        InputError: A file is not what the mapping says, or the dataset cannot be read.
        CalibrationError: The dataset does not allow a result.
    """
    from calibration import load

    notes: tuple[str, ...] = ()
    with folder.replacing(out, PROCESSED) as new, one_blas_thread():
        dataset = new / "dataset"
        if source.is_dir():
            load(source)
            shutil.copytree(source, dataset)
        else:
            notes = import_files(None, (), source, dataset, progress=progress)
        estimate = run_steps.calibrate(dataset, new / "estimate", progress=progress)
        evaluated = estimate.calibrated and bool(load(dataset).entries("validation"))
        if evaluated:
            run_steps.evaluate(new / "estimate", dataset, new, progress=progress)
        run_steps.report(new, progress)
    return Processed(estimate, evaluated, notes)
