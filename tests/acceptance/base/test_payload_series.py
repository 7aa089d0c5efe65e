"""Row `full` with other loads in the hand than the calibration had, and while it is pushed, on several robots: slow.

The robots are those in the folder `payload` of the one that the environment variable CLAIM_RUNS names, runs
`payload_SEED` of scenario `payload`; where there are none, SEEDS are run, two minutes each.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from scenarios import load, run

pytestmark = pytest.mark.slow
SEEDS = 4474, 4475, 4476, 4477
WITHIN = 1.3  # of the error with the usual load
FAR = "half of the wheels slide, and how far is decided by a few newtons of their load: docs/limits.md"
BACK = "as a push ends arm_1's link swings back into its gap, on some robots through it: docs/limits.md"
OPEN = {("xyz_2kg", "plate"): FAR, ("push", "plate"): BACK}
if "CLAIM_RUNS" in os.environ:  # SEEDS hold this line, barely; the robots of the last series do not
    OPEN["push", "measured"] = BACK


@pytest.fixture(scope="module")
def errors(tmp_path_factory):
    """Of each robot: error [mm] by trial and base."""
    folder = Path(os.environ.get("CLAIM_RUNS") or tmp_path_factory.mktemp("runs")) / "payload"
    if not list(folder.glob("payload_*/evaluation.json")):
        for seed in SEEDS:
            run(load("payload", (f"seed={seed}",)), out=folder / f"payload_{seed}")
    return [_of(json.loads(path.read_text())) for path in sorted(folder.glob("payload_*/evaluation.json"))]


def _of(evaluation):
    rows = (r for r in evaluation["trials"] if (r["model"], r["encoder"]) == ("full", "motor"))
    return {(r["trial"], r["base"]): r["position_rmse_component_mm"] for r in rows}


@pytest.mark.parametrize("base", ["plate", "measured"])
@pytest.mark.parametrize("trial", ["xyz_0kg", "xyz_2kg", "push"])
def test_another_load_is_taken_into_account(errors, trial, base, claim, request):
    if (trial, base) in OPEN:
        request.applymarker(pytest.mark.xfail(reason=OPEN[trial, base], strict=True))
    found = np.array([of[trial, base] / of["xyz", base] for of in errors])
    claim(f"payload/{trial}/{base}", found)
    assert np.median(found) <= WITHIN


def test_inverse_dynamics_know_a_declared_load(errors, claim):
    found = np.array([of["xyz_0kg", "dynamics"] / of["xyz", "dynamics"] for of in errors])
    claim("payload/xyz_0kg/dynamics", found)
    assert np.median(found) <= WITHIN
