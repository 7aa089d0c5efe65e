"""Our rows beside the peer's on the same dataset, scored by the same `evaluate`; and on a table of real postures.

Position is RMSE of the norm [mm], the base measured: the peer has no base that moves.
"""

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from calibration import load
from scenarios import steps
from scenarios.benchmarks.peer import METHODS, Frames, Peer, Table, predict_dataset
from scenarios.datasets.index import write_whole
from scenarios.score.score import score

_ROWS = ("nominal", "registration", "model_2", "full")


@dataclass(frozen=True)
class Line:
    """RMSE of a method on held-out postures and motions: position [mm], orientation [deg]; None where there is none."""

    method: str
    static_mm: float | None = None
    static_deg: float | None = None
    dynamic_mm: float | None = None
    dynamic_deg: float | None = None


def compare(
    python: Path, dataset: Path, out: Path, estimate: Path | None, truth: Path | None, progress: steps.Progress
) -> tuple[Line, ...]:
    """Calibrate a dataset with every method of the peer, and by ourselves where no estimate is named; score them all.

    Writes OUT/figaroh_<method>.nc, peer.json and peer.md. Without a truth the reference is the motion capture.

    Raises:
        ScenarioError: FIGAROH is not there, or failed.
        CalibrationError: The folder is no dataset, or does not allow a calibration.
    """
    peers = [Peer(python, method) for method in METHODS]
    out.mkdir(parents=True, exist_ok=True)
    if estimate is None:
        estimate = out / "estimate"
        steps.calibrate(dataset, estimate, progress=progress)
    opened = load(dataset)
    found: dict[str, Line] = {}
    for k, peer in enumerate(peers):
        progress("peer", peer.method, k / len(peers))
        predict_dataset(peer, dataset, out / f"figaroh_{peer.method}.nc")
    for path in (estimate, *(out / f"figaroh_{method}.nc" for method in METHODS)):
        judged, evaluation = steps.evaluated(path, opened)
        rows = evaluation.rows if truth is None else score(judged, evaluation, truth).rows
        for row in rows:
            own = row.base == "submitted" or (row.model in _ROWS and row.base == "measured" and row.encoder == "motor")
            if own and row.trials in ("static", "dynamic"):
                line = found.get(row.model, Line(row.model))
                mm, deg = row.metrics.position_rmse_norm_mm, row.metrics.orientation_rmse_deg
                found[row.model] = (
                    replace(line, static_mm=mm, static_deg=deg)
                    if row.trials == "static"
                    else replace(line, dynamic_mm=mm, dynamic_deg=deg)
                )
    lines = tuple(found.values())
    write_whole(out / "peer.json", json.dumps([asdict(line) for line in lines], indent=1) + "\n")
    write_whole(out / "peer.md", table(lines))
    return lines


def table(lines: Iterable[Line]) -> str:
    """Markdown."""
    head = "| method | postures [mm] | [deg] | motions [mm] | [deg] |\n|---|---|---|---|---|\n"
    return head + "".join(f"| {' | '.join(_cell(v) for v in asdict(line).values())} |\n" for line in lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.2f}" if np.isfinite(value) else "-"
    return str(value or "-")


def left_out(peer: Peer, urdf: str, frames: Frames, postures: Path, parts: Sequence[np.ndarray]) -> float:
    """RMSE of the norm [mm] of all markers of a CSV table, each part (row numbers) predicted from the others."""
    with postures.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    n = sum(f"x{k}" in rows[0] for k in range(1, 100))
    q = np.array([[float(row[joint]) for joint in frames.joints] for row in rows])
    p = np.array([[[float(row[f"{axis}{k + 1}"]) for axis in "xyz"] for k in range(n)] for row in rows])
    squares = []
    for part in parts:
        kept = np.setdiff1d(np.arange(len(rows)), part)
        predicted = peer.predict(urdf, frames, Table(q[kept], p[kept]), q[part])
        squares.append(((predicted - p[part]) ** 2).sum(axis=2).ravel())
    return 1e3 * float(np.sqrt(np.concatenate(squares).mean()))
