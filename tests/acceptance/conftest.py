"""A run of the default scenario that several files of claims look at."""

import json
from collections import Counter
from contextlib import contextmanager

import pytest

from calibration.recording import dataset as datasets
from calibration.recording.trial import sha256
from calibration.stages.joints import separable_fit
from calibration.stages.suspension import base_response
from scenarios import load, run
from scenarios.steps import run_steps
from tests.doubles.made_once import made_once


@contextmanager
def held_out_unreadable(dataset):
    """No trial but those for calibration is a recording."""
    path = dataset / "dataset.json"
    declared = path.read_bytes()
    content = json.loads(declared)
    others = [trial for trial in content["trials"] if trial["role"] != "calibration"]
    kept = {dataset / trial["file"]: (dataset / trial["file"]).read_bytes() for trial in others}
    for trial in others:
        (dataset / trial["file"]).write_bytes(b"not a recording")
        trial["sha256"] = sha256(dataset / trial["file"])
    path.write_text(json.dumps(content))
    yield
    for file, recording in {**kept, path: declared}.items():
        file.write_bytes(recording)


def counted(patch, counts, holder, name, key):
    original = getattr(holder, name)

    def count(*given, **named):
        counts[name, key(*given)] += 1
        return original(*given, **named)

    patch.setattr(holder, name, count)


def watched(folder):
    """The run, calibrated while its held-out trials are unreadable, and what the steps after that read and predict."""
    calibrate, counts, patch = run_steps._calibrate, Counter(), pytest.MonkeyPatch()

    def alone(dataset, *given, **named):
        with held_out_unreadable(dataset):
            estimate = calibrate(dataset, *given, **named)
        counted(patch, counts, datasets, "read_trial", lambda path, *_: path.stem)
        counted(patch, counts, base_response.WrenchSources, "dynamics_load", lambda lab, trial, *_: trial.id)
        patch.setattr(separable_fit, "project", None)  # nothing is fitted any more
        return estimate

    with patch.context() as patch:
        patch.setattr(run_steps, "_calibrate", alone)
        return run(load("humanoids2024"), folder, quick=True), counts


@pytest.fixture(scope="session")
def watched_run(tmp_path_factory, worker_id):
    return made_once(tmp_path_factory, worker_id, "quick_run", watched)


@pytest.fixture(scope="session")
def quick_run(watched_run):
    """The short variant of the default scenario, whole."""
    return watched_run[0]
