"""What hangs on the wrist's sensor, weighed by readings that Pinocchio makes of other links and another payload."""

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import mjcf
from calibration.estimate.plain_values import plain, restored
from calibration.recording.schema import Description
from calibration.robot.laboratory import Laboratory, floating_model
from calibration.robot.wrist_sensor import wrist_sensor
from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.hung_load import (
    HungLoad,
    hand_on_floor,
    hand_on_joints,
    hung_load,
    inertial_tolerance,
)
from calibration.stages.drive_trains.stage import fit_drive_trains
from calibration.stages.drive_trains.torques import dynamics, inertial_tolerances
from tests.doubles import joint_data, rigid_robot

LINK, MASS = "wrist_ft_link", 0.437
PAYLOAD = {"link": "gripper_grasping_frame", "mass": MASS, "com": [0.0, 0.0, 0.0], "tolerance": 0.02}
RATE = 50.0
T = np.arange(0.0, 60.0, 1.0 / RATE)
OFFSET = np.array([0.0, 4e-3, -3e-3, 4e-3, -4e-3, 0.106, 0.024, 0.027])
LINKS = np.array([0.02, 5e-3, -7e-3, 4e-3])  # [kg, kg.m] what the links differ by
CENTRE = np.array([-8e-3, 12e-3, 5e-3])  # [m] where the payload is
ZERO = np.array([3.0, -1.0, 2.0, 0.1, 0.2, 0.0])


def described(*payloads):
    """A campaign whose trials carry other payloads; None: the campaign's."""
    entries = [
        {
            "id": f"trial{k}", "role": "calibration", "kind": "swing", "motion": "swing", "file": f"trials/{k}.nc",
            "sha256": 64 * "0", "payload": mass,
        }
        for k, mass in enumerate(payloads)
    ]  # fmt: skip
    return Description.model_validate(rigid_robot.description(entries, wrist_link=LINK, payload=PAYLOAD))


def angles(seed):
    """(n, 8) of a swing."""
    rng = np.random.default_rng(seed)
    phase, rate = rng.uniform(0.0, 6.0, size=8), rng.uniform(0.1, 0.25, size=8)
    return rigid_robot.CENTRE + [0.02, *7 * [0.6]] * np.sin(2.0 * np.pi * rate * T[:, None] + phase)


def hand_loads(description, weighed, q, w):
    at = mjcf.urdf(), description, weighed, T[: len(q)], q, w
    return hand_on_joints(*at), hand_on_floor(*at)


def readings(description, q, payload, push=0.0):
    """(n, 6) of the sensor: what accelerates and holds all that hangs on it, in its axes."""
    loaded = description.carrying(payload)
    model, bare = (floating_model(mjcf.urdf(), d) for d in (loaded, loaded.carrying(0.0)))
    extra = LINKS + loaded.payload.mass * np.append(0.0, CENTRE)
    sensor = model.getFrameId(LINK)
    hung = nominal(loaded).toDynamicParameters()
    hung[:4] += extra
    hung, place = pin.Inertia.FromDynamicParameters(hung), model.frames[sensor].placement
    data, root = bare.createData(), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    order = [bare.idx_qs[bare.getJointId(joint)] - 7 for joint in rigid_robot.JOINTS]
    v = np.gradient(q, 1.0 / RATE, axis=0)
    a = np.gradient(v, 1.0 / RATE, axis=0)
    found = []
    for k in range(len(q)):
        x, dx, ddx = np.zeros(8), np.zeros(8), np.zeros(8)
        x[order], dx[order], ddx[order] = q[k], v[k], a[k]
        still = np.zeros(6)
        pin.forwardKinematics(bare, data, np.r_[root, x], np.r_[still, dx], np.r_[still, ddx])
        joint = bare.njoints - 1
        fall = pin.Motion(data.oMi[joint].rotation.T @ np.array(description.gravity), np.zeros(3))
        motion = data.v[joint]
        force = hung * (data.a[joint] - fall) + motion.cross(hung * motion)
        found.append(-place.actInv(force).vector)
    outside = np.outer((T > 8.0) & (T < 12.0), [0.0, push, 0.0, 0.0, 0.0, 0.0])
    return np.array(found) + ZERO + outside


def nominal(description):
    """Inertia of what hangs on the sensor by the nominal robot, axes of the last body."""
    tree = wrist_sensor(mjcf.urdf(), description).tree
    m, c = tree.mass[-1], tree.moment[-1] / tree.mass[-1]
    return pin.Inertia(m, c, tree.inertia[-1] + m * pin.skewSquare(c, c))


def trials(description):
    """Trials of a campaign, motors read with their zeros."""
    made = []
    for k, entry in enumerate(description.trials):
        q = angles(k)
        one = joint_data.recorded(entry.id, q + OFFSET, np.zeros_like(q))
        made.append(replace(one, t_robot=T, wrist_wrench=readings(description, q, entry.payload)))
    return made


@pytest.fixture(scope="module")
def weighed():
    description = described(None, 0.0, 1.5)
    return hung_load(mjcf.urdf(), description, OFFSET, trials(description))


def test_links_and_the_payloads_centre_are_told_apart_by_other_payloads(weighed):
    np.testing.assert_allclose(weighed.links, LINKS, atol=1e-3)  # shrunk to the nominal ones by the prior
    np.testing.assert_allclose(weighed.centre, CENTRE, atol=1e-3)
    off = np.append(weighed.links - LINKS, weighed.centre - CENTRE)
    assert off @ np.linalg.solve(weighed.covariance, off) < 14.1


def test_of_one_payload_the_sum_is_known_and_not_its_parts():
    description = described(None)
    found = hung_load(mjcf.urdf(), description, OFFSET, trials(description))
    np.testing.assert_allclose(found.added(MASS), LINKS + MASS * np.append(0.0, CENTRE), atol=3e-4)
    sigma, lever = np.sqrt(np.diag(found.uncertain)), 0.15  # [m] of the hand: along it a mass is a moment
    assert sigma[1:3].max() < 1.2e-3 and sigma[3] < np.hypot(1.2e-3, lever * sigma[0])
    assert np.sqrt(np.diag(found.covariance))[1:].min() > 2e-3


def test_a_hand_that_sags_in_its_gaps_does_not_carry_its_weight_aside():
    """Links of arm_5 to arm_7 are 12 mrad from their motors, to the side to which gravity draws them."""
    description = described(None)
    (one,) = trials(description)
    side = np.sign(Laboratory(mjcf.urdf(), description).gravity_torques(one.q_motor - OFFSET)) * (np.arange(8) > 4)
    found = hung_load(mjcf.urdf(), description, OFFSET, [replace(one, q_motor=one.q_motor + 12e-3 * side)])
    np.testing.assert_allclose(found.added(MASS)[1:3], (LINKS + MASS * np.append(0.0, CENTRE))[1:3], atol=1e-4)


def test_what_was_weighed_loads_the_joints(weighed):
    """As inverse dynamics by Pinocchio of a robot with these masses."""
    description, q = described(None), angles(7)[:1]
    robot = dynamics(mjcf.urdf(), description, np.zeros(8), weighed)
    rest = np.zeros_like(q)
    found, *_ = robot.evaluated(q, rest, rest, None)
    model = floating_model(mjcf.urdf(), description)
    true = model.inertias[-1].toDynamicParameters()
    true[:4] += LINKS + MASS * np.append(0.0, CENTRE)
    model.inertias[-1] = pin.Inertia.FromDynamicParameters(true)
    x = pin.neutral(model)
    for joint, value in zip(rigid_robot.JOINTS, q[0], strict=True):
        x[model.idx_qs[model.getJointId(joint)]] = value
    held = pin.rnea(model, model.createData(), x, np.zeros(model.nv), np.zeros(model.nv))
    expected = [held[model.idx_vs[model.getJointId(joint)]] for joint in rigid_robot.JOINTS]
    np.testing.assert_allclose(found[0], expected, atol=5e-3)


def test_a_payload_that_no_trial_had_is_weighed_where_it_is_carried():
    """Calibrated with one payload: of another the sensor tells where it is, to the joints as well."""
    description = described(None)
    known = hung_load(mjcf.urdf(), description, OFFSET, trials(description))
    other, q = description.carrying(2.0), angles(5)
    push, floor = hand_loads(other, known, q, readings(description, q, 2.0))
    assert not push.outside and not floor.outside  # the band of a pushed base is not that of one that carries more
    robot = dynamics(mjcf.urdf(), other, np.zeros(8), known)
    true = dynamics(mjcf.urdf(), other, np.zeros(8), replace(known, links=LINKS, centre=CENTRE))
    bare, loaded, expected = (r.loads("", T, q, push=p).torque for r, p in ((robot, None), (robot, push), (true, None)))
    middle = slice(100, -100)
    assert np.abs(bare - expected)[middle].max() > 0.1
    np.testing.assert_allclose(loaded[middle], expected[middle], atol=0.02)


@pytest.mark.parametrize("push", [0.0, 20.0])
def test_what_hangs_on_a_link_behind_its_motor_is_weighed_there(push):
    """arm_6 lies on one side of a wide gap: at its motor's angle the hand would lean."""
    description = described(None)
    known = hung_load(mjcf.urdf(), description, OFFSET, trials(description))
    other, q = description.carrying(2.0), angles(5)
    robot = dynamics(mjcf.urdf(), other, np.zeros(8), known)
    gap = DriveTrain("arm_6_joint", "dead_zone", np.array([12e-3, 1e-6, 0.0, 0.0, 1e-3, 0.0, 0.0]), start=(1.0, 0.0))
    of = DriveTrains(robot, (replace(gap, dynamic=False),), mjcf.urdf(), other, known)
    links = of.likely(robot.loads("", T, q))
    assert np.median(np.abs(links - q)[:, 6]) > 11e-3
    w = readings(other, links, 2.0, push=push)
    true = dynamics(mjcf.urdf(), other, np.zeros(8), replace(known, links=LINKS, centre=CENTRE))
    pushed = hand_on_joints(mjcf.urdf(), other, known, T, links, w) if push else None
    expected = (robot if push else true).loads("", T, links, push=pushed).torque
    found = of.loads("", T, q, None, w)
    at_motors = robot.loads("", T, q, push=hand_on_joints(mjcf.urdf(), other, known, T, q, w))
    still = np.delete(np.arange(100, len(T) - 100), slice(250, 650))  # a push that begins at once is filtered
    left, before = (
        np.median(np.abs(x.behind(q - links).torque - expected)[still, 1:], axis=0) for x in (found, at_motors)
    )
    assert left.sum() < 0.3 * before.sum(), (left, before)


def test_the_campaigns_payload_is_not_weighed_again_and_a_push_is_one(weighed):
    description, q = described(None), angles(5)
    w = readings(description, q, None)
    joints, moves = hand_loads(description, weighed, q, w)
    assert joints is None and not moves.outside
    assert hand_loads(description, weighed, q, np.full_like(w, np.nan)) == (None, None)
    short = slice(0, 100)
    assert hand_loads(description.carrying(2.0), weighed, q[short], w[short]) == (None, None)
    pushed, floor = hand_loads(description, weighed, q, readings(description, q, None, push=20.0))
    assert pushed.outside and floor.outside
    outside = pushed.wrench[:, :3] - moves.wrench[:, :3]
    assert np.linalg.norm(outside[500]) == pytest.approx(20.0, abs=0.5) and np.linalg.norm(outside[250]) < 0.5


def test_nothing_is_weighed_without_a_sensor_or_beside_a_push(weighed):
    description = described(None)
    (one,) = trials(description)
    none = description.model_copy(update={"wrist_link": None})
    assert hung_load(mjcf.urdf(), none, OFFSET, [one]) is None
    q = angles(0)
    pushed = replace(one, wrist_wrench=readings(description, q, None, push=20.0))
    assert hung_load(mjcf.urdf(), description, OFFSET, [pushed]) is None
    assert (
        hung_load(mjcf.urdf(), description, OFFSET, [replace(one, wrist_wrench=np.full((len(T), 6), np.nan))]) is None
    )


def test_what_was_weighed_is_no_longer_as_wide_as_the_links_tolerance(weighed):
    robot = dynamics(mjcf.urdf(), described(None), np.zeros(8), weighed)
    wide, narrow = (inertial_tolerances(robot, 0.1, 0.01, of) for of in (None, weighed))
    last = slice(4 * 7, 4 * 8)
    assert (np.diag(narrow)[last] < 0.5 * np.diag(wide)[last]).all()
    np.testing.assert_array_equal(
        np.delete(narrow, range(28, 32), 0)[:, :28], np.delete(wide, range(28, 32), 0)[:, :28]
    )
    assert np.linalg.eigvalsh(narrow).min() > -1e-15
    body = robot.model.inertias[-1].toDynamicParameters()[:4] - weighed.nominal - weighed.added(MASS)
    np.testing.assert_allclose(narrow[last, last], inertial_tolerance(body, 0.1, 0.01) + weighed.uncertain, atol=1e-15)


def test_what_is_added_is_linear_in_the_payload():
    found = HungLoad(LINKS, CENTRE, np.eye(7), 1.0, np.zeros(4))
    np.testing.assert_allclose(found.added(2.0) - found.added(0.0), np.append(0.0, 2.0 * CENTRE))
    model = Laboratory(mjcf.urdf(), described(None)).floating.copy()
    before = model.inertias[-1].toDynamicParameters()
    found.on(model, 2.0)
    np.testing.assert_allclose(model.inertias[-1].toDynamicParameters()[:4] - before[:4], found.added(2.0), atol=1e-12)


def test_what_tolerances_do_not_let_expect_is_not_used_and_said():
    """A sensor that reads three fifths of what hangs on it."""
    description = described(None)
    (one,) = trials(description)
    hand = joint_data.hand()
    likely, found, _ = fit_drive_trains(mjcf.urdf(), description, [one], joint_data.ROBOT, hand)
    assert likely.hung is not None and not any("sensor carries" in v.message for v in found)
    scaled = replace(one, wrist_wrench=0.6 * one.wrist_wrench)
    unlikely, found, _ = fit_drive_trains(mjcf.urdf(), description, [scaled], joint_data.ROBOT, hand)
    assert unlikely.hung is None
    assert [v.verdict for v in found if "wrist's sensor carries -0.5" in v.message] == ["warning"]


def test_it_comes_back_from_json(weighed):
    again = restored(HungLoad, json.loads(json.dumps(plain(weighed))))
    np.testing.assert_array_equal(again.added(2.0), weighed.added(2.0))
