"""What a run of a collection consists of."""

from pathlib import Path

import numpy as np

from scenarios.collection.order import Magnitude
from scenarios.schema import Scenario


def recordings_and_truth(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """dataset/, truth/ and the scenario with the run's own seed."""
    from scenarios import yaml_file

    yaml_file.write(out / "scenario.yaml", scenario)
    return _record(scenario, out)


def recordings(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    """dataset/ alone: no truth, no seed, no magnitude of a defect."""
    import shutil

    magnitudes = _record(scenario, out)
    shutil.rmtree(out / "truth")
    return magnitudes


def _record(scenario: Scenario, out: Path) -> tuple[Magnitude, ...]:
    import twin

    twin.record(scenario.twin, scenario.seed, out, threads=1)
    return _magnitudes(out / "dataset")


def _magnitudes(dataset: Path) -> tuple[Magnitude, ...]:
    """What a laboratory would look at first, over all trials."""
    import calibration

    opened = calibration.load(dataset)
    trials = [opened.read(entry) for entry in opened.description.trials]
    base = max(_span(t.marker_position[:, t.markers_of("base")].reshape(len(t.t_mocap), -1)) for t in trials)
    force = max(_span(t.plate_wrench[:, 0, :3]) for t in trials)
    moment = max(_span(t.plate_wrench[:, 0, 3:]) for t in trials)
    drive = max(float(np.nanmax(np.nanstd(t.q_motor[:, 1:] - t.q_link[:, 1:], axis=0))) for t in trials)
    duration = sum(float(np.ptp(t.t_mocap)) for t in trials)
    return (
        Magnitude("duration_s", round(duration, 6)),
        Magnitude("base_marker_span_mm", round(1e3 * base, 6)),
        Magnitude("plate_force_span_N", round(force, 6)),
        Magnitude("plate_moment_span_Nm", round(moment, 6)),
        Magnitude("motor_minus_link_std_mrad", round(1e3 * drive, 6)),
    )


def _span(x: np.ndarray) -> float:
    """Largest peak-to-peak of the columns of x (n, k)."""
    return float(np.nanmax(np.nanmax(x, axis=0) - np.nanmin(x, axis=0)))
