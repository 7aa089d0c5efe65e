"""A robust fit returns the postures that it used, also where it stopped before they were settled."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import mjcf
from calibration.inference import outliers
from calibration.robot.chain import chain_of
from calibration.stages.geometry.hand_residual import NoiseModel, hand_problem
from calibration.stages.geometry.parameters import geometry_parameters, hand_model
from tests.doubles import rigid_robot


@pytest.mark.parametrize("rounds", [1, 6])
def test_the_postures_kept_are_those_of_the_fit(monkeypatch, rounds):
    monkeypatch.setattr(outliers, "_ROUNDS", rounds)
    described, rng = rigid_robot.described(), np.random.default_rng(0)
    chain, truth = chain_of(mjcf.urdf(), described), rigid_robot.defects(0)
    good = rigid_robot.postures(truth, rigid_robot.random_angles(rng, 60), 1e-4)
    T = good.T_base_hand.copy()
    T[:, :3, 3] += 2e-4 * rng.standard_t(1.0, size=(60, 1))
    postures = replace(good, T_base_hand=T)
    parameters, hand = geometry_parameters(chain, described), hand_model(chain, np.zeros(12))
    none = NoiseModel(*3 * [np.zeros(0)])
    found = outliers.robust_fit(
        lambda some: hand_problem(hand, parameters, postures.rows(some), none), 60, 6, parameters.nominal
    )
    assert len(found.fit.r_white) == found.kept.sum() < 60


def test_a_posture_that_the_fit_of_the_others_predicts_comes_back_and_stays(monkeypatch):
    fits = []

    def solved(problem, *_, **__):
        fits.append(problem)
        return SimpleNamespace(at=SimpleNamespace(weight=np.ones(8)), noise=None, widths=None, covariance=None)

    def judged(problem, found, weight):  # the last row alone is far from a fit that has it, and near one that has not
        return SimpleNamespace(rows=lambda kept: None), np.array([*np.ones(7), 50.0 if weight[-1] else 10.0])

    monkeypatch.setattr(outliers, "solve", solved)
    monkeypatch.setattr(outliers, "_judged", judged)
    monkeypatch.setattr(outliers, "distances", lambda *_: np.array([*np.ones(7), 50.0]))
    monkeypatch.setattr(outliers, "replace", lambda problem, **_: problem)
    problem = SimpleNamespace(linearise=lambda theta: None)
    found = outliers._agreed(lambda some: problem, 8, 6, np.zeros(1), 33.0)
    assert found.kept.all()
