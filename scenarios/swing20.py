"""A small synthetic dataset: ten robots, a 20 s swing each."""

from pathlib import Path

from scenarios import console, load
from scenarios.collection.collect import Plan, collect
from scenarios.collection.engine import Workers
from scenarios.collection.produce import recordings_and_truth

if __name__ == "__main__":
    plan = Plan(load("swing20"), 10, Path("runs/swing20"), recordings_and_truth)
    with console.progress() as progress:
        collect(plan, Workers(2), lambda at, share: progress("dataset", at, share))
