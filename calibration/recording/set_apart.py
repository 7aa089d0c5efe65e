"""The first static postures of a session set apart, for registering its marker bodies: nothing else is made of them."""

import json
from dataclasses import replace
from pathlib import Path

from calibration.errors import NotEnoughData
from calibration.recording.dataset import Dataset, load
from calibration.recording.posture_means import PostureMeans, write_means
from calibration.recording.schema import TrialEntry
from calibration.recording.trial import Trial, write_trial

REGISTRATION = "registration"
"""Motion of the trials that a session is registered with."""


def set_apart(folder: Path, n: int) -> Dataset:
    """The dataset, its first n static validation postures in trials of motion `registration`, role `confirmation`.

    Raises:
        NotEnoughData: There are not as many and one more.
    """
    dataset, entries, left = load(folder), list[TrialEntry](), n
    for entry in dataset.description.trials:
        if entry.role != "validation" or entry.kind != "static" or not left:
            entries.append(entry)
            continue
        recorded = dataset.read_means(entry) if dataset.has_means(entry) else dataset.read(entry)
        size = len(recorded) if isinstance(recorded, PostureMeans) else len(recorded.dwell_start)
        first = min(left, size)
        left -= first
        again = entry.model_copy(update={"id": f"{entry.id}_registration", "role": "confirmation"})
        again = again.model_copy(update={"motion": REGISTRATION, "file": f"trials/{again.id}.nc"})
        entries.append(_written(folder, again, recorded, slice(first)))
        if size > first:
            entries.append(_written(folder, entry, recorded, slice(first, None)))
        else:
            (folder / entry.file).unlink()
    if left or not any(e.role == "validation" for e in entries):
        raise NotEnoughData(f"{n} static postures to register with and something to predict: {n - left} are there")
    listed = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))
    listed["trials"] = [e.model_dump() for e in entries]
    (folder / "dataset.json").write_text(json.dumps(listed, indent=1) + "\n", encoding="utf-8")
    return load(folder)


def _written(folder: Path, entry: TrialEntry, recorded: Trial | PostureMeans, some: slice) -> TrialEntry:
    """The entry of a file with some of the postures."""
    path = folder / entry.file
    if isinstance(recorded, PostureMeans):
        digest = write_means(path, replace(recorded.rows(some), id=entry.id))
    else:
        dwells = {name: getattr(recorded, name)[some] for name in ("dwell_start", "dwell_stop", "approach")}
        digest = write_trial(path, replace(recorded, id=entry.id, **dwells))
    return entry.model_copy(update={"sha256": digest})
