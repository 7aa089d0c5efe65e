"""The base that sticks and slips, on robots that no method was developed on: the hand predicted without seeing it."""

import os
from pathlib import Path

import pytest

from tests.acceptance.base_lines import lines
from tests.acceptance.series import SAMPLED, series

pytestmark = pytest.mark.slow
SEEDS, MORE = range(1000, 1010), range(2000, 2020)
ROBOTS = {"fixed": ("humanoids2024", ()), "sampled": ("humanoids2024", SAMPLED), "jolts": ("jolts", ())}


@pytest.mark.parametrize("robots", ROBOTS)
def test_every_line_holds(robots, tmp_path_factory, claim):
    """Runs in the folder that CLAIM_RUNS names are read, not repeated; those of MORE only where they are there."""
    kept, (scenario, overrides) = os.environ.get("CLAIM_RUNS"), ROBOTS[robots]
    folder = Path(kept) / robots if kept else tmp_path_factory.mktemp(robots)
    there = [seed for seed in MORE if (folder / f"{scenario}_{seed}" / "score.json").is_file()]
    broken = []
    for line in lines(series(folder, (*SEEDS, *there), overrides, scenario).scores):
        claim(f"slip/{robots}/{line.name}", line.figures or (line.value,))
        if not line.holds:
            broken.append(line)
    assert not broken
