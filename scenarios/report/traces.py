"""evaluation.nc: the errors of each row in each trial, group model/base/encoder/trial."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from scenarios.errors import ScenarioError


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
        ScenarioError: The file cannot be read.
    """
    if not path.is_file():
        return ()
    try:
        with h5py.File(path, "r") as file:
            return tuple(_trace(names, group) for names, group in _leaves(file, ()))
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise ScenarioError(f"{path}: not as evaluate writes it ({error}); make it again with it") from error


def _leaves(group: h5py.Group, names: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], h5py.Group]]:
    if "position_error" in group:
        yield names, group
        return
    for name, child in group.items():
        if isinstance(child, h5py.Group):
            yield from _leaves(child, (*names, name))


def _trace(names: tuple[str, ...], group: h5py.Group) -> Trace:
    model, base, encoder, trial = names

    def mm(name: str) -> np.ndarray:
        return 1e3 * np.asarray(group[name][...], dtype=float)

    def deg(name: str) -> np.ndarray:
        return np.degrees(np.linalg.norm(np.asarray(group[name][...], dtype=float), axis=1))

    t = np.asarray(group["t"][...], dtype=float)
    scored_position, scored_angle = mm("scored_position_error"), deg("scored_rotation_error")
    good = np.isfinite(scored_position).all(axis=1) & np.isfinite(scored_angle)
    return Trace(
        model=model,
        base=base,
        encoder=encoder,
        trial=trial,
        kind=str(group.attrs["kind"]),
        t=t - t[:1],
        position=mm("position_error"),
        angle=deg("rotation_error"),
        scored_position=scored_position[good],
        scored_angle=scored_angle[good],
    )
