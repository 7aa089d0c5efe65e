"""Every mistake of a laboratory in the tables tried, counted for docs/reliability.md."""

import logging
import shutil
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from calibration import load
from calibration.checks import judged
from calibration.mocap import relabelled_trials
from calibration.robot.laboratory import Laboratory
from tests.doubles import rigid_robot
from tests.hostile.rows.campaign import Campaign
from tests.hostile.rows.laboratory_kinds import FITTED, KINDS, PLATE, UNSEEN
from tests.hostile.rows.wrong_data import FAST, TABLE, VALIDATION, Mistake
from tests.hostile.spoilt import Tried, reference_of, tried

COLUMNS = ("mistakes", "rows", "named", "harmless, kept", "silently wrong", "good data lost", "named otherwise",
           "largest error of the kept [x clean]")  # fmt: skip
SEED = 5
IN_RECORDINGS, IN_CALIBRATION, IN_VALIDATION = (*FAST, *KINDS), (*TABLE, *PLATE, *FITTED), (*VALIDATION, *UNSEEN)


def found_in(folder: Path) -> list[str]:
    """What is found in calibration recordings before anything is fitted."""
    dataset = load(folder)
    trials = [trial for _, trial in relabelled_trials(dataset, "calibration")]
    return [v.message for v in judged(Laboratory(dataset.urdf, dataset.description), trials, calibrated=True)]


def rigid(folder: Path) -> Campaign:
    """A campaign of a robot without physics."""
    truth = rigid_robot.defects(1)
    return Campaign.of(load(rigid_robot.campaign(folder, truth, n_postures=6)), truth.robot[0])


def twin(folder: Path):
    """A short campaign, its data in memory, and its reference."""
    from scenarios.steps import run_steps

    run_steps.simulate(run_steps.load("short", [f"seed={SEED}"]).quick(), folder)
    good = load(folder / "dataset")
    return good, *reference_of(good)


def fault(mistake: Mistake, found: Tried) -> str:
    """What is wrong with the outcome of a row; empty where it is as the row says."""
    if mistake.says:
        named = any(words in message for message in found.messages for words in mistake.says.split("|"))
        return "" if named else "silently wrong" if found.silently_wrong or not found.messages else "named otherwise"
    return "" if found.calibrated and found.error < mistake.worst * found.clean else "good data lost"


def _in_recordings(campaign: Campaign, mistake: Mistake, at: Path) -> Tried:
    return Tried(mistake.name, False, tuple(found_in(mistake.spoil(campaign).written(at))), np.nan, np.nan)


def rows(place: Path) -> Iterator[list[str | int]]:
    """A line for each table; what is not as its row says is printed."""
    logging.disable(logging.WARNING)
    good, campaign, reference = twin(place / "run")
    fitted = partial(tried, campaign=campaign, good=good, reference=reference)
    seen = partial(_in_recordings, rigid(place / "rigid"))
    yield _row("seen in the recordings", IN_RECORDINGS, lambda m, at: seen(m, at), place / "at")
    yield _row("seen by a calibration", IN_CALIBRATION, lambda m, at: fitted(m, at=at), place / "at")
    yield _row("of validation recordings", IN_VALIDATION, lambda m, at: fitted(m, at=at), place / "at")


def _row(name: str, mistakes: Sequence[Mistake], outcome: Callable[[Mistake, Path], Tried], at: Path) -> list:
    faults, kept = [], []
    for mistake in mistakes:
        found = outcome(mistake, at)
        shutil.rmtree(at, ignore_errors=True)
        faults.append(fault(mistake, found))
        if faults[-1]:
            print(f"{name}: {mistake.name}: {faults[-1]}: {found}", flush=True)
        elif not mistake.says:
            kept.append(found.error / found.clean)
    counts = [faults.count(what) for what in COLUMNS[4:7]]
    harmless = sum(not m.says for m in mistakes) - counts[1]
    largest = f"{max(kept):.2f}" if kept else ""
    return [name, len(mistakes), len(mistakes) - harmless - sum(counts), harmless, *counts, largest]
