"""Copies of a dataset folder with something changed."""

import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from calibration.recording.trial import Trial, read_trial, write_trial

Change = Callable[[Trial], Trial]


def rewritten(folder: Path, copy: Path, changes: Mapping[str, Change]) -> Path:
    """A copy in which the named trials went through a function, their checksums renewed."""
    shutil.copytree(folder, copy)
    listed = json.loads((copy / "dataset.json").read_text())
    for entry in listed["trials"]:
        if entry["id"] in changes:
            path = copy / entry["file"]
            entry["sha256"] = write_trial(path, changes[entry["id"]](read_trial(path)))
    (copy / "dataset.json").write_text(json.dumps(listed))
    return copy
