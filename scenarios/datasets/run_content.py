"""What a run of a collection consists of."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios.datasets.run_spec import Magnitude, Produce
from scenarios.files.scenario import Scenario

if TYPE_CHECKING:
    from calibration.recording import Trial


def recordings_and_truth(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """dataset/, truth/ and the scenario with the run's own seed."""
    text = _scenario_of_seed_0(scenario.model_copy(update={"seed": 0}).model_dump_json())
    (out / "scenario.yaml").write_text(text.replace("\nseed: 0\n", f"\nseed: {scenario.seed}\n", 1), encoding="utf-8")
    return _record(scenario, out)


@lru_cache(maxsize=1)
def _scenario_of_seed_0(scenario: str) -> str:
    """A scenario file but for its seed, which is all that differs from run to run: YAML is slow to write."""
    from scenarios.files import yaml_file

    return yaml_file.text(Scenario.model_validate_json(scenario))


def recordings(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """dataset/ alone: no truth, no seed, no magnitude of a defect."""
    import shutil

    magnitudes = _record(scenario, out)
    shutil.rmtree(out / "truth")
    return magnitudes


def aligned_recordings_and_truth(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """As `recordings_and_truth`, and aligned/."""
    magnitudes = recordings_and_truth(scenario, out)
    _align(out)
    return magnitudes


def aligned_recordings(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """As `recordings`, and aligned/."""
    magnitudes = recordings(scenario, out)
    _align(out)
    return magnitudes


PRODUCE: dict[tuple[bool, bool], Produce] = {
    (False, False): recordings_and_truth,
    (False, True): aligned_recordings_and_truth,
    (True, False): recordings,
    (True, True): aligned_recordings,
}
"""What makes a run, by whether it is blind and whether it is aligned."""

_ALIGNED: dict[str, tuple[str, ...]] = {
    "t": ("t",),
    "q_motor": ("t", "joint"),
    "q_link": ("t", "joint"),
    "T_lab_base": ("t", "row", "column"),
    "T_lab_hand": ("t", "row", "column"),
    "plate_wrench": ("t", "plate", "wrench"),
}


def _align(out: Path) -> None:
    """Write aligned/<trial>.nc: every instrument at the motion capture's times, its clock estimated, not true."""
    import calibration
    from calibration.recording import netcdf

    dataset = calibration.load(out / "dataset")
    (out / "aligned").mkdir()
    for entry in dataset.description.trials:
        trial = dataset.trial(entry.id).aligned()
        sizes = {"t": len(trial.t), "joint": trial.q_motor.shape[1], "plate": trial.plate_wrench.shape[1]}
        with netcdf.created(out / "aligned" / f"{entry.id}.nc") as file:
            netcdf.add_dimensions(file, sizes | {"row": 4, "column": 4, "wrench": 6})
            for name, dims in _ALIGNED.items():
                kind = "f8" if name == "t" else "f4"
                netcdf.write_variable(file, name, getattr(trial, name), dims, kind, {"clock": "mocap"})


def _record(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    import twin

    seen: list[_Seen] = []
    twin.record(scenario.twin, scenario.seed, out, threads=1, watch=lambda trial: seen.append(_look(trial)))
    return _magnitudes(seen)


@dataclass(frozen=True)
class _Seen:
    """What a laboratory would look at first in a trial: its duration [s], and spans [m, N, N.m, rad]."""

    duration: float
    base: float
    force: float
    moment: float
    drive: float


def _look(trial: "Trial") -> _Seen:
    base = trial.marker_position[:, trial.markers_of("base")]
    wrench = trial.plate_wrench[:, :1].reshape(-1, 6)
    return _Seen(
        duration=float(np.ptp(trial.t_mocap)),
        base=_span(base.reshape(len(base), -1)),
        force=_span(wrench[:, :3]),
        moment=_span(wrench[:, 3:]),
        drive=float(np.nanmax(np.nanstd(trial.q_motor[:, 1:] - trial.q_link[:, 1:], axis=0))),
    )


def _magnitudes(seen: list[_Seen]) -> tuple[Magnitude, ...]:
    """Over all trials."""
    return (
        Magnitude("duration_s", round(sum(s.duration for s in seen), 6)),
        Magnitude("base_marker_span_mm", round(1e3 * max(s.base for s in seen), 6)),
        Magnitude("plate_force_span_N", round(max(s.force for s in seen), 6)),
        Magnitude("plate_moment_span_Nm", round(max(s.moment for s in seen), 6)),
        Magnitude("motor_minus_link_std_mrad", round(1e3 * max(s.drive for s in seen), 6)),
    )


def _span(x: np.ndarray) -> float:
    """Largest peak-to-peak of the columns of x (n, k); NaN where nothing was recorded."""
    if not x.size:
        return float("nan")
    return float(np.nanmax(np.nanmax(x, axis=0) - np.nanmin(x, axis=0)))
