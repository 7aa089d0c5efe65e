"""The recipe of CONTRIBUTING.md for a row of the ladder is carried out in a copy of the calibration."""

from calibration import save_estimate
from tests.project.recipes import copied, insert, recipe, run_script

EVALUATE = """
import json, sys
from pathlib import Path
from calibration import evaluate, load, load_estimate
evaluate(load_estimate("estimate"), load(sys.argv[1])).save(Path("evaluated"))
found = json.loads(Path("evaluated/evaluation.json").read_text())
new = [row for row in found["rows"] if row["model"] == "model_2_elastic"]
assert {row["base"] for row in new} >= {"fixed", "measured"}
assert {row["trials"] for row in new} == {"dynamic", "static", "all"}
compared = [c for c in found["comparisons"] if c["b"][0] == "model_2_elastic"]
assert compared and {c["a"][0] for c in compared} == {"model_2"}
"""


def test_a_row_of_the_ladder_is_one_entry(estimate, folder, tmp_path):
    rows = copied(tmp_path, "calibration") / "calibration/estimate/rows.py"
    insert(rows, '    LadderRow(\n        "model_3",\n', f"    {recipe('row').strip()},\n")
    save_estimate(estimate, tmp_path / "estimate")
    run_script(tmp_path, EVALUATE, str(folder))
