"""The wrist's sensor weighs what hangs on it: exact without noise, within its interval with it; a load is reported."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binom

import mjcf
from calibration.errors import NotEnoughData, ShapeError
from calibration.mocap.postures import static_postures
from calibration.recording.clock import shared_clock
from calibration.recording.schema import Payload
from calibration.robot.chain import chain_of
from calibration.robot.hand import nominal_hand
from calibration.robot.laboratory import Laboratory
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.wrist_load import Hanging, expected_load, weigh, weighed
from tests.doubles import rigid_robot

G = np.array([0.0, 0.0, -9.81])
MASS, CENTRE = 1.7, np.array([0.01, -0.02, 0.11])
ZERO = np.array([4.0, -2.0, 7.0, 0.3, -0.1, 0.2])
LINK = "wrist_ft_link"


def wrenches(R, mass=MASS, centre=CENTRE):
    f = mass * np.swapaxes(R, 1, 2) @ G
    return np.concatenate([f, np.cross(centre, f)], axis=1) + ZERO


def rotations(n, seed=0):
    return Rotation.random(n, random_state=seed).as_matrix()


@pytest.mark.parametrize("off", [(0.0, 0.0), (0.1, 0.2)])
def test_without_noise_mass_and_centre_come_back_whatever_the_zeros_and_constant_turns(off):
    R = rotations(12)
    before, after = (Rotation.from_rotvec(a * np.array([0.6, -0.64, 0.48])).as_matrix() for a in off)
    found = weigh(before @ R @ after, wrenches(R), G)
    assert found.mass == pytest.approx(MASS, rel=1e-12)
    np.testing.assert_allclose(found.centre, CENTRE, atol=1e-12)
    assert (found.sigma < 1e-10).all()


@pytest.mark.parametrize("k", [10, 30])
def test_intervals_hold_the_truth_as_often_as_they_say(k):
    rng, n, z = np.random.default_rng(0), 300, []
    for seed in range(n):
        R = rotations(k, seed)
        turned = R @ Rotation.from_rotvec(0.01 * rng.normal(size=(k, 3))).as_matrix()  # postures known to 10 mrad
        w = wrenches(R) + rng.normal(size=(k, 6)) * [0.02, 0.02, 0.02, 1e-3, 1e-3, 1e-3]
        found = weigh(turned, w, G)
        of_centre = (found.centre - CENTRE) / found.centre_sigma
        z.append(np.r_[(np.r_[found.mass, found.moment] - np.r_[MASS, MASS * CENTRE]) / found.sigma, of_centre])
    held = (np.abs(z) <= 1.96).sum(axis=0)
    assert (held >= binom.ppf(0.001, n, 0.93)).all() and (held <= binom.ppf(0.999, n, 0.98)).all(), held


def test_postures_that_do_not_turn_the_sensor_against_gravity_are_refused():
    about = Rotation.from_rotvec(np.linspace(0.0, 3.0, 20)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    for R in (about, rotations(5)):
        with pytest.raises(NotEnoughData, match="hand up, down and on its side"):
            weigh(R, wrenches(R), G)
    with pytest.raises(ShapeError):
        weigh(rotations(8), np.zeros((8, 3)), G)


def test_the_drawing_is_all_mass_beyond_the_sensor_and_the_payload():
    description = rigid_robot.described()
    none = expected_load(Laboratory(mjcf.urdf(), description), LINK)
    model = pin.buildModelFromXML(mjcf.urdf())
    masses = {"wrist_ft_tool_link": 0.1, "gripper_link": 0.60266}
    fingers = sum(model.inertias[model.getJointId(f"gripper_{s}_finger_joint")].mass for s in ("left", "right"))
    assert none.mass == pytest.approx(sum(masses.values()) + fingers, abs=1e-9)
    load = Payload(link="gripper_grasping_frame", mass=0.5, com=(0.0, 0.0, 0.0), tolerance=0.05)
    more = expected_load(Laboratory(mjcf.urdf(), description.model_copy(update={"payload": load})), LINK).less(none)
    assert more.mass == pytest.approx(0.5)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    grasp, sensor = (data.oMf[model.getFrameId(n)] for n in (load.link, LINK))
    np.testing.assert_allclose(more.centre, sensor.actInv(grasp).translation, atol=1e-12)


def test_what_is_left_has_both_covariances():
    one, two = (Hanging(m, m * CENTRE, np.eye(4) * s) for m, s in ((2.0, 0.1), (0.5, 0.2)))
    left = one.less(two)
    assert left.mass == 1.5 and left.covariance[1, 1] == pytest.approx(0.3)
    np.testing.assert_allclose(left.centre, CENTRE)


def recorded(undeclared: float):
    """A tour of postures with the expected_load hand and some more at the gripper, the base level."""
    rng, description = np.random.default_rng(0), rigid_robot.described(wrist_link=LINK)
    motor, dwells = rigid_robot.through(rigid_robot.near_postures(rng, 25), dwell=0.6, move=0.5)
    truth = replace(rigid_robot.Truth(), robot=(0.0, 0.0))
    trial = rigid_robot.record(truth, motor, 0.0, rng, dwells)
    chain = chain_of(mjcf.urdf(), description)
    nominal = expected_load(Laboratory(mjcf.urdf(), description), LINK)
    R = chain.poses(trial.q_motor, LINK)[:, :3, :3]
    at = np.array([0.0, 0.02, 0.15])
    m = nominal.mass + undeclared
    w = wrenches(R, m, (nominal.moment + undeclared * at) / m) + 0.05 * rng.normal(size=(len(R), 6))
    hand = nominal_hand(chain, nominal_frames(chain, description))
    return description, replace(trial, wrist_wrench=w), hand


@pytest.mark.parametrize(("undeclared", "verdict", "words"), [
    (0.0, "ok", "nominal links and declared payload"),
    (0.8, "warning", "declare the other 0.8"),
    (-0.6, "warning", "is the declared payload in the hand"),
])  # fmt: skip
def test_a_load_nobody_declared_is_reported_with_what_to_declare(undeclared, verdict, words):
    description, trial, hand = recorded(undeclared)
    (said,) = weighed(
        Laboratory(mjcf.urdf(), description),
        [trial],
        shared_clock("robot"),
        hand,
        static_postures(description, [trial], shared_clock("robot")),
    )
    assert said.verdict == verdict and words in said.message and "25 postures" in said.message


def test_a_wrist_without_a_link_or_a_static_posture_is_said_not_to_be_used():
    description, trial, hand = recorded(0.0)
    nameless = description.model_copy(update={"wrist_link": None})
    moving = replace(trial, dwell_start=np.zeros(0), dwell_stop=np.zeros(0), approach=np.zeros((0, 8)))
    for one, t, words in ((nameless, trial, "wrist_link"), (description, moving, "no static posture")):
        (said,) = weighed(
            Laboratory(mjcf.urdf(), one),
            [t],
            shared_clock("robot"),
            hand,
            static_postures(description, [trial], shared_clock("robot")),
        )
        assert said.verdict == "missing" and words in said.message
    silent = replace(trial, wrist_wrench=np.full((len(trial.t_robot), 6), np.nan))
    assert (
        weighed(
            Laboratory(mjcf.urdf(), description),
            [silent],
            shared_clock("robot"),
            hand,
            static_postures(description, [trial], shared_clock("robot")),
        )
        == ()
    )


def test_what_a_finger_carries_is_weighed_once():
    masses = {"base": 5.0, "arm": 2.0, "sensor": 0.3, "tool": 1.0, "finger": 0.2, "tip": 0.05}
    links = "".join(
        f'<link name="{n}"><inertial><mass value="{m}"/><origin xyz="0 0 0.01"/>'
        '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for n, m in masses.items()
    )
    kinds = ["revolute", "fixed", "fixed", "prismatic", "fixed"]
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    joints = "".join(
        f'<joint name="{b}_joint" type="{kind}"><parent link="{a}"/><child link="{b}"/>'
        f'<origin xyz="0 0 0.1"/>{limit}</joint>'
        for kind, (a, b) in zip(kinds, pairwise(masses), strict=True)
    )
    found = expected_load(Laboratory(f'<robot name="r">{links}{joints}</robot>', rigid_robot.described()), "sensor")
    assert found.mass == pytest.approx(1.25)
    assert found.moment[2] == pytest.approx(1.0 * 0.11 + 0.2 * 0.21 + 0.05 * 0.31)
