"""The recipes of CONTRIBUTING.md that add to the calibration are carried out, each in a copy of the package."""

from pathlib import Path

import pytest

from tests.project.recipes import copied, recipe, run_script

BLOCK = """
import numpy as np
import mjcf
from calibration.numerics.lie import inverse, log6
from calibration.robot.chain import chain_of
from calibration.stages.geometry.gear_deflection import calibrate_gears
from calibration.stages.geometry.parameters import hand_model
from tests.doubles import rigid_robot

described, rng = rigid_robot.described(), np.random.default_rng(0)
chain, truth = chain_of(mjcf.urdf(), described), rigid_robot.defects(0)
hand = hand_model(chain, np.zeros(12))
mine = [name for name in hand.names if name.endswith(("cos1", "sin1"))]
assert len(mine) == 16
at, q = hand.with_theta(0.01 * rng.normal(size=16), mine), rigid_robot.random_angles(rng, 60)
theta, found = at.theta[[hand.names.index(n) for n in mine]], at.poses_and_derivatives(q[:3], names=mine)
for k in range(16):
    low, high = (at.with_theta(theta + s * 1e-6 * np.eye(16)[k], mine).poses(q[:3]) for s in (-1, 1))
    np.testing.assert_allclose(found.J[:, :, k], log6(inverse(low) @ high) / 2e-6, atol=1e-8)
postures = rigid_robot.postures(truth, q, 1e-5)
readings = postures.q.copy()
readings[:, 4] += 2e-3 * np.cos(readings[:, 4])
from dataclasses import replace
model, said = calibrate_gears(chain, described, replace(postures, q=readings))
(one,) = [p for p in model.parameters if p.name == "encoder.arm_4_joint.motor.cos1"]
assert abs(one.value - 2e-3) < 4 * one.sigma + 1e-5 and one.sigma < 2e-4, one
"""
RESIDUAL = """
import numpy as np
import mjcf
from calibration.inference.map_estimate import Problem, solve
from calibration.robot.chain import chain_of
from calibration.stages.geometry.hand_height import HandHeight
from calibration.stages.geometry.hand_residual import HandResidual, NoiseModel
from calibration.stages.geometry.parameters import geometry_parameters, hand_model
from tests.doubles import rigid_robot

described, rng = rigid_robot.described(), np.random.default_rng(0)
chain, truth = chain_of(mjcf.urdf(), described), rigid_robot.defects(0)
parameters, hand = geometry_parameters(chain, described), hand_model(chain, np.zeros(12))
postures, none = rigid_robot.postures(truth, rigid_robot.random_angles(rng, 40)), NoiseModel(*3 * [np.zeros(0)])
height = HandHeight(hand, parameters.names, postures.q, postures.T_base_hand[:, 2, 3], 1e-5)
poses = HandResidual(hand, parameters.names, postures, none)
fits = []
for residuals in ((poses,), (poses, height)):
    problem = Problem(residuals, parameters, stated=True)
    fits.append(solve(problem, problem.linearise(parameters.nominal)))
alone, both = fits
assert both.converged and both.noise.names == ("markers", "laser.height", "padding")
assert np.abs(both.at.r[40:, 0]).max() < 1e-6
assert np.trace(both.covariance) < np.trace(alone.covariance)
"""


@pytest.fixture
def stage(tmp_path) -> Path:
    """The geometric stage in a copy of the calibration."""
    return copied(tmp_path, "calibration") / "calibration/stages/geometry"


def test_a_parameter_block_is_a_file_and_its_name_a_residual_a_file_and_an_instance(stage):
    (stage / "eccentricity.py").write_text(recipe("block"), encoding="utf-8")
    listed, mine = stage / "parameters.py", "from calibration.stages.geometry.eccentricity import Eccentricity\n"
    text = listed.read_text(encoding="utf-8")
    assert text.count("FULL: tuple[type[ParameterBlock], ...] = AT_REST") == 1
    named = text.replace("...] = AT_REST", "...] = (*AT_REST, Eccentricity)")
    listed.write_text(named.replace("\nFULL:", f"\n{mine}\nFULL:"), encoding="utf-8")
    (stage / "hand_height.py").write_text(recipe("residual"), encoding="utf-8")
    run_script(stage.parents[2], BLOCK + RESIDUAL)
