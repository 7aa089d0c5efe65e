"""The robot stands on its plate, as the files say and as they open."""

import mujoco
import numpy as np
import pytest

import mjcf
from tests.mjcf.elements import joints


@pytest.mark.parametrize("path", ["scene.xml", "tiago.xml"])
def test_the_files_open_as_they_are(path):
    model = mujoco.MjModel.from_xml_path(str(mjcf.scene_path().with_name(path)))
    assert model.nv == 28


def ground_force(model, data):
    """Return the sum of the wheels' normal forces [N] and the ground geoms touched."""
    force, total, touched = np.zeros(6), 0.0, set()
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, force)
        total += force[0]
        touched |= {model.geom(g).name for g in data.contact[i].geom}
    return total, touched


@pytest.mark.parametrize("keyframe", [None, "home", "reach"])
def test_the_robot_settles_on_the_plate_and_holds_its_posture(model, keyframe):
    data = mujoco.MjData(model)
    if keyframe:
        mujoco.mj_resetDataKeyframe(model, data, model.key(keyframe).id)
    start = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=2000)
    force, touched = ground_force(model, data)
    base = data.body(mjcf.ROOT)
    assert force == pytest.approx(model.body_mass.sum() * 9.81, rel=0.01)
    assert {name for name in touched if not name.endswith("_contact")} == {"plate"}
    np.testing.assert_allclose(base.xpos, [0.9, 0.45, 0.0], atol=3e-3)
    np.testing.assert_allclose(base.xquat, [1.0, 0.0, 0.0, 0.0], atol=5e-3)  # 10 mrad
    for joint in joints(model):
        if "caster" not in joint.name:
            assert data.qpos[joint.qposadr] == pytest.approx(start[joint.qposadr], abs=0.03), joint.name


@pytest.mark.parametrize("name", ["home", "reach"])
def test_keyframes_are_inside_the_limits_and_commanded(model, name):
    key = model.key(name)
    for joint in joints(model):
        if model.jnt_limited[joint.id]:
            assert joint.range[0] <= key.qpos[joint.qposadr[0]] <= joint.range[1], joint.name
    for actuator_id in range(model.nu):
        joint = model.joint(int(model.actuator_trnid[actuator_id, 0]))
        assert key.ctrl[actuator_id] == key.qpos[joint.qposadr[0]], joint.name


def test_plate_is_flush_with_the_floor(model):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    plate, site = data.geom("plate"), data.site("plate")
    np.testing.assert_allclose(plate.xpos + [0.0, 0.0, model.geom("plate").size[2]], [0.9, 0.45, 0.0], atol=1e-15)
    np.testing.assert_allclose(2 * model.geom("plate").size[:2], [0.9, 0.9])
    np.testing.assert_array_equal(site.xpos, [0.9, 0.45, 0.0])
    np.testing.assert_array_equal(site.xmat, np.eye(3).ravel())
    for name in ("floor_front", "floor_back", "floor_left", "floor_right"):
        top = data.geom(name).xpos[2] + model.geom(name).size[2]
        apart = np.abs(data.geom(name).xpos - plate.xpos)[:2] - model.geom(name).size[:2] - model.geom("plate").size[:2]
        assert top == pytest.approx(0.0, abs=1e-15)
        assert apart.max() == pytest.approx(0.0, abs=1e-12), f"{name} must end where the plate begins"


def test_wheels_are_where_the_datasheet_says():
    wheels = {wheel.name: wheel for wheel in mjcf.wheels()}
    assert [wheel.type for wheel in mjcf.wheels()] == ["drive"] * 2 + ["caster"] * 4
    assert wheels["wheel_left"].centre == (0.0, 0.2022, 0.0985)
    assert wheels["wheel_right"].contact == (0.0, -0.2022, 0.0)
    assert wheels["caster_front_left"].centre == pytest.approx((0.1535, 0.102, 0.025))
    assert wheels["caster_back_right"].contact == pytest.approx((-0.1895, -0.102, 0.0))
    assert wheels["caster_back_left"].body == "caster_back_left_2_link"


def test_only_wheels_touch_only_the_ground(model):
    touching = [model.geom(i).name for i in range(model.ngeom) if model.geom_conaffinity[i]]
    assert sorted(touching) == sorted(f"{wheel.name}_contact" for wheel in mjcf.wheels())
    assert not np.any(model.geom_contype[[model.geom(name).id for name in touching]])


def test_spec_is_fresh_each_time():
    first, second = mjcf.spec(), mjcf.spec()
    assert first.to_xml() == second.to_xml()
    first.body("arm_1_link").pos[0] += 1.0
    first.delete(first.key("home"))
    assert second.to_xml() == mjcf.spec().to_xml() != first.to_xml()
