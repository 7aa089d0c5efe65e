"""Several plates: what each feels, what they feel together, and where no wheel may stand."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.numerics.wrench import centre_of_pressure
from twin import motions
from twin.campaign import describe_dataset, laboratory, measure
from twin.errors import RobotFell
from twin.instruments.force_plate import PlateErrors
from twin.motions import CALIBRATION_SWINGS
from twin.simulation import simulate
from twin.simulation.force_plates import PlateGrid


def cut(config, grid, **instruments):
    return replace(config, instruments=replace(config.instruments, plate_grid=grid, **instruments))


@pytest.fixture(scope="module")
def motion(config):
    return motions.swing("swing", "calibration", "swing", CALIBRATION_SWINGS["x_fold"], 1.0, config.campaign)


@pytest.fixture(scope="module")
def lab(config):
    return laboratory(cut(config, (2, 1), plate=PlateErrors(gain=5e-3)), 0)


@pytest.fixture(scope="module")
def states(lab, motion):
    return simulate(lab.twin, motion, lab.T_lab_base)


def test_parts_add_up_to_the_whole(lab, states):
    w = states.plates
    lever = np.array([[-0.225, 0.0, 0.0], [0.225, 0.0, 0.0]])
    moment = w[..., 3:] + np.cross(lever, w[..., :3])
    together = np.concatenate([w[..., :3], moment], axis=2).sum(axis=1)
    np.testing.assert_allclose(together, states.wrench, atol=1e-9)
    assert states.wrench[0, 2] == pytest.approx(-729.9, abs=5.0)


def test_each_plate_bears_its_wheels_and_is_pressed_within_itself(states):
    assert (states.plates[:, :, 2] < -200.0).all()
    for k, x in enumerate((-0.225, 0.225)):
        cop = centre_of_pressure(states.plates[:, k], np.array([x, 0.0, 0.0]))
        assert np.sign(x) * cop[:, 0].min() > 0.0 and np.abs(cop[:, :2]).max() < 0.45


def test_cutting_the_plate_leaves_the_robot_s_motion_as_it_was(config, lab, states, motion):
    whole = simulate(laboratory(config, 0).twin, motion, lab.T_lab_base)
    np.testing.assert_allclose(whole.link, states.link, atol=1e-9)
    np.testing.assert_allclose(whole.wrench, states.wrench, atol=1e-6)
    np.testing.assert_array_equal(whole.plates[:, 0], whole.wrench)


def test_plates_are_recorded_declared_and_worn_each_for_itself(config, lab, states, motion):
    trial, _ = measure(lab, motion, states, 100.0)
    declared = describe_dataset(cut(config, (2, 1)), ()).plates
    assert trial.plate == tuple(p.name for p in declared) == ("plate1", "plate2")
    np.testing.assert_allclose(trial.plate_centre, [p.centre for p in declared])
    assert all(p.size == (0.45, 0.9) for p in declared)
    gains = {p.name: p.value for e in lab.instruments for p in e.parameters() if "gain_33" in p.name}
    for k, name in enumerate(trial.plate):
        ratio = trial.plate_wrench[:500, k, 2].mean() / states.plates[:500, k, 2].mean()
        assert ratio == pytest.approx(gains[f"plate.{name}.gain_33"], abs=3e-4)


def test_a_wheel_on_a_seam_is_refused(config, motion):
    lab = laboratory(cut(config, (1, 2)), 0)
    T_lab_base = lab.T_lab_base.copy()
    T_lab_base[1, 3] = 0.45  # heading along y, the axle of the drive wheels is then on the seam
    with pytest.raises(RobotFell, match="is on a seam of plate_grid"):
        simulate(lab.twin, motion, T_lab_base)


def test_columns_and_rows_fill_the_square():
    tiles = PlateGrid((2, 3)).cut(0.9, 0.6)
    assert [t.name for t in tiles] == [f"plate{k}" for k in range(1, 7)]
    assert sum(t.size[0] * t.size[1] for t in tiles) == pytest.approx(0.54)
    np.testing.assert_allclose(tiles[1].shift, [0.225, -0.2])
    np.testing.assert_allclose(np.mean([t.shift for t in tiles], axis=0), 0.0, atol=1e-12)


def test_anchored_wheels_and_several_plates_exclude_each_other(config):
    with pytest.raises(ValueError, match="plate_grid"):
        replace(cut(config, (2, 1)), base=replace(config.base, wheels="anchored"))
