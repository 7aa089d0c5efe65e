import mujoco
import numpy as np
import pinocchio as pin
import pytest

from twin.transforms import exp6, placement, states_with_their_sensors, transform


def test_exp6_is_pinocchios():
    rng = np.random.default_rng(0)
    for twist in rng.normal(size=(20, 6)):
        np.testing.assert_allclose(exp6(twist), pin.exp6(twist).homogeneous, atol=1e-13)


def test_placement_and_transform_are_inverse():
    rng = np.random.default_rng(1)
    T = exp6(rng.normal(size=6))
    np.testing.assert_allclose(transform(*placement(T)), T, atol=1e-14)


def test_quaternions_are_mujocos():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body pos='1 2 3' quat='0.5 0.5 0.5 0.5'><geom size='1'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    T = transform(model.body_pos[1], model.body_quat[1])
    np.testing.assert_allclose(T[:3, :3], data.xmat[1].reshape(3, 3), atol=1e-15)


def test_sensors_belong_to_the_state_before_their_step():
    from mujoco import rollout

    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='j' type='slide' axis='1 0 0'/>"
        "<geom size='.1' mass='1'/></body></worldbody>"
        "<actuator><motor joint='j'/></actuator><sensor><jointpos joint='j'/></sensor></mujoco>"
    )
    data = mujoco.MjData(model)
    first = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, first, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states, sensors = rollout.rollout(model, data, first[None], np.ones((1, 50, 1)))
    aligned = states_with_their_sensors(first, states[0])
    np.testing.assert_array_equal(aligned[:, 1], sensors[0][:, 0])
    with pytest.raises(AssertionError):
        np.testing.assert_array_equal(states[0][:, 1], sensors[0][:, 0])
