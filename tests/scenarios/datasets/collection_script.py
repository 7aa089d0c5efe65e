"""A collection whose runs are a small file each, as a program of its own: to be killed, starved, and repeated.

python collection_script.py OUT N WORKERS SCHEDULER PRODUCE
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

from scenarios import load
from scenarios.datasets.collection import Plan, collect
from scenarios.datasets.run_spec import Magnitude
from scenarios.datasets.workers import NoRoom, Workers
from scenarios.files.errors import ScenarioError

SIZE = 200_000


def numbers(scenario, out):
    values = np.random.default_rng(scenario.seed).integers(0, 256, SIZE, dtype=np.uint8)
    (out / "dataset").mkdir()
    for k, part in enumerate(np.split(values, 4)):
        (out / "dataset" / f"{k}.bin").write_bytes(part.tobytes())
        time.sleep(0.01)
    return (Magnitude("mean", float(values.mean())),)


def numbers_or_worse(scenario, out):
    """Run 2 makes a mistake, run 4 takes its worker down."""
    kind = scenario.seed
    if kind == SEEDS[2]:
        raise ValueError("no such thing")
    if kind == SEEDS[4]:
        os._exit(1)
    return numbers(scenario, out)


SEEDS: list[int] = []


def main(out, n, workers, scheduler, produce):
    from scenarios.datasets.run_spec import seed_of

    scenario = load("humanoids2024")
    SEEDS[:] = [seed_of(scenario.seed, i) for i in range(int(n))]
    plan = Plan(scenario, int(n), Path(out), {"numbers": numbers, "worse": numbers_or_worse}[produce])
    who = Workers(int(workers), scheduler or None)
    try:
        collect(plan, who, lambda at, share: print(at, flush=True))
    except (ScenarioError, NoRoom) as error:
        sys.exit(f"{type(error).__name__}: {error}")


if __name__ == "__main__":
    main(*sys.argv[1:])
