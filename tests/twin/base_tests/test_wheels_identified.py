import json

import numpy as np
import pytest

from calibration.pipeline import calibrate
from calibration.recording.dataset import load as load_dataset
from scenarios import load
from twin import record

SETTINGS = (
    "twin.base.wheels=anchored",
    "twin.payload.mass=2.5",
    "twin.campaign.calibration_swing=60.0",
    "twin.campaign.validation_swing=2.0",
    "twin.campaign.validation_postures=2",
    "twin.campaign.calibration_postures=20",
    "twin.campaign.sweep=6.0",
)
SHARP = 0.02
FINE = (
    "twin.instruments.marker_noise=1e-5",
    "twin.instruments.bodies.base.translation=0.0",
    "twin.instruments.bodies.base.rotation=0.0",
    "twin.instruments.bodies.base.marker=0.0",
)


def identified(out, settings):
    """Errors and standard deviations (6, 6) of K from recordings alone, relative to the roots of the diagonal pair."""
    record(load("humanoids2024", [*SETTINGS, *settings]).twin, 4, out)
    found = calibrate(load_dataset(out / "dataset"), ("clocks", "registration", "suspension")).suspension
    K = np.array(json.loads((out / "truth/truth.json").read_text())["derived"]["K"])
    q = np.sqrt(np.diag(K))
    error, sigma = np.abs(found.K - K) / np.outer(q, q), np.zeros((6, 6))
    for p in (p for p in found.parameters if p.name.startswith("suspension.K.")):
        i, j = (int(digit) - 1 for digit in p.name[-2:])
        sigma[i, j] = sigma[j, i] = p.sigma / (q[i] * q[j])
    print("error %", (100 * error).round(2), "sigma %", (100 * sigma).round(2))
    return error, sigma


@pytest.mark.slow
def test_markers_of_ten_micrometres_give_every_element(tmp_path):
    """Where markers are where they are drawn, heave and its couplings are found too: nothing else is in their way."""
    error, _ = identified(tmp_path, FINE)
    assert error.max() < 0.02


@pytest.mark.slow
def test_the_suspension_stage_finds_the_springs_of_anchored_wheels(tmp_path):
    """Default noise and mounting of markers, 2.5 kg swung five times for a minute.

    The 2 % are held where the stage's own standard deviation is below: x, y, rx, ry, rz, x-y and rx-ry. Heave moves by
    less than the markers' noise, and where the base's markers are on it (2 mm) is in the others: 1.4 % of
    sqrt(K_z K_pitch) for each millimetre.
    """
    error, sigma = identified(tmp_path, ())
    identifiable = (sigma > 0.0) & (sigma < SHARP)
    assert identifiable[[0, 1, 3, 4, 5, 0, 3], [0, 1, 3, 4, 5, 1, 4]].all()
    assert error[identifiable].max() < 0.02
    assert (error < 2.0 * np.maximum(sigma, 0.01)).all()
