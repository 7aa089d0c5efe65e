"""A plate turned, raised and shifted: what it feels, in which axes it errs, how it is declared, and where it ends."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import calibrate, load
from tests.calibration.formats.test_exporter import exported, largest, run
from twin import motions
from twin.base_tests import load_test
from twin.campaign import describe_dataset, laboratory, measure, record
from twin.errors import RobotFell
from twin.instruments import force_plate
from twin.instruments.force_plate import PlateErrors
from twin.motions import CALIBRATION_SWINGS
from twin.simulation import simulate
from twin.simulation.force_plates import PlatePlace

YAW = np.radians(25.0)
PLACE = PlatePlace((0.03, -0.02), 0.005, YAW)
R = np.array([[np.cos(YAW), -np.sin(YAW), 0.0], [np.sin(YAW), np.cos(YAW), 0.0], [0.0, 0.0, 1.0]])


def laid(config, place=PLACE, **instruments):
    return replace(config, instruments=replace(config.instruments, plate_place=place, **instruments))


@pytest.fixture(scope="module")
def motion(config):
    return motions.swing("swing", "calibration", "swing", CALIBRATION_SWINGS["x_fold"], 1.0, config.campaign)


@pytest.fixture(scope="module")
def turned(config, motion):
    lab = laboratory(laid(config), 0)
    return lab, simulate(lab.twin, motion, lab.T_lab_base)


def test_the_robot_does_on_it_what_it_does_on_the_nominal_one(lab, motion, turned):
    plain, (there, states) = simulate(lab.twin, motion, lab.T_lab_base), turned
    np.testing.assert_allclose(states.link, plain.link, atol=1e-9)
    shift, w = np.array([*PLACE.shift, 0.0]), states.wrench
    about_the_nominal_centre = np.hstack([w[:, :3], w[:, 3:] + np.cross(shift, w[:, :3])])
    np.testing.assert_allclose(about_the_nominal_centre, plain.wrench, atol=1e-6)
    assert there.T_lab_base[2, 3] == PLACE.height
    np.testing.assert_allclose(load_test(there.twin)[0], load_test(lab.twin)[0], rtol=1e-4, atol=1.0)


def test_it_is_declared_and_recorded_where_it_lies(config, turned, motion):
    lab, states = turned
    (declared,) = describe_dataset(laid(config), ()).plates
    np.testing.assert_allclose(np.transpose(declared.axes), R, atol=1e-12)
    np.testing.assert_allclose(declared.centre, [0.93, 0.43, 0.005], atol=1e-12)
    trial, _ = measure(lab, motion, states, 100.0)
    np.testing.assert_allclose(trial.plate_centre, [declared.centre])


def test_tiles_are_turned_with_the_whole(config, motion, turned):
    lab = laboratory(laid(config, plate_grid=(2, 1)), 0)
    states = simulate(lab.twin, motion, lab.T_lab_base)
    centres = np.array([p.centre for p in describe_dataset(laid(config, plate_grid=(2, 1)), ()).plates])
    np.testing.assert_allclose(centres[1] - centres[0], R @ [0.45, 0.0, 0.0], atol=1e-12)
    lever = centres - [0.93, 0.43, 0.005]
    w = states.plates
    together = np.concatenate([w[..., :3], w[..., 3:] + np.cross(lever, w[..., :3])], axis=2).sum(axis=1)
    np.testing.assert_allclose(together, turned[1].wrench, atol=1e-6)


def test_it_counts_in_steps_along_its_own_axes(config, motion, turned):
    coarse = laboratory(laid(config, plate=PlateErrors(force_resolution=2.0)), 0)
    trial, _ = measure(coarse, motion, turned[1], 100.0)
    steps = trial.plate_wrench[:, 0, :3] @ R / 2.0
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_gains_act_in_the_plate_s_axes():
    worn = force_plate.PlateDefect("p", np.diag([1.5, 1, 1, 1, 1, 1]), np.zeros(6), np.zeros(6), 0.0)
    t = np.arange(200) * 1e-3
    along = np.concatenate([R[:, 0], R[:, 1]])  # force along the plate's x, moment along its y
    at = force_plate.Sampling(t[50:150], 0.0, 1000.0, np.zeros(6), R)
    seen = force_plate.measured(at, t, np.tile(along, (200, 1)), worn, np.random.default_rng(0))
    np.testing.assert_allclose(seen, np.tile(along * np.repeat([1.5, 1.0], 3), (100, 1)), atol=1e-12)


def test_a_wheel_off_a_turned_plate_is_reported_though_it_would_be_on_the_nominal_one(config, motion):
    """A robot near the right corner of the square: turned by 45 deg the square ends before it."""
    corner = replace(config, base=replace(config.base, pose=(1.1, 0.65, -1.6)))
    on = laboratory(laid(corner, PlatePlace()), 0)
    simulate(on.twin, motion, on.T_lab_base)
    off = laboratory(laid(corner, PlatePlace(yaw=np.pi / 4.0)), 0)
    with pytest.raises(RobotFell, match=r"is off the plate at -2\.00 s"):
        simulate(off.twin, motion, off.T_lab_base)


def test_a_wheel_on_the_seam_of_a_turned_plate_is_refused(config, motion):
    along_y = laid(config, PlatePlace(yaw=np.pi / 2.0), plate_grid=(2, 1))
    lab = laboratory(replace(along_y, base=replace(config.base, pose=(0.92, 0.45, -np.pi / 2.0))), 0)
    with pytest.raises(RobotFell, match="is on a seam of plate_grid"):
        simulate(lab.twin, motion, lab.T_lab_base)


@pytest.mark.slow
def test_a_campaign_on_turned_plates_goes_out_as_c3d_comes_back_and_calibrates_the_same(config, tmp_path):
    only = ("postures", "x_fold")
    short = replace(config.campaign, calibration_swing=4.0, calibration_postures=1, only=only)
    errors = PlateErrors(gain=2e-3)
    record(replace(laid(config, plate_grid=(2, 1), plate=errors), campaign=short), 0, tmp_path / "twin")
    source, extra = tmp_path / "twin/dataset", []
    for kind in ("c3d", "bag"):
        files, out = exported(source, tmp_path / kind, kind), tmp_path / f"{kind}_dataset"
        run("import", kind, *files, "--map", tmp_path / kind / "mapping.yaml", "--out", out, *extra)
        extra = ["--add-to", out]
    assert largest(source, out, ("plate_wrench", "plate_centre"))["plate_wrench"] < 1e-4
    native, back = (calibrate(load(folder), ["clocks", "suspension"]).suspension for folder in (source, out))
    assert native is not None and back is not None
    pairs = [(p, q) for p, q in zip(native.parameters, back.parameters, strict=True) if p.status == "estimated"]
    assert pairs and all(abs(p.value - q.value) < 0.05 * p.sigma for p, q in pairs)
