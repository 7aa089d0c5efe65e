"""The baseline is the best rigid fit: no plain least squares of the same markers does better."""

import shutil

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from calibration import calibrate, load
from calibration.robot import chain_of
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.geometry.model_of_fit import hand_of
from scenarios.steps.import_export import import_files
from tests.doubles.real_postures import TABLE, TWO_DAYS, real_rows


def plain_rms(T: np.ndarray, markers: np.ndarray) -> float:
    """Rms distance [m] of base and each marker's place in the hand fitted to markers (n, m, 3) by least squares."""

    def misfit(x):
        places = np.einsum("nij,mj->nmi", T[:, :3, :3], x[6:].reshape(-1, 3)) + T[:, None, :3, 3]
        return (places @ Rotation.from_rotvec(x[3:6]).as_matrix().T + x[:3] - markers).ravel()

    return np.sqrt(3.0 * np.mean(least_squares(misfit, np.zeros(6 + 3 * markers.shape[1])).fun ** 2))


def test_registration_of_a_real_robot_is_as_good_as_plain_least_squares_of_its_markers(tmp_path):
    files = [shutil.copy(TABLE, tmp_path / f"{day}.csv") for day in ("day1", "day2")]
    import_files("csv", files, TWO_DAYS, tmp_path / "dataset")
    dataset = load(tmp_path / "dataset")
    chain = chain_of(dataset.urdf, dataset.description)
    model = calibrate(dataset, ("registration",)).model("registration")
    q, bodies = real_rows()[1][:, 12:], np.array([m.xyz for m in dataset.description.hand_body.markers])
    T = hand_of(model, chain, nominal_frames(chain, dataset.description)).poses(q)
    markers = real_rows()[1][:, :12].reshape(-1, 4, 3)
    found = np.einsum("nij,mj->nmi", T[:, :3, :3], bodies) + T[:, None, :3, 3]
    rms = np.sqrt(np.mean(np.sum((found - markers) ** 2, axis=2)))
    assert rms <= 1.005 * plain_rms(chain.poses(q), markers)
