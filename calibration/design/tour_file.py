"""A tour of postures as files a robot plays: from each side the design asks for, with time to come to rest.

    t_move = max_j |q_j - q'_j| / speed_j          to the point before a posture, q - side * overshoot, then to q itself

    tour.csv                     t, a column a joint; a row where a move begins or ends: the twin plays it, too
    tour_rests.csv               posture, start and stop of its dwell [s], from 0
    tour_play_motion.yaml        a motion of PAL's play_motion, for its parameter server
    tour_trajectory.yaml         trajectory_msgs/JointTrajectory, for the arm's and torso's controllers

Moves are linear in the joints, as the design checked them. Positions are set-points: what a robot adds is its own.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from calibration.errors import ShapeError
from calibration.recording.experiment import Posture

NAME = "calibration_postures"
DWELL = 2.0  # [s]
START = 1.0  # [s] of rest before the first move
SPEED = 0.3  # [rad/s]
OVERSHOOT = 0.05  # [rad] before a posture on the other side
_SLIDE = 0.1  # what a radian is worth where a joint slides [m]


@dataclass(frozen=True)
class PlayedTour:
    """Set-points of a tour.

    Attributes:
        joints: Names of the columns of q.
        t: (n,) times at which moves begin and end [s], rising.
        q: (n, k) set-points there [rad, m], linear between.
        rests: (m, 2) start and stop of each posture's dwell [s].
    """

    joints: tuple[str, ...]
    t: np.ndarray
    q: np.ndarray
    rests: np.ndarray

    def write(self, folder: Path) -> tuple[Path, ...]:
        """Write the files into a folder that is there; return their paths."""
        rows = np.column_stack([self.t, self.q])
        files = {
            "tour.csv": _csv(("t", *self.joints), rows),
            "tour_rests.csv": _csv(
                ("posture", "start", "stop"), np.column_stack([np.arange(len(self.rests)), self.rests])
            ),
            "tour_play_motion.yaml": _yaml({"play_motion": {"motions": {NAME: self._motion()}}}),
            "tour_trajectory.yaml": _yaml(self._trajectory()),
        }
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        return tuple(folder / name for name in files)

    def _motion(self) -> dict[str, object]:
        points = [
            {"positions": _rounded(q), "time_from_start": round(float(t), 3)}
            for t, q in zip(self.t, self.q, strict=True)
        ]
        meta = {"name": "Calibration postures", "usage": "calibration", "description": f"{len(self.rests)} postures"}
        return {"joints": list(self.joints), "points": points, "meta": meta}

    def _trajectory(self) -> dict[str, object]:
        still = [0.0] * len(self.joints)
        nanoseconds = [round(float(t) * 1e3) * 1_000_000 for t in self.t]
        points = [
            {
                "positions": _rounded(q),
                "velocities": still,
                "time_from_start": {"secs": ns // 10**9, "nsecs": ns % 10**9},
            }
            for ns, q in zip(nanoseconds, self.q, strict=True)
        ]
        return {"joint_names": list(self.joints), "points": points}


def played(
    joints: Sequence[str],
    postures: Sequence[Posture],
    limits: tuple[np.ndarray, np.ndarray],
    slides: Sequence[bool],
    dwell: float = DWELL,
) -> PlayedTour:
    """The tour through postures in their order.

    Args:
        joints: Names of the joints, k.
        postures: To rest in.
        limits: Lower and upper (k,) [rad, m]; points before a posture stay within.
        slides: Which joints are prismatic.
        dwell: Of each posture [s].

    Raises:
        ShapeError: Postures or limits are not of these joints.
    """
    if limits[0].shape != (len(joints),) or any(len(p.q) != len(joints) for p in postures):
        raise ShapeError("q", (len(postures[0].q),) if postures else (0,), (len(joints),))
    unit = np.where(np.asarray(slides), _SLIDE, 1.0)
    first = np.array(postures[0].q)
    t, q, rests = [0.0, START], [first, first], []
    for posture in postures:
        goal, side = np.array(posture.q), np.array(posture.approach)
        before = np.clip(goal - side * OVERSHOOT * unit, *limits)
        for point in (before, goal):
            move = float((np.abs(point - q[-1]) / (SPEED * unit)).max())
            if move > 0.0:
                t, q = [*t, t[-1] + max(move, 0.1)], [*q, point]
        rests.append((t[-1], t[-1] + dwell))
        t, q = [*t, t[-1] + dwell], [*q, goal]
    return PlayedTour(tuple(joints), np.array(t), np.array(q), np.array(rests))


def _rounded(q: np.ndarray) -> list[float]:
    return [round(float(x), 5) + 0.0 for x in q]


def _csv(header: Sequence[str], rows: np.ndarray) -> str:
    lines = (",".join(f"{x:.6g}" for x in row) for row in rows)
    return "\n".join((",".join(header), *lines)) + "\n"


def _yaml(content: dict[str, object]) -> str:
    stream, yaml = io.StringIO(), YAML()
    yaml.default_flow_style = None
    yaml.width = 200
    yaml.dump(content, stream)
    return stream.getvalue()
