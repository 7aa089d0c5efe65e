"""Speed, as ratios measured in one run: `make bench` prints them and keeps them."""

import time

import mujoco
import numpy as np
import pytest
from mujoco import rollout

import mjcf
import twin
from calibration import Compensator
from calibration import load as dataset
from calibration.mocap.cluster_pose import poses_of
from calibration.numerics.lie import from_vector, inverse, mean
from calibration.numerics.signals import interpolate_columns
from calibration.recording.trial import REST
from calibration.stages.drive_trains import stream_of
from scenarios import load, run, steps
from twin import motions
from twin.campaign import laboratory, measure
from twin.motions import VALIDATION_SWINGS
from twin.simulation import build, simulate
from twin.simulation.setpoints import prepare

_STEPS = 300  # of the compensator in the time of `reference`: two thirds of those it took when this was set


def seconds(function, repeats: int = 3) -> float:
    """Processor time of the fastest of some calls [s]."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


@pytest.mark.parametrize("name", ["humanoids2024", "unmodelled"])
def test_speed_of_the_twin(name, keep):
    scenario = load(name)
    lab = laboratory(scenario.twin, 0)
    path = VALIDATION_SWINGS["xyz"]
    motion = motions.swing("xyz", "validation", "swing", path, 20.0, scenario.twin.campaign)
    inputs = prepare(lab.twin, motion, lab.T_lab_base)
    model, first, control = inputs.model, inputs.first, inputs.control
    states = simulate(lab.twin, motion, lab.T_lab_base)
    bare = seconds(lambda: rollout.rollout(model, mujoco.MjData(model), first[None], control[None]))
    whole = seconds(lambda: simulate(lab.twin, motion, lab.T_lab_base))
    build_s = seconds(lambda: build(mjcf.spec(), lab.robot.defects, lab.twin.links))
    measure_s = seconds(lambda: measure(lab, motion, states, 100.0))
    figures = {
        "simulated_seconds_per_second_one_core": len(control) * model.opt.timestep / whole,
        "simulate_over_bare_rollout_speed": bare / whole,
        "steps_per_second": len(control) / bare,
        "model_build_ms": 1e3 * build_s,
        "instruments_seconds_per_simulated_minute": measure_s * 60.0 / motion.duration,
    }
    keep({f"{what}[{name}]": value for what, value in figures.items()})


def test_two_threads_against_one(tmp_path, keep):
    scenario = load("humanoids2024")

    def wall(threads: int) -> float:
        start = time.monotonic()
        twin.record(scenario.twin, scenario.seed, tmp_path / str(threads), threads=threads)
        return time.monotonic() - start

    keep({"record_two_threads_over_one": wall(1) / wall(2)})


def reference() -> None:
    """Work that no change of ours touches: what a machine does in it depends on the machine alone."""
    A, total = np.random.default_rng(0).normal(size=(150, 150)), 0.0
    for k in range(40):
        total += float(np.linalg.solve(A + k * np.eye(150), A)[0, 0]) + sum(i * 1e-6 for i in range(20000))
    assert np.isfinite(total)


@pytest.fixture(scope="module")
def short_run(tmp_path_factory):
    """A short run with all functions compiled, the processor time of another one, and of its calibration."""
    folder = tmp_path_factory.mktemp("bench")
    first = run(load("humanoids2024"), folder / "compiled", quick=True)
    whole = seconds(lambda: run(load("humanoids2024"), folder / "again", quick=True), 1)
    calibration = seconds(lambda: steps.calibrate(first.folder / "dataset", folder / "estimate"), 1)
    return first.folder, whole, calibration


def test_speed_of_a_run_and_its_calibration(short_run, keep):
    _, whole, calibration = short_run
    unit = seconds(reference)
    keep({"reference_s": unit, "run_over_reference": whole / unit, "calibrate_over_reference": calibration / unit})


def test_speed_of_the_compensator(short_run, keep):
    """One sample, drive trains and the base that slips included; the second half of a swing."""
    compensator = Compensator.load(short_run[0] / "estimate")
    data, (robot, plate) = dataset(short_run[0] / "dataset"), compensator.clocks
    trial = next(t for _, t in data.trials("validation") if len(t.t_robot) > 500)
    t, q, n = trial.t_robot, trial.q_motor, 500
    v, first = np.gradient(q, t, axis=0), trial.t_mocap <= trial.t_mocap[0] + REST
    seen = poses_of(data.description.base_body, trial).T[first]
    T = mean(seen) @ inverse(from_vector(compensator.hand.base))  # elsewhere than it stood, its wheels would lift off
    w = interpolate_columns(plate.from_mocap(robot.to_mocap(t)), trial.t_plate, trial.plate_wrench[:, 0])

    def walk(wrench: bool) -> None:
        before = None
        for k in range(n):
            before = compensator.step(t[k], q[k], w[k] if wrench else None, T, v[k], before).state

    def meshes() -> None:
        stream, a = stream_of(compensator.arm.trains), np.gradient(v, t, axis=0)
        state, _ = stream.begin(t[0], np.array([q[0], v[0], a[0]]))
        for k in range(1, n):
            state, _ = stream.step(state, t[k], np.array([q[k], v[k], a[k]]))

    for function in (lambda: walk(True), lambda: walk(False), meshes):
        function()
    unit, step = seconds(reference), seconds(lambda: walk(True), 5) / n
    figures = {
        "compensator_step_us": 1e6 * step,
        "compensator_steps_per_reference": unit / step,
        "compensator_step_without_wrench_us": 1e6 * seconds(lambda: walk(False), 5) / n,
        "drive_trains_step_us": 1e6 * seconds(meshes, 5) / n,
        "compensator_predict_us_per_sample": 1e6 * seconds(lambda: compensator.predict(t, q, w, T, v)) / len(t),
    }
    keep(figures)
    assert figures["compensator_steps_per_reference"] > _STEPS
