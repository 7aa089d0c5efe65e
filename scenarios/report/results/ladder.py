"""The ladder: rows in one order, each with its inputs, against the motion capture and against the truth."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from calibration.estimate import SOURCES
from calibration.prediction import BASELINE, LADDER, NOMINAL
from scenarios.report.results.result_files import Row
from scenarios.report.results.run_results import Results

FLOOR = "floor"
MEANINGS = {row.name: row.meaning for row in LADDER} | {
    FLOOR: "true parameters and joint angles, base measured by its markers: what the instruments alone cost"
}
BASES = {
    "fixed": "base assumed fixed",
    "plate": "base from the force plate",
    "dynamics": "base from inverse dynamics",
    "measured": "base measured",
    "submitted": "as submitted",
}
_MODELS, _BASES, _ENCODERS = tuple(MEANINGS), tuple(BASES), ("motor", "link")
_PREDICTIVE = (*SOURCES, "submitted")


@dataclass(frozen=True)
class Step:
    """One row of the ladder.

    Attributes:
        model: Its model.
        base: Where the base's motion comes from.
        encoder: Which side of the gear was read.
        trials: `dynamic`, `static` or `all`.
        mocap: Its error against the motion capture.
        truth: Its error against the truth.
    """

    model: str
    base: str
    encoder: str
    trials: str
    mocap: Row | None
    truth: Row | None

    @property
    def kind(self) -> str:
        """`predictive`, what it was given beyond that, or `floor`."""
        if self.model == FLOOR:
            return FLOOR
        given = {"base": self.base == "measured", "encoder": self.encoder == "link"}
        oracles = [name for name, is_given in given.items() if is_given]
        return f"oracle: {' and '.join(oracles)}" if oracles else "predictive"

    @property
    def label(self) -> str:
        """A short name for a figure."""
        return f"{self.model}, {self.base}" + ("" if self.encoder == "motor" else f", {self.encoder}")

    @property
    def main(self) -> Row:
        """Its error against the motion capture, or against the truth where that is all there is."""
        return next(row for row in (self.mocap, self.truth) if row is not None)


def ladder(results: Results, trials: str) -> tuple[Step, ...]:
    """Rows of a kind of trial, in order; models that are not known come after the known ones, before the floor."""
    mocap = {row.key: row for row in results.evaluation.rows}
    truth = {row.key: row for row in results.score.rows} if results.score else {}
    keys = [key for key in dict.fromkeys((*mocap, *truth)) if key[3] == trials]
    return tuple(Step(*key, mocap.get(key), truth.get(key)) for key in sorted(keys, key=_position))


def _position(key: tuple[str, str, str, str]) -> tuple[int, int, int]:
    model, base, encoder, _ = key
    place = len(_MODELS) if model == FLOOR else _index(_MODELS[:-1], model)
    return place, _index(_BASES, base), _index(_ENCODERS, encoder)


def _index(known: Sequence[str], name: str) -> int:
    return known.index(name) if name in known else len(known)


def best_of_each(steps: Iterable[Step]) -> tuple[Step, ...]:
    """One predictive row a model, in the order of the ladder; with the base measured where no row is predictive."""
    steps = tuple(steps)
    models = [model for model in dict.fromkeys(s.model for s in steps) if model != FLOOR]
    found = [step for model in models if (step := predictive(steps, model)) is not None]
    return tuple(found or [step for model in models if (step := oracle_base(steps, model)) is not None])


def readable(steps: Sequence[Step]) -> tuple[Step, ...]:
    """The rows of a boxplot: every prediction, and of the oracles the ones with the base measured."""
    return tuple(s for s in steps if s.encoder == "motor" or s.base == "measured")


def predictive(steps: Iterable[Step], model: str) -> Step | None:
    """The row of a model that reads motor encoders and no measured base.

    The base's motion from the plate where one was recorded, as `Compensator` takes it; else from dynamics, else none.
    """
    return _first(steps, model, _PREDICTIVE)


def oracle_base(steps: Iterable[Step], model: str) -> Step | None:
    """The row of a model with motor encoders and the measured base."""
    return _first(steps, model, ("measured",))


def floor(steps: Iterable[Step]) -> Row | None:
    """The error of the instruments alone."""
    return next((s.main for s in steps if s.model == FLOOR), None)


def _first(steps: Iterable[Step], model: str, bases: Sequence[str]) -> Step | None:
    mine = {s.base: s for s in steps if s.model == model and s.encoder == "motor"}
    return next((mine[base] for base in bases if base in mine), None)


def headline_model(results: Results, steps: Sequence[Step]) -> str:
    """The model the report is about: the one that is delivered, else the last estimated one of the ladder."""
    main = results.evaluation.main.model if results.evaluation.main else ""
    main = main or (results.estimate.main if results.estimate else "")
    if main in {s.model for s in steps}:
        return main
    known = [s.model for s in steps if s.model not in (NOMINAL, BASELINE, FLOOR)]
    return known[-1] if known else steps[-1].model
