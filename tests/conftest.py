"""One thread of linear algebra for all tests, set before numpy is loaded: several fight over the cores."""

import gc
import os

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402

from tests.acceptance.claims import keep  # noqa: E402


def pytest_sessionstart():
    gc.disable()  # a fifth of the collection's time looks for garbage among modules that stay


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


@pytest.fixture
def undrawn(monkeypatch):
    """Figures of pages are made but not rendered, which takes half of a page's time."""
    from scenarios.report import page

    monkeypatch.setattr(page, "svg", lambda figure, name: f'<svg id="{name}"></svg>\n')


@pytest.fixture(scope="session")
def base_r2():
    """R2 (2,) of the base's predicted roll and pitch against the truth, over the validation swings of a run."""

    def r2(folder, estimate, source) -> np.ndarray:
        from scipy.spatial.transform import Rotation

        import calibration
        from calibration.stages.suspension.base_response import laboratory
        from tests.doubles.moving_base import base_poses
        from twin.truth import read_trial

        dataset = calibration.load(folder / "dataset")
        lab = laboratory(dataset.urdf, dataset.description, estimate.clock("robot"), estimate.clock("plate"))
        errors, motions = [], []
        for entry, trial in dataset.trials("validation", "swing"):
            true = read_trial(folder / "truth" / entry.file).base_pose
            found = base_poses(estimate.suspension, lab, trial, source)
            angles = [Rotation.from_matrix(T[0, :3, :3].T @ T[:, :3, :3]).as_rotvec()[:, :2] for T in (true, found)]
            motions.append(angles[0])
            errors.append(angles[1] - angles[0])
        error, motion = np.concatenate(errors), np.concatenate(motions)
        return 1.0 - (error**2).sum(axis=0) / ((motion - motion.mean(axis=0)) ** 2).sum(axis=0)

    return r2


@pytest.fixture
def claim():
    """Keep the figures of a claim, one a robot; `make claims` brings them into the documents."""
    return keep
