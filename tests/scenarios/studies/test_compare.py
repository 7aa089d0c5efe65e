"""Paired differences between two studies or two entries over the same robots."""

import json

import numpy as np
import pytest

from scenarios.datasets.index import Row, write_index
from scenarios.datasets.run_spec import Magnitude
from scenarios.files.errors import ScenarioError
from scenarios.studies.compare import compare


def study(folder, values, seed=1):
    folder.mkdir()
    rows = [Row(k, "ok", magnitudes=(Magnitude("model_2_mm", float(v)),)) for k, v in enumerate(values)]
    write_index(folder / "index.csv", [*rows, Row(len(rows), "failed", "no data")])
    (folder / "collection.json").write_text(json.dumps({"scenario": {"seed": seed}}))
    return folder


def scores(folder, values, entry="mine", **other):
    folder.mkdir()
    one = {"entry": entry, "task": "all", "main": True, "mm": 1.0, "deg": None, "again_mm": None, "zeros_mrad": None}
    figures = [one | {"robot": k, "mm": float(v)} | other for k, v in enumerate(values)]
    (folder / "scores.json").write_text(json.dumps({"benchmark": "bench-v1", "figures": figures}))
    return folder


@pytest.mark.parametrize("make, name", [(study, "model_2_mm"), (scores, "all_mm")])
def test_differences_are_paired_by_robot(tmp_path, make, name):
    rng = np.random.default_rng(1)
    robots = rng.uniform(1.0, 5.0, 40)  # differ far more than the two methods do
    gain = 0.1 + 0.02 * rng.normal(size=40)
    (found,) = compare([make(tmp_path / "a", robots), make(tmp_path / "b", robots - gain)])
    assert (found.figure, found.n) == (name, 40)
    assert found.difference.low < -0.1 < found.difference.high < 0.0
    assert found.difference.high - found.difference.low < 0.02
    assert found.smaller.value == 1.0


def test_intervals_contain_no_difference_at_their_rate(tmp_path):
    rng, inside = np.random.default_rng(2), 0
    for k in range(100):
        a, b = (rng.normal(size=12) for _ in range(2))
        (found,) = compare([study(tmp_path / f"a{k}", a), study(tmp_path / f"b{k}", b)])
        inside += found.difference.low < 0.0 < found.difference.high
    assert 88 <= inside <= 100


def test_what_cannot_be_paired_is_rejected(tmp_path):
    a = study(tmp_path / "a", [1.0, 2.0, 3.0])
    with pytest.raises(ScenarioError, match="two folders or more"):
        compare([a])
    with pytest.raises(ScenarioError, match="other robots than .*root seed 2, not root seed 1"):
        compare([a, study(tmp_path / "b", [1.0, 2.0], seed=2)])
    with pytest.raises(ScenarioError, match="other robots"):
        compare([a, scores(tmp_path / "c", [1.0, 2.0])])
    with pytest.raises(ScenarioError, match="no figure in common"):
        compare([a, study(tmp_path / "d", [1.0])])
    two = scores(tmp_path / "e", [1.0, 2.0])
    with pytest.raises(ScenarioError, match=r"has the entries \(none\)"):
        compare([two, scores(tmp_path / "f", [1.0], main=False)])
