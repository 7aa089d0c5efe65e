"""A calibration of one's own against robots whose errors are known: `python -m pytest` in this folder."""

import json

import pytest

from calibration import calibrate


@pytest.fixture(scope="module")
def run(twin_run):
    return twin_run("short", seed=3)


@pytest.fixture(scope="module")
def mine(run, tmp_path_factory):
    return run.evaluate(calibrate(run.dataset, tmp_path_factory.mktemp("mine")))


def test_it_predicts_better_than_the_datasheet(mine, assert_improves):
    assert_improves(mine, by=0.5)


def test_it_predicts_unseen_motion_within_the_limit_of_the_task(mine, assert_within):
    assert_within(mine, mm=10.0, deg=2.0)


def test_the_reference_calibration_is_better_still(run, mine, assert_within):
    assert_within(run, mm=mine.row()["position_rmse_norm_mm"])


def test_it_reads_nothing_but_the_dataset(run):
    assert run.truth.is_dir() and run.truth not in run.dataset.parents
    assert "truth" not in json.dumps(json.loads((run.dataset / "dataset.json").read_text()))
