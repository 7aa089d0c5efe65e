"""A small synthetic dataset: ten robots, a 20 s swing each."""

from pathlib import Path

from scenarios import load
from scenarios.commands import console
from scenarios.datasets.collection import Plan, collect
from scenarios.datasets.run_content import recordings_and_truth
from scenarios.datasets.workers import Workers

if __name__ == "__main__":
    plan = Plan(load("swing20"), 10, Path("runs/swing20"), recordings_and_truth)
    with console.progress() as progress:
        collect(plan, Workers(2), lambda at, share: progress("dataset", at, share))
