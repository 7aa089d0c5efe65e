"""The base's motion on a force plate, from base markers and plate alone: fitted to one part, predicted in the rest.

OUT/dataset (where files were given), base_motion.json (forms, parameters, scores), base_motion.csv (measured, predicted
and 95 % band)
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios.files import output_folder as folder
from scenarios.steps.import_export import import_files
from scenarios.steps.run_steps import Progress, silent
from scenarios.steps.threads import one_blas_thread

if TYPE_CHECKING:
    from calibration.recording import Dataset, Trial
    from calibration.stages.hysteretic_base import BaseLog, HystereticBase, MotionScore

NAME = "base_motion"
KIND = folder.Kind("base motion", f"{NAME}.json", frozenset({"dataset", f"{NAME}.json", f"{NAME}.csv"}))
_AXES = ("x", "y", "z", "rx", "ry", "rz")
_TWO_SIDED = 1.96


@dataclass(frozen=True)
class Cycles:
    """Steady cycles, each predicted by a fit to all else.

    Attributes:
        start: Of the first [s since the log's start].
        period: Of each [s].
    """

    start: float
    period: float


@dataclass(frozen=True)
class BaseMotionFound:
    """What was found.

    Attributes:
        base: Fitted to the first part.
        scores: By name: `fitted`, `predicted` where the log goes on, `left-out cycles` where there are some.
        notes: What was recognised in the files.
    """

    base: "HystereticBase"
    scores: dict[str, "MotionScore"]
    notes: tuple[str, ...]


def base_motion(
    sources: Sequence[Path], mapping: Path | None, out: Path, until: float | None = None, cycles: Cycles | None = None,
    progress: Progress = silent,
) -> BaseMotionFound:  # fmt: skip
    """Fit the base to a log up to `until` [s since its start], predict the rest, and score both.

    Args:
        sources: A dataset folder, or the log's files.
        mapping: Of files; None with a dataset.
        out: The folder to write.
        until: End of the fit; the log's end unless given.
        cycles: Steady cycles to leave out in turn.
        progress: Called with what is fitted.

    Raises:
        ScenarioError: `out` must not be overwritten, or the mapping is malformed.
        InputError: A file is not what the mapping says.
        CalibrationError: The log is too short, has gaps, or moves too little.
    """
    from calibration.recording import load
    from calibration.robot import Laboratory
    from calibration.stages.hysteretic_base import fit_base, left_out_cycles, log_of, score

    notes: tuple[str, ...] = ()
    with folder.replacing(out, KIND) as new, one_blas_thread():
        new.mkdir(exist_ok=True)
        if mapping is not None:
            notes = import_files(None, sources, mapping, new / "dataset", progress=progress)
        dataset = load(sources[0] if mapping is None else new / "dataset")
        log = log_of(Laboratory(dataset.urdf, dataset.description), _continuous(dataset))
        used = log.t < (log.t[-1] + 1.0 if until is None else until)
        parts = 1 + (0 if cycles is None else 2)
        progress("base", "fit", 0.0)
        base = fit_base(log, used)
        scores = {"fitted": score(base, log, used)}
        if not used.all():
            scores["predicted"] = score(base, log, ~used)
        if cycles is not None:
            progress("base", "fit of the whole log", 1 / parts)
            whole = base if used.all() else fit_base(log, np.ones(len(log.t), dtype=bool))
            progress("base", "left-out cycles", 2 / parts)
            scores["left-out cycles"] = left_out_cycles(whole, log, cycles.start, cycles.period)
        _write(new, log, used, base, scores)
    return BaseMotionFound(base, scores, notes)


def _continuous(dataset: "Dataset") -> list["Trial"]:
    moving = (e for e in dataset.description.trials if e.kind != "static" and not dataset.has_means(e))
    return [dataset.read(e) for e in moving]


def _write(
    new: Path, log: "BaseLog", used: np.ndarray, base: "HystereticBase", scores: dict[str, "MotionScore"]
) -> None:
    x, sigma = base.displacement(log.w), np.sqrt(base.variance)
    found = {
        "fitted_until_s": float(log.t[used][-1]),
        "forms": dict(zip(_AXES, base.forms, strict=True)),
        "left_out_rms": dict(zip(_AXES, base.left_out, strict=True)),
        "axes": {a: asdict(axis) for a, axis in zip(_AXES, base.axes, strict=True)},
        "scores": {name: asdict(one) for name, one in scores.items()},
    }
    (new / f"{NAME}.json").write_text(json.dumps(found, indent=1, default=np.ndarray.tolist) + "\n", encoding="utf-8")
    with (new / f"{NAME}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["t", *(f"{a}_{what}" for what in ("measured", "predicted", "band_95") for a in _AXES)])
        band = np.broadcast_to(_TWO_SIDED * sigma, x.shape)
        writer.writerows(np.column_stack([log.t, log.x, x, band]).round(9).tolist())
