"""A continuous recording of a hand with one marker: its rests, as means, where the clock is the markers' own."""

import numpy as np

from calibration import calibrate, load
from calibration.numerics.signals import play
from tests.calibration.formats.test_csv import HAND, JOINTS, static_mapping, write_csv
from tests.doubles import rigid_robot

ONE = {"gripper0": HAND["gripper0"]}


def moving(n: int, sigma: float = 1e-4) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns at 20 Hz through n postures, one marker of the hand in the base body's frame, and the dwells (n, 2)."""
    rng, truth = np.random.default_rng(3), rigid_robot.defects(1)
    motor, dwells = rigid_robot.through(rigid_robot.near_postures(rng, n))
    motor = motor[::25]
    T = rigid_robot.hand_in_base(truth, play(motor, truth.half_gap))
    p = np.array(rigid_robot.BODIES["gripper"][1])[0] @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, :3, 3]
    p = p + sigma * rng.normal(size=p.shape)
    columns = {"t": np.arange(len(motor)) / 20.0}
    columns |= {name: (motor + truth.offset)[:, j] for j, name in enumerate(rigid_robot.JOINTS)}
    return columns | dict(zip(ONE["gripper0"], p.T, strict=True)), dwells


def one_marker(dwells: np.ndarray | None, kind: str = "static"):
    found = static_mapping(markers=ONE, time={"column": "t", "unit": "s"})
    del found["csv"][0]["marker_std"]
    found["bodies"][1]["undrawn"] = list(ONE)
    found["trials"][0] |= {"kind": kind} | ({} if dwells is None else {"dwells": dwells.tolist()})
    return found


def test_rests_of_a_hand_with_one_marker_are_calibrated_as_means(lab):
    columns, dwells = moving(34)
    columns["gripper0_x"][(columns["t"] > dwells[2, 0]) & (columns["t"] < dwells[2, 1])] = np.nan
    lab.run(one_marker(dwells), write_csv(lab.folder / "postures.csv", columns))
    dataset = load(lab.out)
    ((_, means),) = dataset.means("calibration")
    inside = (columns["t"] > dwells[5, 0] + 0.3) & (columns["t"] < dwells[5, 1] - 0.3)
    np.testing.assert_allclose(means.q_motor[5], [columns[j][inside].mean() for j in JOINTS], atol=1e-9)
    np.testing.assert_allclose(means.marker_position[5, 0, 1], columns["gripper0_y"][inside].mean(), atol=1e-4)
    assert np.isnan(means.marker_position[2]).any() and len(means) == 34
    assert 0.5 < means.marker_position_std[5, 0, 0] / (1e-4 / np.sqrt(12.0)) < 2.0  # a dozen samples a rest
    estimate = calibrate(dataset)
    assert estimate.calibrated and estimate.model("model_2").rank == 33
    assert "from 33 postures" in " ".join(v.message for v in estimate.verdicts if v.stage == "geometry")


def test_a_hand_with_one_marker_is_refused_in_motion_and_with_too_few_rests(lab, capsys):
    columns, dwells = moving(3)
    file = write_csv(lab.folder / "postures.csv", columns)
    for described, why in (
        (one_marker(dwells, "swing"), "a hand of 1 markers is used at rest only"),
        (one_marker(None), "2 postures show the hand; 6 are needed"),
    ):
        reported = " ".join(lab.refused(capsys, described, file).split())
        assert why in reported
