"""FIGAROH beside ours: what it is given and what comes back; with the real one where its environment is."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import calibration
from scenarios import steps
from scenarios.benchmarks import beside_peer, peer
from scenarios.benchmarks.peer import METHODS, Frames, Peer, Table, predict_dataset
from scenarios.files.errors import ScenarioError
from tests.doubles import rigid_robot

PYTHON = Path(os.environ.get("PEER_PYTHON", Path(__file__).parents[3] / ".venv-peer/bin/python"))


@pytest.fixture(scope="module")
def truth():
    return rigid_robot.defects(1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, truth):
    return rigid_robot.campaign(tmp_path_factory.mktemp("robot") / "dataset", truth)


@pytest.fixture
def nominal_peer(monkeypatch, folder):
    """A peer that predicts the nominal robot, and what it was given."""
    given = []

    def predict(self, urdf, frames, train, q):
        given.append((frames, train, q))
        dataset = calibration.load(folder)
        xyz = np.array([m.xyz for m in dataset.description.hand_body.markers])
        T = dataset.nominal(q)
        return np.einsum("nij,mj->nmi", T[:, :3, :3], xyz) + T[:, None, :3, 3]

    monkeypatch.setattr(Peer, "predict", predict)
    monkeypatch.setattr(Peer, "__post_init__", lambda self: None)
    return given


def test_its_prediction_is_scored_as_the_robot_that_it_predicts(folder, nominal_peer, tmp_path):
    predict_dataset(Peer(Path("python"), "map"), folder, tmp_path / "peer.nc")
    _, found = steps.evaluated(tmp_path / "peer.nc", calibration.load(folder))
    theirs, nominal = (
        found.row(*key).metrics for key in (("peer", "dynamic", "submitted"), ("nominal", "dynamic", "measured"))
    )
    assert theirs.position_rmse_norm_mm == pytest.approx(nominal.position_rmse_norm_mm, rel=1e-6)
    frames, train, _ = nominal_peer[0]
    assert train.markers.shape == (len(train.q), 4, 3) and len(frames.joints) == train.q.shape[1] == 8


def test_its_csv_has_markers_then_joints(tmp_path):
    Table(np.ones((2, 3)), np.zeros((2, 2, 3))).write(tmp_path / "a.csv", ("a", "b", "c"))
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "x1,y1,z1,x2,y2,z2,a,b,c"


def test_an_environment_without_it_is_named(tmp_path):
    with pytest.raises(ScenarioError, match="make one with FIGAROH 1.0.2: make peer"):
        Peer(tmp_path / "python", "map")


def test_what_it_says_when_it_fails_is_passed_on(tmp_path, monkeypatch):
    python = tmp_path / "python"
    python.touch()
    failed = subprocess.CompletedProcess([], 1, "", "no such frame")
    monkeypatch.setattr(peer.subprocess, "run", lambda *args, **kwargs: failed)
    with pytest.raises(ScenarioError, match="FIGAROH, map: exit 1: no such frame"):
        Peer(python, "map").predict(
            "", Frames(("a",), "tool"), Table(np.ones((1, 1)), np.ones((1, 1, 3))), np.ones((1, 1))
        )


@pytest.mark.slow
@pytest.mark.skipif(not PYTHON.is_file(), reason="make peer")
def test_one_command_gives_its_rows_beside_ours(folder, tmp_path):
    lines = beside_peer.compare(PYTHON.absolute(), folder, tmp_path, None, None, steps.silent)
    found = {line.method: line for line in lines}
    assert {*(f"figaroh_{m}" for m in METHODS), "nominal", "registration", "model_2"} <= set(found)
    best = min(found[f"figaroh_{m}"].dynamic_mm for m in METHODS)
    assert best < 0.5 * found["nominal"].dynamic_mm
    assert json.loads((tmp_path / "peer.json").read_text())[0]["method"] == "nominal"
