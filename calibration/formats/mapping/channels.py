"""What a laboratory file says, in SI units and our conventions, before it is a trial.

Every channel has its own clock, as the file has it. NaN only where a marker was not seen.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

Stem = Callable[[Path], str]


@dataclass(frozen=True)
class Markers:
    """Marker positions: t (n,) [s], names (m,), position (n, m, 3) [m]."""

    t: np.ndarray
    names: tuple[str, ...]
    position: np.ndarray


@dataclass(frozen=True)
class Joints:
    """Joint readings at t (n,) [s], each (n, k) in the order of `names`; NaN for what was not recorded.

    `wrist_wrench` (n, 6) [N, N.m] is the ACTION of the hand on the wrist's sensor; None where it was not recorded.
    """

    t: np.ndarray
    names: tuple[str, ...]
    q_motor: np.ndarray
    q_link: np.ndarray
    v_motor: np.ndarray
    effort: np.ndarray
    q_command: np.ndarray
    wrist_wrench: np.ndarray | None = None


@dataclass(frozen=True)
class Plates:
    """Wrenches at t (n,) [s]: (n, p, 6) [N, N.m], ACTION on the plate, lab axes, about `centre` (p, 3) [m, lab]."""

    t: np.ndarray
    names: tuple[str, ...]
    wrench: np.ndarray
    centre: np.ndarray


@dataclass(frozen=True)
class Means:
    """Static postures: q (n, k) by `joints`, position (n, m, 3) by `markers`, and their std [m].

    `std` is one number, or (m, 1).
    """

    joints: tuple[str, ...]
    q: np.ndarray
    markers: tuple[str, ...]
    position: np.ndarray
    std: float | np.ndarray


@dataclass(frozen=True)
class Recorded:
    """Everything the files of one trial hold.

    Attributes:
        file: The file, or the first of them, for messages.
        markers: None where they are in another file.
        joints: Likewise.
        plates: Likewise.
        means: Of a table of static postures, which has nothing else.
        dwells: (n, 2) start and stop of each dwell [s, mocap clock], None where the file does not say.
        together: Instruments (`robot`, `plate`) that were sampled together with the markers, on one clock.
        notes: What was recognised in the file.
    """

    file: str
    markers: Markers | None = None
    joints: Joints | None = None
    plates: Plates | None = None
    means: Means | None = None
    dwells: np.ndarray | None = None
    together: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def with_channels_of(self, other: "Recorded") -> "Recorded":
        """Both files' channels; `other` goes before."""
        return Recorded(
            self.file,
            other.markers or self.markers,
            other.joints or self.joints,
            other.plates or self.plates,
            other.means or self.means,
            other.dwells if other.dwells is not None else self.dwells,
            tuple(sorted({*self.together, *other.together})),
            (*self.notes, *other.notes),
        )

    def with_currents_turned(self, names: Sequence[str]) -> "Recorded":
        """With the other sign of the motor currents of these joints."""
        if self.joints is None:
            return self
        sign = np.where(np.isin(self.joints.names, names), -1.0, 1.0)
        return replace(self, joints=replace(self.joints, effort=sign * self.joints.effort))

    def timed(self) -> Iterator[tuple[str, np.ndarray]]:
        """Name and times of every channel group."""
        for name in ("markers", "joints", "plates"):
            group = getattr(self, name)
            if group is not None:
                yield name, group.t

    def shifted(self, by: float) -> "Recorded":
        """With `by` [s] added to every time."""
        groups = {name: replace(getattr(self, name), t=t + by) for name, t in self.timed()}
        dwells = None if self.dwells is None else self.dwells + by
        return replace(self, dwells=dwells, **groups)

    def part(self, start: float, stop: float) -> "Recorded":
        """What was recorded from `start` up to `stop` [s since the first sample of all], times unchanged."""
        first = min(t[0] for _, t in self.timed())
        groups = {}
        for name, t in self.timed():
            keep, group = (t - first >= start) & (t - first < stop), getattr(self, name)
            arrays = {k: v[keep] for k, v in vars(group).items() if k not in ("names", "centre") and v is not None}
            groups[name] = replace(group, **arrays)
        dwells = self.dwells
        if dwells is not None:
            dwells = dwells[(dwells[:, 0] - first >= start) & (dwells[:, 1] - first < stop)]
        return replace(self, dwells=dwells, **groups)


Read = Callable[[Sequence[Path]], Recorded]


@dataclass(frozen=True)
class Reader:
    """A format: how to read the files of one trial, and what of a file's name is the trial's."""

    read: Read
    stem: Stem
