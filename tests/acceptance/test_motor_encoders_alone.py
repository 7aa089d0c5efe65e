"""A robot without any link encoder: drive trains from the hand's markers alone. Slow, run by `make slow`."""

import numpy as np
import pytest

from calibration import calibrate, evaluate, load
from scenarios.score.score import score
from tests.hostile.rows.campaign import Campaign

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def stripped(quick_run, tmp_path_factory):
    """The quick run's dataset without link readings, and its estimate."""
    from dataclasses import replace

    campaign = Campaign.of(load(quick_run.folder / "dataset"), 0.0)
    for role in ("calibration", "validation"):
        campaign = campaign.changed(role, lambda trial, _: replace(trial, q_link=np.full(trial.q_link.shape, np.nan)))
    dataset = load(campaign.written(tmp_path_factory.mktemp("stripped") / "dataset"))
    return dataset, calibrate(dataset)


@pytest.fixture(scope="module")
def judged(stripped, quick_run):
    dataset, estimate = stripped
    return score(estimate, evaluate(estimate, dataset), quick_run.folder / "truth")


def test_the_drive_trains_come_from_the_hand_s_markers(stripped):
    said = [v.message for v in stripped[1].verdicts if v.stage == "bundle"]
    assert any("from the hand's markers: arm_1_joint, arm_2_joint" in message for message in said), said


def test_row_full_predicts_unseen_motions_better_than_the_geometry_alone(judged):
    rows = {r.model: r for r in judged.rows if (r.trials, r.base, r.encoder) == ("dynamic", "measured", "motor")}
    assert rows["full"].metrics.position_rmse_component_mm < 0.7 * rows["model_2"].metrics.position_rmse_component_mm
    assert rows["full"].metrics.orientation_rmse_deg < 0.5 * rows["model_2"].metrics.orientation_rmse_deg


@pytest.mark.parametrize("joint", [6, 7])
def test_large_gaps_are_recovered(judged, joint):
    found = next(p for p in judged.parameters if p.name == f"backlash.arm_{joint}_joint.gap")
    assert found.status == "estimated" and found.estimate == pytest.approx(found.truth, rel=0.1)


def test_what_the_markers_do_not_show_is_named_with_a_motion(stripped):
    dataset, estimate = stripped
    open_ = [
        p.name
        for p in estimate.model("drive_trains").parameters
        if p.status == "not_identifiable" and ".motor." not in p.name and "arm" in p.name
    ]
    said = " ".join(v.message for v in estimate.verdicts if "not identifiable" in v.message)
    assert open_ and all(name in said for name in open_)
