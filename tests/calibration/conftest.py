"""One small campaign and its estimate, made once for all tests of the pipeline."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mjcf
from calibration import Dataset, Estimate, Evaluation, calibrate, evaluate, load
from calibration.pipeline import STAGES
from calibration.robot.chain import Chain, chain_of
from tests.doubles import rigid_robot
from tests.doubles.made_once import made_once


@pytest.fixture(scope="session")
def truth() -> rigid_robot.Truth:
    return replace(rigid_robot.defects(1), half_gap=np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory, worker_id: str, truth: rigid_robot.Truth) -> Path:
    """A dataset folder; copy it before changing anything."""
    return made_once(tmp_path_factory, worker_id, "matched", lambda out: rigid_robot.campaign(out / "dataset", truth))


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return load(folder)


@pytest.fixture(scope="session")
def estimate(tmp_path_factory: pytest.TempPathFactory, worker_id: str, dataset: Dataset) -> Estimate:
    """Without the drive trains, which take the hand's markers half a minute: no joint has a link encoder."""
    stages = [s for s in STAGES if s not in ("base_frame", "arm_tool", "bundle")]
    return made_once(tmp_path_factory, worker_id, "estimate", lambda _: calibrate(dataset, stages))


@pytest.fixture(scope="session")
def evaluation(
    tmp_path_factory: pytest.TempPathFactory, worker_id: str, dataset: Dataset, estimate: Estimate
) -> Evaluation:
    return made_once(tmp_path_factory, worker_id, "evaluation", lambda _: evaluate(estimate, dataset))


@pytest.fixture(scope="session")
def chain() -> Chain:
    return chain_of(mjcf.urdf(), rigid_robot.described())
