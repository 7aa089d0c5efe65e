"""The saved results of a small run, made up, for pages that show them."""

import base64
import json

import numpy as np

from calibration import Estimate, Evaluation, save_estimate
from calibration.evaluation.ladder import TrialErrors, ladder
from calibration.evaluation.pose_errors import PoseErrors
from calibration.inference.parameters import Combination, Model, Parameter
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial, write_trial

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


SCENARIO = """name: small
description: A small <example>
seed: 7
twin: {gap: 0.01}
versions: {python: 3.11.7, mujoco: 4.0.0}
"""


URDF = """<robot name="two"><link name="base"/><link name="hand"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


MODELS = {"registration": 12.0, "model_2": 3.0, "nominal": 13.0, "gauss": 5.0}


def errors(scale_mm, n, seed):
    rng = np.random.default_rng(seed)
    return PoseErrors(1e-3 * scale_mm * rng.normal(size=(n, 3)), 2e-3 * scale_mm * rng.normal(size=(n, 3)))


def traces(models=MODELS, bases=("measured", "fixed")):
    for model, scale in models.items():
        for base in bases:
            for trial, kind, n in (("xyz", "swing", 300), ("others", "static", 9)):
                found = errors(scale if base == "fixed" else 0.7 * scale, n, len(model))
                yield TrialErrors(model, base, "motor", trial, kind, 0.01 * np.arange(n), found, found)


def write_evaluation(run, **options):
    found = list(traces(**options))
    Evaluation(tuple(ladder(found, "mocap")), tuple(found)).save(run)


def write_score(run):
    rows = json.loads((run / "evaluation.json").read_text())["rows"]
    rows = [row | {"against": "truth", "skill": 0.8} for row in rows]
    rows.append(rows[0] | {"model": "floor", "base": "measured", "encoder": "link", "skill": 1.0})
    rng = np.random.default_rng(1)
    judged = {"sigma": 1e-3, "truth": 2e-3, "unit": "rad"}
    z = rng.normal(size=30)
    parameters = [
        judged | {"name": f"geometry.arm_{i}_joint.rx", "estimate": 2e-3 + 1e-3 * x, "z": x, "status": "estimated"}
        for i, x in enumerate(z)
    ]
    parameters.append({"name": "link.arm_1_link.mass", "unit": "-", "truth": 0.1, "status": "not_estimated"})
    combination = judged | {"name": "encoder.turn.motor.offset", "estimate": 9e-3, "z": 7.0, "status": "combined"}
    score = {
        "schema": 1,
        "parameters": parameters,
        "combinations": [combination],
        "nees": 31.5,
        "dof": 31,
        "rows": rows,
    }
    (run / "score.json").write_text(json.dumps(score))


def write_dataset(folder):
    (folder / "trials").mkdir(parents=True)
    n = 200
    t = 0.01 * np.arange(n)
    q = np.zeros((n, 1))
    trial = Trial(
        id="xyz",
        joint=("turn",),
        t_robot=t,
        q_motor=q,
        q_link=q,
        v_motor=q,
        effort=q,
        q_command=q,
        marker=("m1",),
        marker_body=("gripper",),
        t_mocap=t,
        marker_position=np.zeros((n, 1, 3)),
    )
    sha256 = write_trial(folder / "trials/xyz.nc", trial)
    tolerances = (
        "joint_translation joint_rotation encoder_offset joint_play body_translation body_rotation link_mass link_com"
    )
    description = Description(
        robot="two",
        base_frame="base",
        tool_frame="hand",
        joints=[{"name": "turn", "encoders": ["motor", "link"], "rate": 100.0}],
        bodies=[{"name": "gripper", "link": "hand", "markers": [{"name": "m1", "xyz": (0.0, 0.0, 0.0)}]}],
        payload={"link": "hand", "mass": 0.437, "com": (0.0, 0.0, 0.0), "tolerance": 0.02},
        sigmas={"marker": 1e-4, "encoder": 1e-5, "plate_force": 1.0, "plate_moment": 0.3},
        tolerances=dict.fromkeys(tolerances.split(), 1e-3),
        trials=[
            {"id": "xyz", "role": "validation", "kind": "swing", "motion": "xyz", "file": "trials/xyz.nc"}
            | {"sha256": sha256}
        ],
    )
    (folder / "dataset.json").write_text(description.model_dump_json())
    (folder / "nominal.urdf").write_text(URDF)


def write_estimate(folder, *verdicts):
    parameters = (
        Parameter("encoder.turn.motor.offset", "rad", 0.0, 9e-3, 1e-3, "combined"),
        Parameter("geometry.turn.rz", "rad", 0.0, 1e-3, 1e-3, "combined"),
        Parameter("geometry.turn.x", "m", 0.0, 1e-3, 1e-4, "estimated"),
    )
    combination = Combination("encoder.turn.motor.offset", np.array([1.0, -1.0, 0.0]), 8e-3, 1e-3)
    clock = Clock("robot", 3.9, 1.2e-5, np.diag([1e-6, 1e-12]), 300.0, 5e-4)
    model = Model("model_2", parameters, (combination,), np.diag([1e-6, 1e-6, 1e-8]))
    save_estimate(Estimate("calibrated", verdicts, (clock,), (model,), "model_2"), folder)
