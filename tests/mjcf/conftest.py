import mujoco
import pinocchio as pin
import pytest

import mjcf


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mjcf.spec().compile()


@pytest.fixture(scope="module")
def pin_model() -> pin.Model:
    return pin.buildModelFromXML(mjcf.urdf(), pin.JointModelFreeFlyer())
