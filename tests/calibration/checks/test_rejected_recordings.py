"""From a recording that cannot be what it says to the command's exit code: refused by name, and nothing to be used."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration import load_estimate
from calibration.recording.trial import Trial
from scenarios.commands import main
from tests.doubles.edited_dataset import rewritten

CALIBRATION = ("postures", "sweep1", "sweep2", "sweep4", "swing")


def read_on(axes: np.ndarray, trial: Trial) -> Trial:
    """The trial with forces and moments of the plate on other axes (3, 3)."""
    w = trial.plate_wrench
    return replace(trial, plate_wrench=np.concatenate([w[..., :3] @ axes.T, w[..., 3:] @ axes.T], axis=2))


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (-np.eye(3), "plate sign: Fz"),
        pytest.param(np.diag([-1.0, -1.0, 1.0]), "plate rotated by", marks=pytest.mark.slow),
    ],
    ids=["negated", "half a turn"],
)
def test_a_wrong_plate_is_refused_and_the_command_ends_with_1(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], axes: np.ndarray, said: str
) -> None:
    """Neither passes for a clock that is off by half a period."""
    copy = rewritten(folder, tmp_path / "dataset", dict.fromkeys(CALIBRATION, lambda t: read_on(axes, t)))
    with pytest.raises(SystemExit) as end:
        main.main(("calibrate", str(copy), "--out", str(tmp_path / "estimate"), "--stages", "registration,suspension"))
    printed = capsys.readouterr()
    assert end.value.code == 1 and "must not be used" in printed.err and said in printed.out
    found = load_estimate(tmp_path / "estimate")
    assert found.status == "not_calibrated" and found.suspension is None
    assert not {"calibrated.urdf", "zeros.yaml", "master_calibration.yaml"} & {
        p.name for p in (tmp_path / "estimate").iterdir()
    }
