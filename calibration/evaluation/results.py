"""The evaluation of an estimate: the ladder, the errors it is made of, its files.

evaluation.json            headline, rows, rows by trial, protocols, fit quality by regime, comparisons, verdicts
evaluation.nc              errors over time, one group a row and trial
predictions/<trial>.nc     see `predicted_trial`

The headline is the row that `Compensator` delivers with every instrument that was recorded, and beside it those of the
other models under the same choice:

    model      the main one of the estimate                        encoder    motor
    base       the plate, else inverse dynamics, else at rest      trials     dynamic, else static
    (measured where nothing else was scored, as of posture means)
"""

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from calibration.errors import NotEnoughData
from calibration.estimate.rows import row_of
from calibration.evaluation.budget import Budget
from calibration.evaluation.comparison import Comparison, comparisons
from calibration.evaluation.ladder import Row, TrialErrors, Trials, trial_entry
from calibration.evaluation.marker_errors import PointRow
from calibration.evaluation.protocols import protocol_rows
from calibration.prediction.predicted_trial import PredictedTrial
from calibration.recording import netcdf
from calibration.stages.joints.repetitions import RegimeQuality
from calibration.verdict import Verdict

STAGE = "evaluation"
_TRIALS: tuple[Trials, ...] = ("dynamic", "static")


@dataclass(frozen=True)
class Headline:
    """One figure of a dataset, and what it is to be compared with.

    Attributes:
        main: The row that is delivered.
        beside: The same of every other model, in the ladder's order.
    """

    main: Row
    beside: tuple[Row, ...]

    def entry(self) -> dict[str, Any]:
        """The fields `main` and `beside` of evaluation.json and score.json."""
        return {"main": self.main.entry(), "beside": [row.entry() for row in self.beside]}


def headline(rows: Sequence[Row], main: str) -> Headline | None:
    """The headline of rows against one reference, `main` the estimate's model; None where that was not scored."""
    for trials in _TRIALS:
        mine = [r for r in rows if r.trials == trials and r.encoder == "motor"]
        found = {model: _predictive(mine, model) for model in dict.fromkeys(r.model for r in mine)}
        delivered = found.pop(main, None)
        if delivered is not None:
            return Headline(delivered, tuple(row for row in found.values() if row is not None))
    return None


def _predictive(rows: Sequence[Row], model: str) -> Row | None:
    mine = {r.base: r for r in rows if r.model == model}
    base = row_of(model).predictive_base(mine)
    return next((mine[b] for b in (base, "submitted", "measured") if b in mine), None)


@dataclass(frozen=True)
class Evaluation:
    """The ladder, the errors it is made of, and what the joint models explain of each joint's discrepancy.

    Attributes:
        rows: The ladder.
        traces: Errors of every row in every trial.
        regimes: Fit quality of the joint models by motion regime.
        confirmation: The ladder of another session, its marker bodies registered again; empty where there is none.
        verdicts: Trials whose errors are not the model's.
        points: Single markers of trials that hold posture means.
        predicted: The predictions that were scored, trial by trial.
        main: The model that is delivered; empty where there is none.
        budget: What its error on moving trials consists of; None where it was not taken apart.
    """

    rows: tuple[Row, ...]
    traces: tuple[TrialErrors, ...]
    regimes: tuple[RegimeQuality, ...] = ()
    confirmation: tuple[Row, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    points: tuple[PointRow, ...] = ()
    predicted: tuple[PredictedTrial, ...] = ()
    main: str = ""
    budget: Budget | None = None

    @property
    def headline(self) -> Headline | None:
        """What `Compensator` delivers, against the motion capture; None where that was not scored."""
        return headline(self.rows, self.main)

    def row(self, model: str, trials: Trials = "dynamic", base: str = "fixed", encoder: str = "motor") -> Row:
        """One line.

        Raises:
            NotEnoughData: There is no such line.
        """
        wanted = (model, trials, base, encoder)
        for row in self.rows:
            if (row.model, row.trials, row.base, row.encoder) == wanted:
                return row
        raise NotEnoughData(f"no row {wanted}; there are {[(r.model, r.trials, r.base, r.encoder) for r in self.rows]}")

    def save(self, folder: Path | str) -> None:
        """Write evaluation.json and evaluation.nc into a folder, made where it is missing."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        part = folder / "evaluation.json.part"
        compared = tuple(comparisons(self.traces))
        content = {
            "schema": 1,
            **({} if self.headline is None else self.headline.entry()),
            "budget": None if self.budget is None else self.budget.entry(),
            "rows": [r.entry() for r in self.rows],
            "confirmation": [r.entry() | {"role": "confirmation"} for r in self.confirmation],
            "points": [asdict(p) for p in self.points],
            "trials": [trial_entry(t) for t in self.traces],
            "protocols": [asdict(r) for r in protocol_rows(self.traces, self.rows)],
            "regimes": [x.entry() for x in self.regimes],
            "verdicts": [asdict(v) for v in (*self.verdicts, *no_better(compared))],
            "comparisons": [asdict(c) for c in compared],
        }
        part.write_text(json.dumps(content, indent=1) + "\n", "utf-8")
        os.replace(part, folder / "evaluation.json")
        _write_traces(folder / "evaluation.nc", self.traces)

    def save_predictions(self, folder: Path | str) -> None:
        """Write predictions/<trial>.nc into a folder, made where it is missing."""
        made = Path(folder) / "predictions"
        made.mkdir(parents=True, exist_ok=True)
        for trial in self.predicted:
            trial.save(made)


def _write_traces(path: Path, traces: tuple[TrialErrors, ...]) -> None:
    """One group a row and trial: model/base/encoder/trial."""
    part = path.with_name(path.name + ".part")
    with netcdf.created(part) as file:
        file.title = "errors of predicted hand poses, predicted minus measured, lab axes"
        for trace in traces:
            group = file.createGroup(f"{trace.model}/{trace.base}/{trace.encoder}/{trace.trial_id}")
            group.kind = trace.kind
            netcdf.add_dimensions(group, {"t": len(trace.t), "scored": len(trace.scored), "axis": 3})
            for name, dims, units, data in (
                ("t", ("t",), "s", trace.t),
                ("position_error", ("t", "axis"), "m", trace.errors.position),
                ("rotation_error", ("t", "axis"), "rad", trace.errors.rotation),
                ("scored_position_error", ("scored", "axis"), "m", trace.scored.position),
                ("scored_rotation_error", ("scored", "axis"), "rad", trace.scored.rotation),
            ):
                kind = "f8" if name == "t" else "f4"
                netcdf.write_variable(group, name, data, dims, kind, {"units": units}, compressed=name == "t")
    os.replace(part, path)


def no_better(compared: Iterable[Comparison]) -> Iterator[Verdict]:
    """A warning for each row that is worse than the one it builds on, and why where that is known."""
    for c in compared:
        if c.finding == "worse":
            message = f"{c.b[0]} ({c.b[1]}) is worse than {c.a[0]} by {c.difference_mm:.2f} mm"
            yield Verdict(STAGE, "warning", message + (f": {c.reason}" if c.reason else ""))
