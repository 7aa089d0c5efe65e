"""evaluation.nc: the errors of each row in each trial, group model/base/encoder/trial."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration.recording import netcdf

PUSH = "push"
"""Part of the name of a motion in which the hand is pushed."""


@dataclass(frozen=True)
class Trace:
    """Errors of one row in one trial, predicted minus measured, lab axes.

    Attributes:
        model: Row of the ladder.
        base: Where the base's motion comes from.
        encoder: Which side of the gear was read.
        trial: The trial.
        kind: Its kind.
        t: (n,) [s from the trial's start].
        position: (n, 3) [mm], NaN where unknown.
        angle: (n,) [deg], NaN where unknown.
        scored_position: (m, 3) [mm], those that count.
        scored_angle: (m,) [deg], those that count.
    """

    model: str
    base: str
    encoder: str
    trial: str
    kind: str
    t: np.ndarray
    position: np.ndarray
    angle: np.ndarray
    scored_position: np.ndarray
    scored_angle: np.ndarray


def read_traces(path: Path) -> tuple[Trace, ...]:
    """Read the errors; none where there is no file.

    Raises:
        InputError: The file cannot be read.
    """
    if not path.is_file():
        return ()
    with netcdf.opened(path, "make it again with evaluate") as file:
        return tuple(_trace(names, group) for names, group in _leaves(file, ()))


def _leaves(group: netcdf.Group, names: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], netcdf.Group]]:
    if "position_error" in group.variables:
        yield names, group
    for name, child in group.groups.items():
        yield from _leaves(child, (*names, name))


def _trace(names: tuple[str, ...], group: netcdf.Group) -> Trace:
    model, base, encoder, trial = names

    def mm(name: str) -> np.ndarray:
        return 1e3 * netcdf.array(group, name)

    def deg(name: str) -> np.ndarray:
        return np.degrees(np.linalg.norm(netcdf.array(group, name), axis=1))

    t = netcdf.array(group, "t")
    scored_position, scored_angle = mm("scored_position_error"), deg("scored_rotation_error")
    good = np.isfinite(scored_position).all(axis=1) & np.isfinite(scored_angle)
    return Trace(
        model=model,
        base=base,
        encoder=encoder,
        trial=trial,
        kind=str(group.kind),
        t=t - t[:1],
        position=mm("position_error"),
        angle=deg("rotation_error"),
        scored_position=scored_position[good],
        scored_angle=scored_angle[good],
    )
