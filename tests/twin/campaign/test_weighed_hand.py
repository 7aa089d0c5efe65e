"""The hand of simulated robots, weighed by the wrist's sensor: mass and centre within their intervals. Slow."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.stats import binom

from calibration import calibrate, load
from calibration.stages import wrist_load
from calibration.stages.wrist_load import Hanging
from twin.campaign import laboratory, record
from twin.config import TwinConfig

SEEDS = range(1000, 1008)
pytestmark = pytest.mark.slow


def truth(config: TwinConfig, seed: int) -> np.ndarray:
    """Mass [kg] and centre [m] of what hangs on the sensor, its axes."""
    model = laboratory(config, seed).twin.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    site, body = data.site("wrist"), model.site("wrist").bodyid[0]
    return np.r_[model.body_subtreemass[body], (data.subtree_com[body] - site.xpos) @ site.xmat.reshape(3, 3)]


def test_mass_and_centre_of_new_robots_lie_in_their_intervals(config, tmp_path, monkeypatch):
    found: list[Hanging] = []
    weigh = wrist_load.weigh
    monkeypatch.setattr(wrist_load, "weigh", lambda *given: found.append(weigh(*given)) or found[-1])
    config = replace(config, campaign=replace(config.campaign, only=("postures",)))
    z, error = [], []
    for seed in SEEDS:
        record(config, seed, tmp_path / str(seed))
        calibrate(load(tmp_path / str(seed) / "dataset"), ["clocks", "registration", "geometry", "wrist_load"])
        error.append(np.r_[found[-1].mass, found[-1].centre] - truth(config, seed))
        z.append(error[-1] / np.r_[found[-1].sigma[0], found[-1].centre_sigma])
    held = (np.abs(z) <= 1.96).sum(axis=0)
    print(f"mass and centre: 95 % intervals hold {held} of {len(SEEDS)}, off by {np.abs(error).max(axis=0)} kg, m")
    n = 3 * len(SEEDS)
    assert binom.ppf(0.005, n, 0.95) <= held[1:].sum() and held[0] >= binom.ppf(0.005, len(SEEDS), 0.95)
    assert np.abs(error)[:, 1:].max() < 1e-3
