"""A truth of another run is refused: other times, or a base elsewhere."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from scenarios.files.errors import ScenarioError
from scenarios.score.score import _check_same_run


def of_run(n: int = 50, start: float = 3.0, shift: float = 0.0) -> tuple[SimpleNamespace, SimpleNamespace]:
    t, T = 3.0 + np.arange(50) / 100.0, np.tile(np.eye(4), (50, 1, 1))
    true = np.tile(np.eye(4), (n, 1, 1))
    true[:, 0, 3] = shift
    recorded = SimpleNamespace(t=t, T_lab_B=T, trial_id="xyz")
    return recorded, SimpleNamespace(t_mocap=start + np.arange(n) / 100.0, base_pose=true)


@pytest.mark.parametrize("other", [{"n": 60}, {"start": 3.1}, {"shift": 0.005}])
def test_a_truth_of_another_run_is_refused(other):
    _check_same_run([of_run(shift=0.0005)], np.eye(4), Path("truth"))
    with pytest.raises(ScenarioError, match="was not recorded in that run"):
        _check_same_run([of_run(**other)], np.eye(4), Path("truth"))
