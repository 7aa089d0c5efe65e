"""A motion of one's own: joint positions over time, from arrays or from a CSV file.

    t,torso_lift_joint,arm_1_joint,...,arm_7_joint         header; t [s] rising, positions [m, rad]
    0.0,0.12,1.50,...

Set-points between the rows are linear in time. The robot rests in the first row before, and in the last one after.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import mjcf
from calibration.recording import schema
from twin.errors import TwinError
from twin.fields.names import TORSO
from twin.motions.motion import RATE, REST, Motion, no_dwells
from twin.motions.swings import JOINTS

_SLACK = 1e-6  # by which a limit may be missed [m, rad, m/s, rad/s]


class InvalidTrajectory(TwinError, ValueError):
    """Positions over time that are none, or that the robot cannot follow."""


def trajectory(
    id: str, t: Sequence[float] | np.ndarray, q: np.ndarray, role: schema.Role = "validation", rest: float = REST
) -> Motion:
    """A motion through joint positions at given times.

    Args:
        id: Name of the trial.
        t: Times (n,) [s].
        q: Positions of `JOINTS` (n, 8) [m, rad].
        role: Of the trial.
        rest: Rest before and after [s].

    Raises:
        InvalidTrajectory: Times do not rise, or a joint leaves its limits or is too fast.
    """
    t, q = np.asarray(t, dtype=float), np.asarray(q, dtype=float)
    _check(t, q)
    times = np.arange(round((t[-1] - t[0] + 2.0 * rest) * RATE) + 1) / RATE - rest + t[0]
    command = np.stack([np.interp(times, t, column) for column in q.T], axis=1)
    return Motion(id, role, "swing", id, command, *no_dwells())


def read_trajectory(path: str | Path, id: str, role: schema.Role, rest: float) -> Motion:
    """The motion of a CSV file.

    Raises:
        InvalidTrajectory: The file cannot be read, or the robot cannot follow what it says.
    """
    where = Path(path).resolve()
    try:
        with open(where, newline="", encoding="utf-8") as file:
            header, *rows = [row for row in csv.reader(file) if row]
        names = [name.strip() for name in header]
        if sorted(names) != sorted(("t", *JOINTS)):
            raise InvalidTrajectory(f"columns are {', '.join(names)}; there must be t, {', '.join(JOINTS)}")
        values = np.array([[float(x) for x in row] for row in rows])
        columns = [names.index(name) for name in ("t", *JOINTS)]
        return trajectory(id, values[:, columns[0]], values[:, columns[1:]], role, rest)
    except OSError as error:
        raise InvalidTrajectory(f"{where}: cannot be read: {error.strerror}") from error
    except (InvalidTrajectory, ValueError, IndexError) as error:
        raise InvalidTrajectory(f"{where}: {error}") from error


def _check(t: np.ndarray, q: np.ndarray) -> None:
    """Refuse what is no trajectory, or beyond the nominal robot's limits."""
    if t.ndim != 1 or len(t) < 2 or q.shape != (len(t), len(JOINTS)):
        raise InvalidTrajectory(f"times {t.shape} and positions {q.shape} must be (n,) and (n, {len(JOINTS)}), n >= 2")
    if not (np.isfinite(t).all() and np.isfinite(q).all()):
        raise InvalidTrajectory("every number must be finite")
    step = np.diff(t)
    if (step <= 0.0).any():
        raise InvalidTrajectory(f"times must rise; after t = {t[np.argmax(step <= 0.0)]:g} s they do not")
    speed = np.abs(np.diff(q, axis=0)) / step[:, None]
    for j, name in enumerate(JOINTS):
        joint = mjcf.model().joint(name)
        (low, high), fastest = joint.range, float(joint.user[0])
        beyond = (q[:, j] < low - _SLACK) | (q[:, j] > high + _SLACK)
        if beyond.any():
            k = int(np.argmax(beyond))
            raise InvalidTrajectory(f"{name} is at {q[k, j]:g} at t = {t[k]:g} s; it goes from {low:g} to {high:g}")
        if (speed[:, j] > fastest + _SLACK).any():
            k = int(np.argmax(speed[:, j]))
            unit = "m/s" if name == TORSO else "rad/s"
            found = f"{name} moves at {speed[k, j]:.3g} {unit} after t = {t[k]:g} s"
            raise InvalidTrajectory(f"{found}; its limit is {fastest:g} {unit}")
