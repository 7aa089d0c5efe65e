"""A trial with another payload bends gears more: no reading slipped."""

from dataclasses import replace

import numpy as np

import mjcf
from calibration.checks.changes import changes
from calibration.checks.unexplained import Passed, unexplained
from calibration.inference.parameters import Model, Parameter
from calibration.recording.schema import Payload
from calibration.robot.hand import nominal_hand
from calibration.robot.laboratory import Laboratory
from tests.doubles import rigid_robot

N, SOFT, HEAVY = 400, 1.5e-4, 4.0
LAB = Laboratory(
    mjcf.urdf(),
    rigid_robot.described(
        payload=Payload(link="gripper_grasping_frame", mass=0.5, com=(0.0, 0.0, 0.0), tolerance=0.02)
    ),
)
JOINTS = LAB.description.joint_names


def samples():
    """A campaign whose later half is with a heavy payload; gears are soft."""
    rng = np.random.default_rng(0)
    low, high = LAB.chain.limits
    q = rng.uniform(0.7 * low, 0.7 * high, (N, len(JOINTS)))
    payload = np.where(np.arange(N) < N // 2, 0.5, HEAVY)
    hand = nominal_hand(LAB.chain, LAB.nominal_frames)
    names = [f"gear.{joint}.compliance" for joint in JOINTS[1:]]
    soft = hand.with_theta(np.full(len(names), SOFT), names)
    T = np.concatenate([soft.carrying(m).poses(q[payload == m]) for m in (0.5, HEAVY)])
    t, none = np.arange(N) * 0.25, np.full(q.shape, np.nan)
    T[:, :3, 3] += 1e-4 * rng.normal(size=(N, 3))
    x = Passed((payload == HEAVY).astype(int), t, q, rng.normal(size=q.shape), none, T, np.full(N, 1e-4), payload)
    frame = Parameter(hand.names[0], "m", 0.0, 0.0, 1e-3, "estimated")
    return hand, Model("model_2", (frame,), covariance=np.full((1, 1), 1e-6)), x


def found(hand, model, x):
    return [v.message for v in changes(unexplained(hand, model, x), LAB.description, ["light", "heavy"])]


def test_gears_that_a_heavy_payload_winds_up_are_no_change():
    assert found(*samples()) == []


def test_the_same_with_one_payload_throughout_is_one():
    hand, model, x = samples()
    assert any(" slipped from " in m for m in found(hand, model, replace(x, payload=np.full(N, 0.5))))
