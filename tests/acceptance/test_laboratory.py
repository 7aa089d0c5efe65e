"""The scenario `laboratory`: everything an instrument gets wrong at once, and what is left of the ladder."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calibration.recording.trial import read_trial
from scenarios import load, run


def test_it_is_the_paper_s_campaign_but_for_its_instruments():
    ours, paper = load("laboratory").twin, load("humanoids2024").twin
    assert replace(ours, instruments=paper.instruments) == paper
    i = ours.instruments
    assert i.mocap.swaps and i.mocap.cameras and i.plate.crosstalk and i.log.jitter and i.plate_grid == (2, 1)


@pytest.mark.slow
def test_the_ladder_keeps_its_order_and_loses_tenths_of_a_millimetre(tmp_path):
    run(load("laboratory"), tmp_path / "run", quick=True)
    trials = [read_trial(p) for p in sorted((tmp_path / "run/dataset/trials").iterdir())]
    assert max(np.isnan(t.marker_position).any(axis=2).mean() for t in trials) > 0.05, "markers were hidden"
    assert any((np.diff(t.t_robot) > 0.1).any() for t in trials), "messages were lost"
    score = json.loads((tmp_path / "run/score.json").read_text())
    rows = {
        (r["model"], r["base"], r["encoder"]): r["position_rmse_component_mm"]
        for r in score["rows"]
        if r["trials"] == "dynamic"
    }
    registration, model_2, model_3 = (rows[m, "plate", "motor"] for m in ("registration", "model_2", "model_3"))
    assert model_3 < model_2 < 2.2 and model_2 < 0.4 * registration  # clean instruments: 1.2 < 1.7, registration 8.3
    clocks = [p for p in score["parameters"] if p["name"].startswith("clock.") and p["name"].endswith("offset")]
    assert len(clocks) == 2 and all(abs(p["z"]) < 3.3 for p in clocks)
