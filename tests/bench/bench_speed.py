"""Speed, as ratios measured in one run: `make bench` prints them and writes runs/bench.json."""

import time

import mujoco
import numpy as np
import pytest
from mujoco import rollout

import mjcf
import twin
from calibration import Compensator
from scenarios import load, run
from twin import motions
from twin.campaign import laboratory, measure
from twin.motions import VALIDATION_SWINGS
from twin.simulation import build, simulate
from twin.simulation.setpoints import prepare


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


def test_speed_of_the_compensator(tmp_path, keep):
    """One sample, joint models and suspension included: a robot's control loop has 10 ms, a mocap's 5."""
    result = run(load("humanoids2024"), tmp_path / "quick", quick=True)
    compensator = Compensator.load(result.folder / "estimate")
    rng, n = np.random.default_rng(0), len(compensator.hand.chain.measured)
    q, v = rng.uniform(-0.3, 0.3, (2000, n)), rng.uniform(-0.3, 0.3, (2000, n))
    w, T, t = rng.normal(size=(2000, 6)), np.eye(4), np.arange(2000) / 100.0

    def steps() -> None:
        before = None
        for k in range(500):
            before = compensator.step(t[k], q[k], w[k], T, v[k], before).base

    figures = {
        "compensator_step_ms": 1e3 * seconds(steps) / 500,
        "compensator_step_without_wrench_ms": 1e3
        * seconds(lambda: [compensator.step(0.0, q[k], velocity=v[k]) for k in range(500)])
        / 500,
        "compensator_predict_us_per_sample": 1e6 * seconds(lambda: compensator.predict(t, q, w, T, v)) / 2000,
    }
    keep(figures)
    assert figures["compensator_step_ms"] < 2.0
