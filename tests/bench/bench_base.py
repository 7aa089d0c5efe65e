"""What the base that sticks and slips costs on one core: identified in the default campaign, predicted, a sample."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import calibration
from calibration.numerics.lie import from_vector
from calibration.prediction.predict import predictor
from calibration.stages.stick_slip import fit_stick_slip, planar_forcing, wrenches_of
from calibration.stages.stick_slip.poses import forced
from calibration.stages.stick_slip.stream import Sample, slip_stream
from calibration.stages.suspension.base_response import WrenchSources, laboratory
from calibration.stages.suspension.rest_frame import rest_of
from scenarios import load, steps
from tests.bench.bench_speed import seconds

SAMPLES = 2000


def sources_of(run: Path) -> WrenchSources:
    """Instruments of a calibrated run."""
    dataset, estimate = calibration.load(run / "dataset"), calibration.load_estimate(run / "estimate")
    T_base_B = from_vector(predictor(estimate, dataset).bundled.hand.base)
    clocks = estimate.clock("robot"), estimate.clock("plate")
    return laboratory(dataset.urdf, dataset.description, *clocks, T_base_B)


def identification(run: Path) -> Callable[[], object]:
    """The base's, of a calibrated run of the default scenario."""
    dataset, sources = calibration.load(run / "dataset"), sources_of(run)
    trials = [trial for _, trial in dataset.trials("calibration")]
    suspension = calibration.load_estimate(run / "estimate").suspension
    return lambda: fit_stick_slip(sources, trials, suspension)


def first(run: Path, cache: Path) -> float:
    """Processor time of the first identification on a machine, its loops compiled [s]."""
    command = [sys.executable, "-m", "tests.bench.bench_base", str(run)]
    found = subprocess.run(command, env=os.environ | {"NUMBA_CACHE_DIR": str(cache)}, capture_output=True, check=True)
    return float(found.stdout)


def figures(run: Path) -> dict[str, float]:
    """Of a calibrated run of the default scenario."""
    dataset, estimate = calibration.load(run / "dataset"), calibration.load_estimate(run / "estimate")
    model, sources = estimate.bundle.stick_slip, sources_of(run)
    seen = next(trial for entry, trial in dataset.trials("validation") if entry.kind == "swing")
    at = rest_of(dataset.description, seen, sources.T_base_B).T_lab_0
    wrenches = wrenches_of(sources, seen, at)
    forcing, stream = planar_forcing(wrenches, model.tilting, "plate"), slip_stream(model)
    w = np.column_stack(
        [forcing.drive[::2, 8:10], -forcing.drive[::2, 3], -forcing.drive[::2, 5], forcing.drive[::2, 4]]
    )
    w, M = np.column_stack([w, forcing.drive[::2, 10]]), forcing.inertia[:, :6]
    swayed = np.stack([forcing.heave, np.zeros_like(forcing.heave)], axis=1)
    rows = [Sample(forcing.t[k], w[k], swayed[k], np.concatenate([forcing.drive[2 * k, :3], M[k]]))
            for k in range(SAMPLES)]  # fmt: skip

    def walk() -> None:
        before = None
        for row in rows:
            before = stream.stepped(row, before)

    def whole() -> None:
        model.predict(forced(model, wrenches_of(sources, seen, at), "plate", None))

    for function in (walk, whole):
        function()
    lasts = float(seen.t_mocap[-1] - seen.t_mocap[0])
    return {
        "base_identification_s": seconds(identification(run), 1),
        "base_prediction_times_real_time": lasts / seconds(whole),
        "base_step_us": 1e6 * seconds(walk) / SAMPLES,
    }


def test_cost_of_the_base(tmp_path, keep):
    scenario = load("humanoids2024")
    steps.simulate(scenario, tmp_path / "run")
    steps.calibrate(tmp_path / "run/dataset", tmp_path / "run/estimate")
    found = figures(tmp_path / "run")
    keep(found | {"base_identification_first_s": first(tmp_path / "run", tmp_path / "cache")})
    assert found["base_identification_s"] <= 8.0
    assert found["base_prediction_times_real_time"] >= 200.0
    assert found["base_step_us"] <= 50.0


if __name__ == "__main__":
    print(seconds(identification(Path(sys.argv[1])), 1))
