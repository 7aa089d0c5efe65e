"""Row `full`: simulated backlash, wheels and slip are recovered, and the hand is predicted with them."""

import json
from dataclasses import replace

import numpy as np
import pytest


@pytest.fixture(scope="module")
def score(quick_run):
    return json.loads((quick_run.folder / "score.json").read_text(encoding="utf-8"))


def figure(score, model, base, trials="dynamic", name="position_rmse_component_mm"):
    rows = (r for r in score["rows"] if (r["model"], r["base"], r["trials"]) == (model, base, trials))
    return next(r[name] for r in rows if r["encoder"] == "motor")


@pytest.mark.parametrize("base", ["plate", "dynamics", "measured"])
def test_it_predicts_unseen_motions_better_than_the_printed_joint_model(score, base):
    assert figure(score, "full", base) < 0.7 * figure(score, "model_3", base)
    angle = [figure(score, model, base, name="orientation_rmse_deg") for model in ("full", "model_3")]
    assert angle[0] < 0.5 * angle[1]


def test_link_encoders_less_their_identified_errors_are_better_still(score):
    rows = {
        r["encoder"]: r for r in score["rows"] if (r["model"], r["base"], r["trials"]) == ("full", "plate", "static")
    }
    assert rows["link"]["position_rmse_component_mm"] < 0.6 * rows["motor"]["position_rmse_component_mm"]


def test_the_base_it_predicts_is_better_than_one_that_stays(score):
    assert figure(score, "full", "plate") < 0.5 * figure(score, "full", "fixed")


@pytest.mark.parametrize("joint", [3, 4, 5, 6, 7])
def test_simulated_backlash_is_recovered(score, joint):
    found = next(p for p in score["parameters"] if p["name"] == f"backlash.arm_{joint}_joint.gap")
    assert found["status"] == "estimated"
    assert found["estimate"] == pytest.approx(found["truth"], rel=0.05)


def test_a_gap_that_no_load_reversal_shows_is_not_called_estimated(score):
    found = next(p for p in score["parameters"] if p["name"] == "backlash.arm_2_joint.gap")
    assert found["status"] == "not_identifiable"


def test_a_zero_beside_a_gap_that_is_not_seen_is_as_uncertain_as_half_the_gap(score, quick_run):
    """A load that never changes its sign makes half the gap a zero."""
    full = quick_run.estimate.model("full")
    zero = next(c for c in full.combinations if c.name == "encoder.arm_2_joint.motor.offset")
    trains = quick_run.estimate.model("drive_trains")
    gap = next(p for p in trains.parameters if p.name == "backlash.arm_2_joint.gap")
    assert zero.sigma > 0.4 * gap.sigma > 10.0 * np.sqrt(zero.coefficients @ full.random_covariance @ zero.coefficients)
    assert score["nees"] <= 2.0 * score["dof"]


def test_a_row_has_the_band_of_full_about_where_full_has_the_hand(quick_run):
    trial = next(t for t in quick_run.evaluation.predicted if t.kind != "static")
    of = {(p.model, p.base): p for p in trial.rows if p.encoder == "motor"}
    assert not np.nansum(np.abs(of["full", "plate"].offset))
    for row, best in (
        (("model_2", "plate"), ("full", "plate")),
        (("registration", "measured"), ("full", "measured")),
        (("model_3", "fixed"), ("full", "plate")),  # a base that moves is known to be elsewhere
    ):
        np.testing.assert_array_equal(of[row].covariance, of[best].covariance)
        off = of[best].T_lab_hand[:, :3, 3] - of[row].T_lab_hand[:, :3, 3]
        np.testing.assert_array_equal(of[row].offset, off)
        assert np.nanmax(np.linalg.norm(off, axis=1)) > 1e-3  # [m]


def test_where_full_is_not_delivered_a_row_has_its_own_band(quick_run):
    """A base on springs alone has then what they left of trials they had not seen."""
    from calibration import evaluate, load

    dataset = load(quick_run.folder / "dataset")
    found = evaluate(replace(quick_run.estimate, main="model_2"), dataset)
    trial = next(t for t in found.predicted if t.kind != "static")
    of = {(p.model, p.base): p for p in trial.rows if p.encoder == "motor"}
    tried = dict(quick_run.estimate.suspension.held_out)["plate"]
    np.testing.assert_array_equal(of["model_2", "plate"].base_variance, tried.variance(tried.moves))
    assert of["model_2", "plate"].offset is None
    rows = [of[model, "plate"] for model in ("full", "model_2", "registration")]
    own = [np.sqrt(np.nanmean(row.covariance.trace(axis1=1, axis2=2))) for row in rows]
    assert own[0] < 0.5 * own[1] < 0.25 * own[2]


def test_the_estimate_reads_back_and_predicts_the_same(quick_run):
    """`run` evaluates what it has saved."""
    from calibration import load
    from calibration.prediction import predict

    dataset = load(quick_run.folder / "dataset")
    for own, read in zip(predict(quick_run.estimate, dataset), quick_run.evaluation.predicted, strict=True):
        assert own.trial_id == read.trial_id
        for a, b in zip(own.rows, read.rows, strict=True):
            if a.model == "full":
                np.testing.assert_allclose(a.T_lab_hand, b.T_lab_hand, rtol=0.0, atol=1e-9)
