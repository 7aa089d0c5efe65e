import mujoco
import numpy as np
import pytest

import mjcf
from scenarios import load
from twin.campaign import laboratory


@pytest.fixture(scope="session")
def config():
    return load("humanoids2024").quick().twin


@pytest.fixture(scope="session")
def nominal():
    return mjcf.spec().compile()


@pytest.fixture(scope="session")
def lab(config):
    return laboratory(config, 0)


@pytest.fixture(scope="session")
def body_poses():
    """T_root_body of a MuJoCo model in a configuration given by joint names."""

    def poses(model: mujoco.MjModel, q: dict[str, float], root: str, body: str) -> np.ndarray:
        data = mujoco.MjData(model)
        for name, value in q.items():
            data.joint(name).qpos = value
        mujoco.mj_kinematics(model, data)
        T = np.eye(4)[None].repeat(2, axis=0)
        for k, name in enumerate((root, body)):
            T[k, :3, :3], T[k, :3, 3] = data.body(name).xmat.reshape(3, 3), data.body(name).xpos
        return np.linalg.solve(T[0], T[1])

    return poses
