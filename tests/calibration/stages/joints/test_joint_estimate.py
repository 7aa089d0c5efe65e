"""The joint models within an estimate: a trial's own payload, the terms that were chosen, what was not identified."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration import Dataset, Estimate, calibrate, load_estimate, save_estimate
from calibration.options import Options
from calibration.prediction.predictor import Predictor
from calibration.recording.schema import Description
from calibration.robot.laboratory import Laboratory
from calibration.stages.joints import stage
from calibration.stages.joints.correction import JointModels, input_model
from calibration.stages.joints.model import JointModel
from calibration.stages.joints.separable_fit import RHO
from calibration.stages.joints.stage import fit_joint_models, joints_model
from scenarios import load as load_scenario
from scenarios.files.errors import ScenarioError
from tests.doubles import joint_data, rigid_robot
from tests.doubles.joint_data import ROBOT

ARM_4, ARM_6 = 4, 6
PER_TORQUE = 1e-3  # [rad/(N.m)]


def loaded(dataset: Dataset, mass: float) -> Description:
    """The dataset's description with a payload of 0.437 kg, `mass` in the trial xyz."""
    payload = {"link": "gripper_grasping_frame", "mass": 0.437, "com": [0.0, 0.0, 0.0], "tolerance": 0.1}
    data = dataset.description.model_dump(by_alias=True) | {"payload": payload}
    data["trials"] = [t | {"payload": mass} if t["id"] == "xyz" else t for t in data["trials"]]
    return Description.model_validate(data)


def yielding(joint: str) -> JointModel:
    """A joint that lags its motor by 1 mrad/(N.m) of gravity torque."""
    box = np.array([[-9.0, 9.0], [-99.0, 99.0]])
    A = np.array([PER_TORQUE])
    return JointModel(joint, "printed", 1, ((0, 1),), (), 20.0, A, A, box, 0.0)


def test_a_trial_s_own_payload_reaches_the_joint_models(dataset: Dataset) -> None:
    hand, entry = joint_data.hand(), dataset.entries("validation")[0]
    trial = dataset.read(entry)
    turned = {}
    for mass in (0.437, 2.0):
        description = loaded(dataset, mass)
        inputs = input_model(Laboratory(dataset.urdf, description), hand)
        joints = JointModels(inputs, np.zeros(len(inputs.measured)), (yielding("arm_4_joint"),))
        predict = Predictor({"model_3": hand}, dataset.urdf, description, ROBOT, joints=joints)
        turned[mass] = predict.row_readings.positions("model_3", "motor", trial)[:, ARM_4]
    q = trial.q_motor - joint_data.OFFSET
    J, R = hand.chain.joint_jacobians(q), hand.chain.poses(q)[:, :3, :3]
    torque = (2.0 - 0.437) * 9.81 * np.einsum("ni,ni->n", R[:, 2], J[:, :3, ARM_4])
    late = np.interp(ROBOT.from_mocap(trial.t_mocap), trial.t_robot, torque, np.nan, np.nan)
    np.testing.assert_allclose(turned[0.437] - turned[2.0], PER_TORQUE * late, atol=1e-9)
    assert np.ptp(torque) > 1.0


@pytest.mark.parametrize(
    ("rho", "verdict", "statuses"),
    [
        (30.0, "", {"estimated"}),
        (3e4, "highest limit", {"estimated"}),
        (0.3, "lowest limit", {"not_identifiable"}),
    ],
)
def test_a_rho_at_its_limit_is_not_identifiable(
    estimate: Estimate, rho: float, verdict: str, statuses: set[str]
) -> None:
    truth = joint_data.truth("arm_6_joint", "total", 1, rho, 2)
    models, said = fit_joint_models(joint_data.LAB, joint_data.made([truth]), ROBOT, joint_data.hand())
    model = joints_model(estimate.model("model_2"), models.models)
    found = {p.name: p for p in model.parameters if p.name.startswith("sigmoid.arm_6_joint")}
    of_rho = found.pop("sigmoid.arm_6_joint.rho")
    assert np.linalg.eigvalsh(model.covariance).min() > -1e-9
    assert {p.status for p in found.values()} == statuses
    reported = [v.message for v in said if v.verdict == "warning"]
    assert len(reported) == bool(verdict)
    if verdict:
        assert verdict in reported[0] and "arm_6_joint" in reported[0]
        assert of_rho.status == "not_identifiable"
        assert of_rho.sigma == pytest.approx((RHO[1] - RHO[0]) / np.sqrt(12.0))
    else:
        assert of_rho.status == "estimated"


def test_the_chosen_terms_are_used_and_recorded(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def fit(*arguments: object) -> object:
        asked.append(arguments[-1])
        return fit_joint_models(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(stage, "fit_joint_models", fit)
    options = Options("printed", "full")
    estimate = calibrate(dataset, ["joints"], options=options)
    assert (asked, estimate.options) == (["printed"], options)
    save_estimate(estimate, tmp_path)
    assert load_estimate(tmp_path).options == options
    assert Options() == Options("total", "diagonal")


def test_a_scenario_chooses_the_terms() -> None:
    assert load_scenario("humanoids2024").calibration == Options()
    assert load_scenario("humanoids2024", ["calibration.terms=printed"]).calibration.terms == "printed"
    with pytest.raises(ScenarioError, match=r"calibration.terms.*'printed', 'tensor' or 'total'"):
        load_scenario("humanoids2024", ["calibration.terms=cubic"])
    with pytest.raises(ScenarioError, match="suspension"):
        load_scenario("humanoids2024", ["calibration.springs=full"])


def test_the_choice_none_says_nothing_of_rho(estimate: Estimate) -> None:
    none = replace(yielding("arm_4_joint"), degree=None, powers=(), A=np.zeros(0), B=np.zeros(0))
    names = [p.name for p in joints_model(estimate.model("model_2"), (none,)).parameters]
    assert not [name for name in names if name.startswith("sigmoid")]
    assert rigid_robot.JOINTS[ARM_6] == "arm_6_joint"
