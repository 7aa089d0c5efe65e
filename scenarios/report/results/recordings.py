"""What was recorded: of each trial its duration and its rates, without reading its signals."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibration.recording import Description, TrialEntry, netcdf
from scenarios.report.results.formatting import fixed, significant


@dataclass(frozen=True)
class Recorded:
    """One trial.

    Attributes:
        entry: As dataset.json has it.
        duration: [s]; None in a file of means.
        postures: Number of dwells.
        rates: Median sampling rate of each clock, `robot`, `mocap`, `plate` [Hz].
    """

    entry: TrialEntry
    duration: float | None
    postures: int
    rates: dict[str, float]


def recorded(path: Path, entry: TrialEntry) -> Recorded:
    """Read the clocks of a trial.

    Raises:
        InputError: The file cannot be read.
    """
    with netcdf.opened(path) as file:
        names = [name for name in ("robot", "mocap", "plate") if f"t_{name}" in file.variables]
        clocks = {name: netcdf.array(file, f"t_{name}") for name in names}
        postures = file.dimensions["posture"].size if "posture" in file.dimensions else 0
    clocks = {name: t for name, t in clocks.items() if len(t) > 1}
    t = clocks.get("mocap", clocks.get("robot"))
    return Recorded(
        entry,
        None if t is None else float(t[-1] - t[0]),
        postures,
        {name: float(1.0 / np.median(np.diff(t))) for name, t in clocks.items()},
    )


def instruments(description: Description, trials: Sequence[Recorded]) -> dict[str, str]:
    """Each instrument in words: rates of the first trial, declared noise."""
    rates = {name: f"{fixed(rate, 0)} Hz" for name, rate in trials[0].rates.items()} if trials else {}
    sigmas, n_link = description.sigmas, sum("link" in joint.encoders for joint in description.joints)
    bodies = ", ".join(f"{len(body.markers)} markers on {body.link}" for body in description.bodies)
    marker = f"sigma {significant(1e3 * sigmas.marker)} mm per axis"
    found = {
        "encoders": f"motor side of {len(description.joints)} joints, link side of {n_link}, "
        f"{rates.get('robot', 'means')}, sigma {significant(1e6 * sigmas.encoder)} µrad",
        "motion capture": f"{bodies}, {rates.get('mocap', 'means')}, {marker}",
    }
    if description.plates:
        noise = f"sigma {significant(sigmas.plate_force)} N and {significant(sigmas.plate_moment)} N·m per axis"
        found["force plate"] = f"{rates.get('plate', 'not recorded')}, {noise}"
    load = description.payload
    found["payload"] = f"{significant(load.mass)} kg on {load.link}, as declared" if load else "none"
    return found
