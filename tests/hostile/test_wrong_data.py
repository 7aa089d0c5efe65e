"""Mistakes of a laboratory are named, good data are kept."""

import numpy as np
import pytest

from calibration import load
from calibration.checks import judged
from calibration.mocap import relabelled_trials
from calibration.robot.laboratory import Laboratory
from tests.hostile import hidden_markers, random_cases, tried_mistakes
from tests.hostile.rows.campaign import hidden, scaled
from tests.hostile.rows.laboratory_kinds import KINDS
from tests.hostile.rows.wrong_data import FAST
from tests.hostile.spoilt import calibrated, error_of, tried
from tests.hostile.tried_mistakes import IN_CALIBRATION, IN_VALIDATION, fault, found_in


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigid") / "data"
    return tried_mistakes.rigid(folder), load(folder)


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    return tried_mistakes.twin(tmp_path_factory.mktemp("twin") / "run")


def test_nothing_is_found_in_good_recordings(rigid):
    assert not found_in(rigid[1].folder)


@pytest.mark.parametrize(
    "mistake", [*FAST, *(pytest.param(m, marks=pytest.mark.slow) for m in KINDS)], ids=lambda m: m.name
)
def test_a_mistake_seen_in_the_recordings_is_named(rigid, mistake, tmp_path):
    found = found_in(mistake.spoil(rigid[0]).written(tmp_path / "data"))
    assert any(words in message for message in found for words in mistake.says.split("|")), found


def test_a_bounded_mistake_is_in_the_intervals_of_what_it_moves(rigid, tmp_path):
    dataset = load(scaled(1.003)(rigid[0]).written(tmp_path / "data"))
    trials = [trial for _, trial in relabelled_trials(dataset, "calibration")]
    (found,) = judged(Laboratory(dataset.urdf, dataset.description), trials, calibrated=True)
    moved = dict(found.moves[0])
    assert found.verdict == "warning" and {"frame.tool.hand.x", "geometry.arm_4_joint.x"} <= moved.keys()
    lengths = [size for name, size in moved.items() if name.startswith("geometry.")]
    assert 0.003 * 0.8 < np.linalg.norm(lengths) < 0.003 * 2.0  # an arm's length, of a 0.3 % larger scale


@pytest.mark.slow
@pytest.mark.parametrize("mistake", (*IN_CALIBRATION, *IN_VALIDATION), ids=lambda m: m.name)
def test_a_mistake_is_named_or_costs_little(twin, mistake, tmp_path):
    good, campaign, reference = twin
    found = tried(mistake, campaign, good, reference, tmp_path / "data")
    assert not fault(mistake, found), found


@pytest.mark.slow
def test_hidden_markers_cost_no_posture_and_hardly_any_error(twin, tmp_path):
    good, campaign, (clean, _) = twin
    ratios = []
    for seed in range(5):
        estimate = calibrated(load(hidden(0.2, 2.0, seed)(campaign).written(tmp_path / str(seed))))
        assert any(v.message.startswith("marker frames from 20 postures") for v in estimate.verdicts)
        ratios.append(error_of(estimate, good) / clean)
    assert np.mean(ratios) < 1.05 and max(ratios) < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("seed", random_cases.MENDED)
def test_a_clean_campaign_that_was_once_named_is_not(seed, tmp_path):
    (clean,) = random_cases.tried_robot(seed, 0, tmp_path)
    assert not clean.messages


def test_mistakes_at_random_were_hardly_ever_silently_wrong_and_clean_campaigns_hardly_ever_named():
    every = random_cases.rows()
    spoilt, good = [r for r in every if r[1]], [r for r in every if not r[1]]
    assert sum(map(random_cases.silent, spoilt)) <= max(1, 0.01 * len(spoilt))
    assert sum(bool(r[3]) for r in good) <= max(1, 0.01 * len(good))


def test_hidden_markers_cost_no_more_than_fewer_data_and_outliers_nothing():
    ratios = hidden_markers.ratios()
    fewer = ratios.pop(hidden_markers.LEFT_OUT)
    assert all(len(r) > 12 and r.mean() < 1.1 and np.sqrt(np.mean(r**2)) < 1.1 for r in ratios.values())
    assert all(np.mean(r**2) < np.mean(fewer**2) for r in ratios.values())
    assert hidden_markers.of_outliers() < 0.1
