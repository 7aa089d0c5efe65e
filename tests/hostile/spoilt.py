"""A wrong campaign calibrated, and what its estimate is worth on the good one."""

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration import Estimate, calibrate, load
from calibration.errors import CalibrationError
from calibration.evaluation.evaluate import evaluate
from calibration.recording.dataset import Dataset
from calibration.verdict import Verdict
from tests.hostile.rows.campaign import Campaign
from tests.hostile.rows.wrong_data import STAGES, Mistake

ROW = "model_2"
_LEAST = 1.0  # [mm] an error that matters


@dataclass(frozen=True)
class Tried:
    """What became of a mistake.

    Attributes:
        name: Of it.
        calibrated: Whether the estimate may be used.
        messages: Its warnings and refusals, or those of the command.
        error: Of the hand on the good campaign's unseen trials, base measured [mm a component]; NaN where not usable.
        clean: The good campaign's own [mm].
    """

    name: str
    calibrated: bool
    messages: tuple[str, ...]
    error: float
    clean: float

    @property
    def silently_wrong(self) -> bool:
        """Called good without a word though it is worse than twice the clean one, and by more than a millimetre."""
        return self.calibrated and not self.messages and self.error > max(2.0 * self.clean, _LEAST)


def calibrated(dataset: Dataset, stages: tuple[str, ...] = STAGES) -> Estimate:
    """An estimate, of clocks, marker bodies and placements unless more stages are named."""
    return calibrate(dataset, stages)


def error_of(estimate: Estimate, good: Dataset) -> float:
    """Error of the hand on unseen swings, base measured, motor side [mm a component]."""
    rows = evaluate(estimate, good).rows
    found = (r for r in rows if (r.model, r.trials, r.base, r.encoder) == (ROW, "dynamic", "measured", "motor"))
    return float(next(found).metrics.position_rmse_component_mm)


def tried(mistake: Mistake, campaign: Campaign, good: Dataset, reference: tuple[float, frozenset], at: Path) -> Tried:
    """Calibrate a spoilt campaign; `reference` is the good one's error [mm] and its own warnings."""
    clean, known = reference
    logging.disable(logging.WARNING)
    try:
        dataset = load(mistake.spoil(campaign).written(at))
        estimate = calibrated(dataset, mistake.stages)
        messages = _bad(estimate.verdicts, known)
        if estimate.calibrated:
            messages += _bad(evaluate(estimate, dataset).verdicts, known)
    except CalibrationError as error:
        return Tried(mistake.name, False, (str(error),), np.nan, clean)
    finally:
        logging.disable(logging.NOTSET)
    error = error_of(estimate, good) if estimate.calibrated and not messages else np.nan
    return Tried(mistake.name, estimate.calibrated, messages, error, clean)


def _bad(verdicts: Iterable[Verdict], known: frozenset) -> tuple[str, ...]:
    """Warnings and refusals that are not those of the good campaign."""
    bad = (v.message for v in verdicts if v.verdict in ("warning", "refused"))
    return tuple(message for message in bad if message[:40] not in known)


def reference_of(good: Dataset) -> tuple[Campaign, tuple[float, frozenset]]:
    """The good campaign in memory, its error [mm] and the beginnings of its own warnings."""
    estimate = calibrated(good)
    messages = frozenset(v.message[:40] for v in estimate.verdicts if v.verdict in ("warning", "refused"))
    return Campaign.of(good, estimate.clock("robot").offset), (error_of(estimate, good), messages)
