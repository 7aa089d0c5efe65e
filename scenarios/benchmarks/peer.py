"""FIGAROH 1.0.2 on our datasets: their inputs for it, its prediction as poses that `evaluate` scores beside ours.

    in     markers of the hand in the base's marker body, means over dwells, and readings; nominal.urdf
    out    T_lab_hand(t) = T_lab_base(t) T_base_hand(predicted markers at q(t))

It runs in an environment of its own (`make peer`), as published: nothing of it is installed, read or copied here. It
has no base that moves: where the base's markers are hidden, the base stays as in the first second.
"""

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from calibration import load
from calibration.evaluation import write_submission
from calibration.mocap import body_poses
from calibration.numerics.lie import mean
from scenarios.benchmarks import figaroh_program
from scenarios.files.errors import ScenarioError

METHODS = ("structural", "excitation", "map")
_REST = 1.0  # [s]


@dataclass(frozen=True)
class Peer:
    """FIGAROH in its environment.

    Attributes:
        python: Interpreter that has it.
        method: Of its estimation, one of `METHODS`.
    """

    python: Path
    method: str

    def __post_init__(self) -> None:
        if not self.python.is_file():
            raise ScenarioError(f"{self.python}: no such interpreter; make one with FIGAROH 1.0.2: make peer")

    def predict(self, urdf: str, frames: "Frames", train: "Table", q: np.ndarray) -> np.ndarray:
        """Markers (n, m, 3) [m] at readings q (n, k) of the robot that the table's postures calibrate.

        Raises:
            ScenarioError: It failed, with its last words.
        """
        with TemporaryDirectory() as folder:
            place = Path(folder)
            (place / "nominal.urdf").write_text(urdf, encoding="utf-8")
            train.write(place / "train.csv", frames.joints)
            Table(q, np.zeros((len(q), *train.markers.shape[1:]))).write(place / "test.csv", frames.joints)
            task = {name: str(place / f"{name}.csv") for name in ("train", "test")}
            task |= {"urdf": str(place / "nominal.urdf"), "out": str(place / "out.npy"), "method": self.method}
            (place / "task.json").write_text(json.dumps(task | {"joints": frames.joints, "tool": frames.tool}))
            command = [str(self.python), "-P", figaroh_program.__file__, str(place / "task.json")]
            done = subprocess.run(command, cwd=place, capture_output=True, text=True, env=_environment())
            if done.returncode:
                raise ScenarioError(f"FIGAROH, {self.method}: exit {done.returncode}: {done.stderr.strip()[-500:]}")
            found: np.ndarray = np.load(place / "out.npy")
            return found


@dataclass(frozen=True)
class Frames:
    """Joints that are measured, and the frame at the end of the chain."""

    joints: Sequence[str]
    tool: str


@dataclass(frozen=True)
class Table:
    """Postures: readings q (n, k) [rad, m] and markers (n, m, 3) [m]."""

    q: np.ndarray
    markers: np.ndarray

    def write(self, path: Path, joints: Sequence[str]) -> None:
        """Write FIGAROH's CSV."""
        names = [f"{axis}{k + 1}" for k in range(self.markers.shape[1]) for axis in "xyz"]
        rows = np.hstack([self.markers.reshape(len(self.q), -1), self.q])
        np.savetxt(path, rows, delimiter=",", header=",".join([*names, *joints]), comments="", fmt="%.9f")


def _environment() -> dict[str, str]:
    own = {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    return {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | own


def predict_dataset(peer: Peer, folder: Path, out: Path) -> None:
    """Calibrate a dataset folder and write predicted poses of its held-out trials, validation and second session.

    Raises:
        ScenarioError: FIGAROH failed.
        CalibrationError: The folder is no dataset, or shows no postures.
    """
    dataset = load(folder)
    seen, about = dataset.postures(), dataset.description
    xyz = np.array([marker.xyz for marker in about.hand_body.markers])
    train = Table(seen.q, xyz @ np.swapaxes(seen.T_base_hand[:, :3, :3], 1, 2) + seen.T_base_hand[:, None, :3, 3])
    entries = dataset.entries("validation")
    trials = {e.id: dataset.trial(e.id).aligned() for e in entries}
    q = np.concatenate([t.q_motor for t in trials.values()])
    known = np.isfinite(q).all(axis=1)
    T = np.full((len(q), 4, 4), np.nan)
    frames = Frames(about.joint_names, about.tool_frame)
    T[known] = body_poses(xyz, peer.predict(dataset.urdf, frames, train, q[known])).T
    parts = np.split(T, np.cumsum([len(t.t) for t in trials.values()])[:-1])
    found = {}
    for (name, trial), T_base_hand in zip(trials.items(), parts, strict=True):
        base, rest = trial.T_lab_base, trial.t <= trial.t[0] + _REST
        hidden = not np.isfinite(base[~rest]).any()
        found[name] = trial.t, (mean(base[rest]) if hidden else base) @ T_base_hand
    write_submission(out, found)
