"""How often a held-out trial is read and predicted by evaluate, score and report together."""

import shutil
from collections import Counter

import pytest

from calibration.recording import dataset as datasets
from calibration.stages.joints import separable_fit
from calibration.stages.suspension import base_response
from scenarios import steps


@pytest.fixture(scope="module")
def folder(quick_run):
    return quick_run.folder


def counted(monkeypatch, counts, module, name, key):
    original = getattr(module, name)

    def count(*given, **named):
        counts[name, key(*given)] += 1
        return original(*given, **named)

    monkeypatch.setattr(module, name, count)


def test_a_held_out_trial_is_read_once_and_its_wrench_computed_once(folder, tmp_path, monkeypatch, undrawn):
    copy = shutil.copytree(folder, tmp_path / "copy")
    counts = Counter()
    counted(monkeypatch, counts, datasets, "read_trial", lambda path, *_: path.stem)
    counted(monkeypatch, counts, base_response.WrenchSources, "dynamics_load", lambda lab, trial, *_: trial.id)
    monkeypatch.setattr(separable_fit, "project", None)  # evaluate fits nothing
    steps.evaluate(copy / "estimate", copy / "dataset", copy, copy / "truth")
    steps.report(copy)
    held_out = ("postures_validation", "xyz", "xyz_mirror")
    assert counts == {(name, trial): 1 for name in ("read_trial", "dynamics_load") for trial in held_out}
    for name in ("evaluation.json", "score.json", "predictions/xyz.nc"):
        assert (copy / name).read_bytes() == (folder / name).read_bytes()
