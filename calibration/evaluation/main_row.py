"""The headline of an evaluation: the row that `Compensator` delivers with every instrument that was recorded.

    model      the main one of the estimate                        encoder    motor
    base       the plate, else inverse dynamics, else still        trials     dynamic, else static
    (measured where nothing else was scored, as of posture means)

Beside it the rows of the other models under the same choice.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from calibration.estimate.rows import row_of
from calibration.evaluation.ladder import Row, Trials

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
