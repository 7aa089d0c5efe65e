"""The public log of a real robot on a force plate, by one command: fitted to its first 28 s, predicted to its end.

The bounds are those of the whole log's acceptance: 2.0 mm at a hand 0.8 m ahead, 0.65 mm in steady cycles left out.
"""

import csv
import json
from pathlib import Path

import pytest

from scenarios.commands.main import main

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("log") / "base"
    log, mapping = ROOT / "tests/data/vicon_forceplate_2023-09-20.csv", ROOT / "docs/mappings/vicon_forceplate.yaml"
    with pytest.raises(SystemExit) as ended:
        main(["base", str(log), "--map", str(mapping), "--fit", "28", "--steady", "24.5", "--out", str(folder)])
    assert ended.value.code == 0
    return folder


def test_what_follows_the_fit_is_predicted(out, claim):
    found = json.loads((out / "base_motion.json").read_text())["scores"]
    for part, what in {"predicted": "after 28 s", "left-out cycles": "steady cycles, each left out"}.items():
        claim(f"reality/base/{what}/hand [mm]", 1e3 * found[part]["hand"])
        claim(f"reality/base/{what}/hand, a base at rest [mm]", 1e3 * found[part]["still"])
        claim(f"reality/base/{what}/yaw R2 about its mean", found[part]["yaw_r2_about_mean"])
    assert found["predicted"]["hand"] < 2.0e-3 < 0.5 * found["predicted"]["still"]
    assert found["predicted"]["yaw_r2_about_mean"] >= 0.75
    assert found["left-out cycles"]["hand"] < 0.65e-3
    assert found["left-out cycles"]["yaw_r2_about_mean"] >= 0.80


def test_every_sample_is_written(out):
    with (out / "base_motion.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3364
    assert set(rows[0]) >= {"t", "rz_measured", "rz_predicted", "rz_band_95"}
