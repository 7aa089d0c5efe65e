"""The URDF written of a model: its angles, its bytes, and what it cannot say."""

import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mjcf

HALF_PI = math.pi / 2


@pytest.mark.parametrize("pitch", [0.3, HALF_PI, -HALF_PI, HALF_PI - 1e-9, -HALF_PI + 1e-8, HALF_PI - 1e-15, 2.0])
def test_rpy_round_trip_is_exact_at_the_singularity_too(pitch):
    rng = np.random.default_rng(3)
    for roll, yaw in [(0.0, 0.0), (HALF_PI, -HALF_PI), (math.pi, 1.0), *rng.uniform(-math.pi, math.pi, (200, 2))]:
        R = pin.rpy.rpyToMatrix(roll, pitch, yaw)
        again = pin.rpy.rpyToMatrix(*mjcf.rpy_from_matrix(R))
        np.testing.assert_allclose(again, R, rtol=0, atol=5e-15)


def test_rpy_follows_the_urdf_convention():
    roll, pitch, yaw = 0.4, -0.9, 2.2
    np.testing.assert_allclose(mjcf.rpy_from_matrix(pin.rpy.rpyToMatrix(roll, pitch, yaw)), (roll, pitch, yaw))
    with pytest.raises(ValueError, match=r"\(3, 3\)"):
        mjcf.rpy_from_matrix(np.eye(4))


def test_urdf_is_the_same_each_time_and_of_the_model_given():
    assert mjcf.urdf() == mjcf.urdf()
    spec = mjcf.spec()
    spec.body("arm_3_link").pos[0] += 0.1 / 3.0
    arm_3 = next(
        joint for joint in ET.fromstring(mjcf.urdf(spec.compile())).iter("joint") if joint.get("name") == "arm_3_joint"
    )
    assert float(arm_3.find("origin").get("xyz").split()[0]) == 0.0895 + 0.1 / 3.0


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ('<joint pos="0 0 .1"/>', "about a point"),
        ('<joint type="ball"/>', "ball"),
        ("<joint/><joint axis='1 0 0'/>", "2 joints"),
    ],
)
def test_what_a_urdf_cannot_say_is_refused(joint, reason):
    text = f"""<mujoco><worldbody><body name="base_footprint"><geom size="1"/>
        <body name="arm">{joint}<geom size="1"/></body></body></worldbody></mujoco>"""
    with pytest.raises(mjcf.NotAUrdfTree, match=reason) as refusal:
        mjcf.urdf(mujoco.MjModel.from_xml_string(text))
    assert refusal.value.body_name == "arm"
