"""Files of the default campaign to an evaluation by two commands and two edited lines of a drafted mapping.

CSV files hold the very numbers of the dataset; C3D rounds to single precision, 0.1 um.
"""

import json
import re
from pathlib import Path

import pytest

from scenarios import steps
from scenarios.steps import import_export
from scenarios.steps.process import process

pytestmark = pytest.mark.slow

SHARE, LEAST = 0.01, 0.02  # [-], [mm]: six static postures carry rows of half a millimetre
STOPS = 0.1  # [mm], of row `full` at rest: a rounding lets a link that no load holds stop elsewhere in its gap
EDITS = (
    (r"# payload: (\{link: \w+), mass: 0.5,", r"payload: \1, mass: 0.437,"),
    (r"validation: \[\]", "validation: [postures_validation, xyz, xyz_mirror]"),
)


def errors(folder: Path) -> dict[tuple[str, ...], float]:
    """Position RMSE [mm] of every row."""
    rows = json.loads((folder / "evaluation.json").read_text())["rows"]
    keys = ("model", "base", "encoder", "trials")
    return {tuple(row[k] for k in keys): row["position_rmse_norm_mm"] for row in rows}


@pytest.fixture(scope="module", params=["short", "whole"])
def native(request, tmp_path_factory) -> Path:
    """The default campaign, and its short variant, processed from their own datasets."""
    folder, scenario = tmp_path_factory.mktemp("native"), steps.load("humanoids2024", ["seed=3"])
    steps.simulate(scenario.quick() if request.param == "short" else scenario, folder / "run")
    process(folder / "run/dataset", folder / "processed")
    return folder


@pytest.mark.parametrize("kinds", [("csv",), ("c3d", "bag")])
def test_files_give_the_errors_of_the_dataset(native, tmp_path, kinds):
    for kind in kinds:
        import_export.export_files(kind, native / "run/dataset", tmp_path / kind)
    files = [p for k in kinds for p in sorted((tmp_path / k).glob(f"*.{k}"))]
    files += [] if "csv" in kinds else [tmp_path / "c3d/markers.csv"]
    mapping = tmp_path / "lab.yaml"
    text = import_export.init_mapping(files, mapping)
    assert sum("# CHOOSE" in line for line in text.splitlines()) <= 3
    for pattern, line in EDITS:
        text, n = re.subn(pattern, line, text)
        assert n == 1
    mapping.write_text(text)
    assert process(mapping, tmp_path / "run").evaluated
    expected, found = errors(native / "processed"), errors(tmp_path / "run")
    assert found.keys() == expected.keys()
    least = {k: STOPS if k[0] == "full" and k[3] == "static" else LEAST for k in expected}
    off = {k: (found[k], e) for k, e in expected.items() if abs(found[k] - e) > max(SHARE * e, least[k])}
    assert off == {}
