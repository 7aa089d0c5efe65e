"""What must never be called calibrated: posture means of a robot with play, each spoilt one way, by the command."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import Compensator, calibrate, load
from calibration.errors import NotCalibrated
from calibration.recording.posture_means import PostureMeans
from scenarios.commands.main import main
from tests.calibration.recording.test_posture_means import dataset, means
from tests.doubles import rigid_robot

GAPS = np.array([0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 12.0, 10.0]) * 1e-3


def good() -> PostureMeans:
    some = means(rigid_robot.defects(3), 37)
    return replace(some, q_motor=some.q_motor + np.random.default_rng(5).uniform(-1.0, 1.0, size=(37, 8)) * GAPS)


def rows(some: PostureMeans, chosen) -> PostureMeans:
    names = ("q_motor", "marker_position", "marker_position_std", "approach")
    return replace(some, **{name: getattr(some, name)[chosen] for name in names})


def thrice(some: PostureMeans) -> PostureMeans:
    again = rows(some, np.repeat(np.arange(3), 12))
    rng = np.random.default_rng(1)
    p = again.marker_position + 1e-4 * rng.normal(size=again.marker_position.shape)
    return replace(again, q_motor=again.q_motor + 1e-4 * rng.normal(size=(36, 8)), marker_position=p)


def turned(some: PostureMeans) -> PostureMeans:
    p, rng = some.marker_position, np.random.default_rng(2)
    centre = p.mean(axis=1, keepdims=True)
    R = np.array([rigid_robot.se3(np.r_[np.zeros(3), v])[:3, :3] for v in rng.uniform(-2.0, 2.0, size=(len(p), 3))])
    return replace(some, marker_position=(p - centre) @ R + centre)


def readings(some: PostureMeans, order) -> PostureMeans:
    return replace(some, q_motor=some.q_motor[:, order])


SPOILT = {
    "markers in mm": (lambda m: replace(m, marker_position=1e3 * m.marker_position), "millimetres"),
    "joints in degrees": (
        lambda m: replace(m, q_motor=np.hstack([m.q_motor[:, :1], np.degrees(m.q_motor[:, 1:])])),
        "degrees",
    ),
    "3 postures": (lambda m: rows(m, np.arange(3)), "3 distinct postures"),
    "3 postures 12 times": (thrice, "3 distinct postures"),
    "broken orientations": (turned, "scatter|contradict|explain|belief"),
    "mirrored frame": (lambda m: replace(m, marker_position=m.marker_position * [1.0, -1.0, 1.0]), "mirror"),
    "arm_2 and arm_3 exchanged": (lambda m: readings(m, [0, 1, 3, 2, 4, 5, 6, 7]), "limits|scatter|exceeds|order"),
    "arm_6 and arm_7 exchanged": (lambda m: readings(m, [0, 1, 2, 3, 4, 5, 7, 6]), "limits|scatter|exceeds|order"),
    "joints reversed": (lambda m: readings(m, [0, 7, 6, 5, 4, 3, 2, 1]), "limits|scatter|exceeds|order"),
}


def judged(folder, capsys) -> str:
    """Exit code 1, no calibrated file, and what is said."""
    with pytest.raises(SystemExit) as left:
        main(["calibrate", str(folder), "--out", str(folder / "e")])
    assert left.value.code == 1
    assert not (folder / "e" / "calibrated.urdf").exists()
    with pytest.raises(NotCalibrated):
        Compensator.load(folder / "e")
    return capsys.readouterr().out


def test_what_is_spoilt_below_is_calibrated_when_it_is_not(tmp_path):
    assert calibrate(load(dataset(tmp_path / "d", {"calibration": good()}))).calibrated


@pytest.mark.parametrize("what", SPOILT)
def test_spoilt_recordings_are_never_calibrated(tmp_path, capsys, what):
    spoil, words = SPOILT[what]
    said = judged(dataset(tmp_path / "d", {"calibration": spoil(good())}), capsys)
    assert "refused" in said
    assert any(word in said for word in words.split("|")), said


def test_a_tool_frame_on_another_link_is_never_calibrated(tmp_path, capsys):
    body = rigid_robot.description([])["bodies"][1] | {"link": "arm_5_link"}
    base = {"name": "base", "link": "base_footprint", "markers": []}
    folder = dataset(tmp_path / "d", {"calibration": good()}, tool_frame="arm_5_link", bodies=[base, body])
    assert "refused" in judged(folder, capsys)
