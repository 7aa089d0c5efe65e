"""A campaign in memory, and what a laboratory can do wrong to it: each spoils a copy."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calibration.mocap.cluster_pose import poses_of
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Body
from calibration.recording.trial import Trial, write_trial


@dataclass(frozen=True)
class Campaign:
    """A dataset in memory.

    Attributes:
        listed: dataset.json.
        urdf: nominal.urdf.
        trials: By id.
        bodies: Marker bodies by name, nominal ones of the good campaign.
        late: Epoch of the robot's clock on the motion capture's [s].
    """

    listed: dict
    urdf: str
    trials: dict[str, Trial]
    bodies: dict[str, Body]
    late: float

    @classmethod
    def of(cls, dataset: Dataset, late: float) -> "Campaign":
        """A good campaign; `late` [s] as its estimate has it."""
        listed = json.loads((dataset.folder / "dataset.json").read_text())
        trials = {entry.id: dataset.read(entry) for entry in dataset.description.trials}
        return cls(listed, dataset.urdf, trials, {b.name: b for b in dataset.description.bodies}, late)

    def ids(self, role: str) -> list[str]:
        return [entry["id"] for entry in self.listed["trials"] if entry["role"] == role]

    def part(self, role: str, share: float, clock: str = "t_mocap") -> dict[str, np.ndarray]:
        """By trial of a role, the samples after this share of that role's recording."""
        ids = self.ids(role)
        start, stop = (f(float(self.trials[i].t_mocap[k]) for i in ids) for f, k in ((min, 0), (max, -1)))
        moment = start + share * (stop - start) - (self.late if clock == "t_robot" else 0.0)
        return {i: getattr(self.trials[i], clock) > moment for i in ids}

    def changed(self, role: str, change: Callable[[Trial, str], Trial]) -> "Campaign":
        """With the trials of a role changed."""
        ids = self.ids(role)
        return replace(self, trials={i: change(t, i) if i in ids else t for i, t in self.trials.items()})

    def redrawn(self, change: Callable[[dict], None]) -> "Campaign":
        """With another dataset.json."""
        listed = json.loads(json.dumps(self.listed))
        change(listed)
        return replace(self, listed=listed)

    def written(self, folder: Path) -> Path:
        """The dataset folder."""
        (folder / "trials").mkdir(parents=True)
        listed = json.loads(json.dumps(self.listed))
        for entry in listed["trials"]:
            entry["sha256"] = write_trial(folder / entry["file"], self.trials[entry["id"]])
        (folder / "dataset.json").write_text(json.dumps(listed))
        (folder / "nominal.urdf").write_text(self.urdf)
        return folder


Spoil = Callable[[Campaign], Campaign]


def _readings(change: Callable[[np.ndarray, np.ndarray, Trial], None], role: str, share: float = 0.0) -> Spoil:
    """Change readings q (n, k) in place where the share of the recording has passed (n,)."""

    def spoil(c: Campaign) -> Campaign:
        rows = c.part(role, share, "t_robot")

        def of_trial(trial: Trial, name: str) -> Trial:
            q = trial.q_motor.copy()
            change(q, rows[name], trial)
            return replace(trial, q_motor=q)

        return c.changed(role, of_trial)

    return spoil


def gain(joint: int, by: float, role: str = "calibration") -> Spoil:
    return _readings(lambda q, rows, t: q.__setitem__((rows, joint), q[rows, joint] * (1.0 + by)), role, -1.0)


def slip(joint: int, by: float, share: float, role: str = "calibration") -> Spoil:
    return _readings(lambda q, rows, t: q.__setitem__((rows, joint), q[rows, joint] + by), role, share)


def drift(joint: int, by: float, role: str = "calibration") -> Spoil:
    def spoil(c: Campaign) -> Campaign:
        ids = c.ids(role)
        start, stop = (f(float(c.trials[i].t_robot[k]) for i in ids) for f, k in ((min, 0), (max, -1)))

        def of_trial(trial: Trial, name: str) -> Trial:
            q = trial.q_motor.copy()
            q[:, joint] += by * (trial.t_robot - start) / (stop - start)
            return replace(trial, q_motor=q)

        return c.changed(role, of_trial)

    return spoil


def commands(joints: list[int]) -> Spoil:
    def of_trial(trial: Trial, name: str) -> Trial:
        q = trial.q_motor.copy()
        q[:, joints] = trial.q_command[:, joints]
        return replace(trial, q_motor=q)

    return lambda c: c.changed("calibration", of_trial)


def commanded(lag: int = 8) -> Spoil:
    """Give every trial commands, as a log has them: ahead of the readings."""

    def of_trial(trial: Trial, name: str) -> Trial:
        return replace(trial, q_command=np.concatenate([trial.q_motor[lag:], np.tile(trial.q_motor[-1], (lag, 1))]))

    return lambda c: c.changed("calibration", of_trial)


def link(joint: int, change: Callable[[np.ndarray, Trial], np.ndarray], share: float = -1.0) -> Spoil:
    """Change what a joint's link encoder reads (n,), from a share of the recording on."""

    def spoil(c: Campaign) -> Campaign:
        rows = c.part("calibration", share, "t_robot")

        def of_trial(trial: Trial, name: str) -> Trial:
            q = trial.q_link.copy()
            q[:, joint] = np.where(rows[name], change(q[:, joint], trial), q[:, joint])
            return replace(trial, q_link=q)

        return c.changed("calibration", of_trial)

    return spoil


def wrapped(q: np.ndarray, at: float) -> np.ndarray:
    """Readings (n,) that are a turn less above `at` [rad]."""
    return np.where(q > at, q - 2.0 * np.pi, q)


def exchanged_sides(joints: list[int]) -> Spoil:
    def of_trial(trial: Trial, name: str) -> Trial:
        q, link = trial.q_motor.copy(), trial.q_link.copy()
        q[:, joints], link[:, joints] = trial.q_link[:, joints], trial.q_motor[:, joints]
        return replace(trial, q_motor=q, q_link=link)

    return lambda c: c.changed("calibration", of_trial)


def exchanged_columns(one: int, other: int) -> Spoil:
    """Every reading of a joint in the column of another."""

    def of_trial(trial: Trial, name: str) -> Trial:
        q, link = trial.q_motor.copy(), trial.q_link.copy()
        q[:, [one, other]], link[:, [one, other]] = q[:, [other, one]], link[:, [other, one]]
        return replace(trial, q_motor=q, q_link=link)

    return lambda c: c.changed("calibration", of_trial)


def late(by: float, share: float, role: str = "calibration") -> Spoil:
    def spoil(c: Campaign) -> Campaign:
        rows = c.part(role, share, "t_robot")
        return c.changed(role, lambda t, i: replace(t, t_robot=t.t_robot + by * rows[i]))

    return spoil


def scaled(by: float, role: str = "calibration") -> Spoil:
    return lambda c: c.changed(role, lambda t, i: replace(t, marker_position=t.marker_position * by))


def drawn_off(body: str, by: list[float], marker: int | None = None) -> Spoil:
    """One marker, or a whole body, drawn elsewhere by (3,) [m]."""

    def change(listed: dict) -> None:
        found = next(b for b in listed["bodies"] if b["name"] == body)
        for k, m in enumerate(found["markers"]):
            if marker is None or k == marker:
                m["xyz"] = [x + d for x, d in zip(m["xyz"], by, strict=True)]

    return lambda c: c.redrawn(change)


def moved(body: str, by: list[float], share: float, marker: int | None = None, role: str = "calibration") -> Spoil:
    """One marker, or a whole body of markers, moved on its link by (3,) [m] after a share of the recording."""

    def spoil(c: Campaign) -> Campaign:
        rows, markers = c.part(role, share), c.bodies[body].markers

        def of_trial(trial: Trial, name: str) -> Trial:
            chosen = [trial.marker.index(m.name) for k, m in enumerate(markers) if marker is None or k == marker]
            R = poses_of(c.bodies[body], trial).T[:, :3, :3]
            p = trial.marker_position.copy()
            p[:, chosen] += np.where(rows[name], 1.0, 0.0)[:, None, None] * (R @ np.array(by))[:, None]
            return replace(trial, marker_position=p)

        return c.changed(role, of_trial)

    return spoil


def shifted_dwells(by: float) -> Spoil:
    return lambda c: c.changed(
        "calibration", lambda t, i: replace(t, dwell_start=t.dwell_start + by, dwell_stop=t.dwell_stop + by)
    )


def plate_gain(by: float) -> Spoil:
    return lambda c: c.changed("calibration", lambda t, i: replace(t, plate_wrench=t.plate_wrench * by))


def validated_on_calibration(c: Campaign) -> Campaign:
    (first, *_), (other, *_) = c.ids("calibration"), c.ids("validation")
    return replace(c, trials=c.trials | {other: c.trials[first]})


def hidden(share: float, seconds: float, seed: int = 0) -> Spoil:
    """Markers out of view in blocks, each on its own, this share of the time; single frames where seconds is 0."""

    def spoil(c: Campaign) -> Campaign:
        rng = np.random.default_rng(seed)

        def of_trial(trial: Trial, name: str) -> Trial:
            p = trial.marker_position.copy()
            n = max(1, round(seconds / float(np.median(np.diff(trial.t_mocap)))))
            lost = rng.random((len(p) // n + 1, p.shape[1])) < share
            p[np.repeat(lost, n, axis=0)[: len(p)]] = np.nan
            p[trial.t_mocap < trial.t_mocap[0] + 1.0] = trial.marker_position[trial.t_mocap < trial.t_mocap[0] + 1.0]
            return replace(trial, marker_position=p)

        return c.changed("calibration", of_trial)

    return spoil


def ghosts(share: float, size: float, seed: int = 0) -> Spoil:
    """This share of all positions [m] elsewhere by `size`, each on its own."""

    def spoil(c: Campaign) -> Campaign:
        rng = np.random.default_rng(seed)

        def of_trial(trial: Trial, name: str) -> Trial:
            d = rng.normal(size=trial.marker_position.shape)
            d *= (rng.random(d.shape[:2]) < share)[..., None] * size / np.linalg.norm(d, axis=2, keepdims=True)
            return replace(trial, marker_position=trial.marker_position + d)

        return c.changed("calibration", of_trial)

    return spoil


def gone(body: str, marker: int, share: float) -> Spoil:
    """One marker out of view for a share of each trial."""

    def spoil(c: Campaign) -> Campaign:
        name = c.bodies[body].markers[marker].name

        def of_trial(trial: Trial, _: str) -> Trial:
            p = trial.marker_position.copy()
            n = len(p)
            p[n // 3 : n // 3 + int(share * n), trial.marker.index(name)] = np.nan
            return replace(trial, marker_position=p)

        return c.changed("calibration", of_trial)

    return spoil


def lost_readings(joint: int, share: float, length: float) -> Spoil:
    """Readings of a joint missing for a while [s], in the one trial this share of the recording lies in."""

    def spoil(c: Campaign) -> Campaign:
        rows = c.part("calibration", share, "t_robot")
        one = next(name for name, after in rows.items() if after.any())

        def of_trial(trial: Trial, name: str) -> Trial:
            q, first = trial.q_motor.copy(), int(np.argmax(rows[name])) + 200  # inside the trial
            q[first : first + int(length * 100) if name == one else first, joint] = np.nan
            return replace(trial, q_motor=q)

        return c.changed("calibration", of_trial)

    return spoil


def lost_plate(share: float, length: float) -> Spoil:
    def spoil(c: Campaign) -> Campaign:
        def of_trial(trial: Trial, name: str) -> Trial:
            w, n = trial.plate_wrench.copy(), len(trial.t_plate)
            w[int(share * n) : int(share * n) + int(length * n / 50.0)] = np.nan
            return replace(trial, plate_wrench=w)

        return c.changed("calibration", of_trial)

    return spoil
