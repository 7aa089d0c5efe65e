"""Dwells of static trials: those the mapping or the file states, else the rests of readings and markers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.errors import InputError, InputErrors
from calibration.formats.mapping.channels import Recorded
from calibration.formats.mapping.mapping import MappedTrial, MappingFile
from calibration.formats.mapping.rests import LEAST, rests_of_trials


def with_rests(mapping: MappingFile, trials: Sequence[Recorded]) -> list[Recorded]:
    """The trials of a mapping, static ones with their dwells.

    Raises:
        InputError: A static trial shows no rest; all such trials.
    """
    content = mapping.content
    missing = [_has_to_be_found(t, r) for t, r in zip(content.trials, trials, strict=True)]
    if not any(missing):
        return list(trials)
    together = {name for r in trials for name in r.together} | set(content.setup.mocap_clock)
    found = rests_of_trials(trials, [b.marker_names for b in content.bodies], "robot" in together)
    empty = [
        InputError(r.file, _refusal(t.id))
        for t, r, rests, absent in zip(content.trials, trials, found, missing, strict=True)
        if absent and not len(rests)
    ]
    if empty:
        raise InputErrors(empty)
    rows = zip(content.trials, trials, found, missing, strict=True)
    return [_with(t, r, rests) if absent else r for t, r, rests, absent in rows]


def _has_to_be_found(trial: MappedTrial, recorded: Recorded) -> bool:
    stated = trial.dwells is not None or recorded.dwells is not None
    return trial.kind == "static" and not stated and recorded.means is None and recorded.markers is not None


def _refusal(trial: str) -> str:
    return (
        f"trial {trial} is declared static, and neither readings nor markers rest for {LEAST:g} s between two motions; "
        "record postures of 2 s each, state `dwells: [[start, stop], ...]` [s, markers' clock], or declare its kind"
    )


def _with(trial: MappedTrial, recorded: Recorded, rests: np.ndarray) -> Recorded:
    length = rests[:, 1] - rests[:, 0]
    note = f"{trial.id}: {len(rests)} rests of {length.min():.1f}-{length.max():.1f} s found; `dwells` overrides them"
    return replace(recorded, dwells=rests, notes=(*recorded.notes, note))
