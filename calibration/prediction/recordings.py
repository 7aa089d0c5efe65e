"""Recordings as arrays on one clock, for programs that have no stages of their own.

    T_base_hand    pose of the hand's marker body in the base's, as stated in dataset.json
    nominal(q)     the same by the datasheet: T_base_hand = F_base nominal(q - zeros) F_hand, both F near the identity

Clocks are estimated as by stage `clocks`; postures are means over the dwells.
"""

from dataclasses import dataclass, field, fields
from functools import cached_property, reduce
from pathlib import Path

import numpy as np

from calibration import recording
from calibration.errors import InputError, NotEnoughData
from calibration.mocap.labels import relabelled_trial, relabelled_trials
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import Postures, mean_postures, readings_at, static_postures
from calibration.numerics.signals import interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.dataset import Dataset
from calibration.recording.schema import Role
from calibration.robot.hand import nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.stages.clocks.stage import synchronise
from calibration.stages.frames.base_rests import MOVES


@dataclass(frozen=True)
class AlignedTrial:
    """A trial at the motion capture's times; NaN where an instrument has nothing near.

    Attributes:
        t: (m,) [s, mocap clock].
        q_motor: (m, n_joints) motor-side readings [rad, m].
        q_link: (m, n_joints) link-side readings [rad, m].
        T_lab_base: (m, 4, 4) marker body of the base.
        T_lab_hand: (m, 4, 4) marker body of the hand.
        plate_wrench: (m, n_plates, 6) [N, N.m], action on the plate, lab axes, about plate_centre.
    """

    t: np.ndarray
    q_motor: np.ndarray
    q_link: np.ndarray
    T_lab_base: np.ndarray
    T_lab_hand: np.ndarray
    plate_wrench: np.ndarray


@dataclass(frozen=True)
class RecordedTrial(MeasuredTrial):
    """A trial with the clocks of its dataset."""

    clocks: tuple[Clock, ...] = field(kw_only=True)

    def aligned(self) -> AlignedTrial:
        """All instruments at the motion capture's times.

        Raises:
            NotEnoughData: No encoder readings, or a marker body is not recorded.
        """
        clock = {c.instrument: c for c in self.clocks}
        if "robot" not in clock or not len(self.t_robot):
            raise NotEnoughData(f"{self.id}: no joint readings on a known clock")
        q, link = (readings_at(self, clock["robot"], self.t_mocap, x) for x in (self.q_motor, self.q_link))
        wrench = np.full((len(self.t_mocap), self.plate_wrench.shape[1], 6), np.nan)
        if "plate" in clock and len(self.t_plate):
            at, flat = clock["plate"].from_mocap(self.t_mocap), self.plate_wrench.reshape(len(self.t_plate), -1)
            wrench = interpolate_columns(at, self.t_plate, flat, np.nan).reshape(wrench.shape)
        return AlignedTrial(self.t_mocap, q, link, self.base.T, self.hand.T, wrench)


@dataclass(frozen=True)
class Recordings(Dataset):
    """A dataset folder whose instruments are brought to one clock on demand."""

    def postures(self, role: Role = "calibration") -> Postures:
        """Static postures of a role: `q` (n, n_joints) [rad, m], `T_base_hand` (n, 4, 4), `covariance` (n, 6, 6).

        Raises:
            NotEnoughData: None shows base and hand.
        """
        return static(self, role, self.clocks)

    def trial(self, name: str) -> RecordedTrial:
        """One continuous trial, exchanged marker labels corrected.

        Raises:
            InputError: There is none of that name.
        """
        entries = {e.id: e for e in self.description.trials}
        if name not in entries:
            raise InputError(self.folder, f"no trial {name!r}; there are {', '.join(entries)}")
        read = relabelled_trial(self, entries[name])
        values = {f.name: getattr(read, f.name) for f in fields(MeasuredTrial)}
        return RecordedTrial(**values, clocks=self.clocks)

    def nominal(self, q: np.ndarray) -> np.ndarray:
        """Datasheet's T_base_hand (n, 4, 4) at readings q (n, n_joints) [rad, m]; NaN where a reading is."""
        T, known = np.full((len(q), 4, 4), np.nan), np.isfinite(q).all(axis=1)
        T[known] = nominal_hand(self._lab.chain, self._lab.nominal_frames).poses(q[known])
        return T

    @cached_property
    def _lab(self) -> Laboratory:
        return Laboratory(self.urdf, self.description)

    @cached_property
    def clocks(self) -> tuple[Clock, ...]:
        """Of the instruments, from the calibration trials in which the base stays; none without such a trial."""
        trials = tuple(t for entry, t in relabelled_trials(self, "calibration") if entry.kind not in MOVES)
        return synchronise(self._lab, trials)[0] if trials else ()


def load(folder: Path | str) -> Recordings:
    """Open a dataset folder.

    Raises:
        InputError: Something is missing or malformed; all findings of dataset.json at once.
    """
    found = recording.load(folder)
    return Recordings(found.folder, found.description, found.urdf)


def clocks_of(dataset: Dataset) -> tuple[Clock, ...]:
    """Clocks of the instruments, estimated once for an opened folder."""
    known = isinstance(dataset, Recordings)
    return dataset.clocks if known else Recordings(dataset.folder, dataset.description, dataset.urdf).clocks


def static(dataset: Dataset, role: Role, clocks: tuple[Clock, ...]) -> Postures:
    """Static postures of a role: means of files, and over the dwells of continuous trials.

    Raises:
        NotEnoughData: None shows base and hand.
    """
    found = [mean_postures(dataset.description, m) for _, m in dataset.means(role)]
    trials = [t for entry, t in relabelled_trials(dataset, role) if entry.kind not in MOVES and len(t.dwell_start)]
    robot = next((c for c in clocks if c.instrument == "robot"), None)
    if robot is not None and trials:
        found.append(static_postures(dataset.description, trials, robot))
    if not found:
        raise NotEnoughData(f"no static {role} posture shows base and hand")
    return reduce(Postures.joined, found)
