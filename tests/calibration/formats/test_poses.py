"""6D poses as measurements: of an arm of six axes, in every convention, and in wrong ones."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration import calibrate, load
from calibration.formats.mapping.layouts import PoseChannels
from calibration.formats.mapping.poses import marker_sigma, shape_of
from calibration.mocap.cluster_pose import body_poses
from scenarios.steps.import_export import import_files, init_mapping
from tests.calibration.formats.test_csv import write_csv
from tests.doubles.six_axis_arm import ARM, JOINTS, measured

NUMBERS = {
    "quat_xyzw": lambda R: R.as_quat(),
    "quat_wxyz": lambda R: R.as_quat(scalar_first=True),
    "rotation_vector": lambda R: R.as_rotvec(),
    "euler_xyz": lambda R: R.as_euler("xyz"),
    "euler_ZYX": lambda R: R.as_euler("ZYX"),
}
SIGMA_P, SIGMA_R = 2e-4, 1e-3


def columns(order, n=40, seed=0, noise=1.0):
    """Columns of a table of poses and joints; poses with noise along their own axes."""
    found, rng = measured(seed, n), np.random.default_rng(seed + 1)
    R = Rotation.from_matrix(found.T[:, :3, :3]) * Rotation.from_rotvec(noise * SIGMA_R * rng.normal(size=(n, 3)))
    p = found.T[:, :3, 3] + noise * SIGMA_P * rng.normal(size=(n, 3))
    numbers = NUMBERS[order](R)
    table = {f"p{a}": p[:, k] for k, a in enumerate("xyz")} | {f"r{k}": x for k, x in enumerate(numbers.T)}
    return table | {j: found.q[:, k] for k, j in enumerate(JOINTS)}


def mapping(order, declared=None):
    pose = {"position": ["px", "py", "pz"], "order": order, "sigma_position": SIGMA_P, "sigma_rotation": SIGMA_R}
    pose |= {"rotation": [f"r{k}" for k in range(4 if order.startswith("quat") else 3)]} | (declared or {})
    return {
        "urdf": str(ARM),
        "setup": {
            "robot": "arm",
            "base_frame": "pedestal",
            "tool_frame": "tool0",
            "joints": {"names": list(JOINTS), "rate": 100.0},
            "marker_frame": "base",
            "sigmas": {"marker": 2e-4, "encoder": 2e-5, "plate_force": 1.0, "plate_moment": 0.3},
        },
        "bodies": [
            {"name": "base", "link": "pedestal", "fitted": True},
            {"name": "hand", "link": "tool0", "pose": True, "fitted": True},
        ],
        "trials": {"static": ["postures"]},
        "csv": [{"poses": {"hand": pose}, "joints": {"motor": "{joint}", "unit": "rad"}}],
    }


def test_six_markers_carry_the_pose_and_its_covariance():
    channels = PoseChannels.model_validate(mapping("quat_xyzw")["csv"][0]["poses"]["hand"])
    xyz = shape_of(channels)
    S = body_poses(xyz, xyz[None]).covariance[0] * marker_sigma(channels) ** 2
    np.testing.assert_allclose(S, np.diag([SIGMA_P**2] * 3 + [SIGMA_R**2] * 3), atol=1e-12)


@pytest.mark.parametrize("order", NUMBERS)
def test_poses_in_every_order_are_the_same_poses(lab, order):
    lab.run(mapping(order), write_csv(lab.folder / "postures.csv", columns(order, noise=0.0)))
    dataset = load(lab.out)
    ((_, means),) = dataset.means("calibration")
    body = dataset.description.hand_body
    found = body_poses(np.array([m.xyz for m in body.markers]), means.marker_position).T
    np.testing.assert_allclose(found, measured(0, 40).T, atol=1e-9)


def test_an_arm_is_calibrated_by_poses(lab):
    lab.run(mapping("quat_xyzw"), write_csv(lab.folder / "postures.csv", columns("quat_xyzw")))
    estimate = calibrate(load(lab.out), cross_validate=True)
    assert estimate.calibrated and estimate.model("model_2").rank == 30
    (said,) = [v.message for v in estimate.verdicts if "left-out postures" in v.message]
    error, base = (float(said.split(word)[1].split()[0]) for word in ("left-out postures ", "registration "))
    assert [v.verdict for v in estimate.verdicts if "twice as many postures would leave 0." in v.message] == ["ok"]
    assert error < 0.8 < base  # sqrt(3) 0.2 mm of noise in what is compared, some in the fit


WRONG = {
    "order: quat_wxyz": ("quat_wxyz", {"order": "quat_xyzw"}, {}),
    "order: quat_xyzw": ("quat_xyzw", {"order": "quat_wxyz"}, {}),
    "order: euler_ZYX": ("euler_ZYX", {"order": "euler_xyz"}, {}),
    "map position_unit: mm": ("quat_xyzw", {}, {"p": 1e3}),
    "map angle_unit: deg": ("rotation_vector", {}, {"r": np.degrees(1.0)}),
    "off length 1": ("quat_xyzw", {}, {"r": 2.0}),
    "a left-handed frame": ("quat_xyzw", {}, {"mirror": 1}),
    "y of opposite sign": ("quat_xyzw", {}, {"py": -1.0}),
    "transposed": ("quat_xyzw", {}, {"transposed": 1}),
    "inverted": ("quat_xyzw", {}, {"inverted": 1}),
    "no joint reversed and no two swapped": ("quat_xyzw", {}, {"turning": 1}),
}


def spoilt(table, how):
    """The table written as somebody else would."""
    p = np.stack([table[f"p{a}"] for a in "xyz"], axis=1)
    x = np.stack([v for k, v in table.items() if k.startswith("r")], axis=1)
    p, x = p * how.get("p", 1.0) * [1.0, how.get("py", 1.0), 1.0], x * how.get("r", 1.0)
    if "mirror" in how:
        p, x = p * [1, -1, 1], x * [-1, 1, -1, 1]
    if {"transposed", "inverted"} & how.keys():
        R = Rotation.from_quat(x).inv()
        p, x = (p if "transposed" in how else -R.apply(p)), R.as_quat()
    if "turning" in how:  # in a frame on the first link
        turn = Rotation.from_rotvec(-table[JOINTS[0]][:, None] * [0.0, 0.0, 1.0])
        p, x = turn.apply(p), (turn * Rotation.from_quat(x)).as_quat()
    return table | {f"p{a}": p[:, k] for k, a in enumerate("xyz")} | {f"r{k}": c for k, c in enumerate(x.T)}


@pytest.mark.parametrize("said", WRONG)
def test_a_pose_in_another_convention_is_refused_and_named(lab, capsys, said):
    order, declared, how = WRONG[said]
    file = write_csv(lab.folder / "postures.csv", spoilt(columns(order), how))
    assert said in " ".join(lab.refused(capsys, mapping(order, declared), file).split())


def test_a_body_whose_pose_is_in_no_table_is_named(lab, capsys):
    wrong = json.loads(json.dumps(mapping("quat_xyzw")).replace('"poses": {"hand"', '"poses": {"wrist"'))
    file = write_csv(lab.folder / "postures.csv", columns("quat_xyzw"))
    assert "named in no table's or bag's `poses`" in lab.refused(capsys, wrong, file)


STYLES = {
    "OptiTrack": ("quat_xyzw", "hand_X hand_Y hand_Z", "hand_qx hand_qy hand_qz hand_qw", 1e3),
    "Motive": ("quat_xyzw", "hand Position X,hand Position Y,hand Position Z", "", 1.0),
    "Vicon": ("rotation_vector", "hand:TX hand:TY hand:TZ", "hand:RX hand:RY hand:RZ", 1e3),
    "Qualisys": ("euler_XYZ", "X Y Z", "Roll Pitch Yaw", 1e3),
}


@pytest.mark.parametrize("style", STYLES)
def test_a_draft_finds_the_poses_that_systems_export(lab, style):
    order, place, turn, factor = STYLES[style]
    found, degrees = measured(0, 20), np.degrees(1.0) if order.startswith(("euler", "rotation")) else 1.0
    x = degrees * NUMBERS.get(order, lambda R: R.as_euler("XYZ"))(Rotation.from_matrix(found.T[:, :3, :3]))
    turn = turn.split() or [f"hand Rotation {a}" for a in "XYZW"]
    place = place.split(",") if "," in place else place.split()
    table = dict(zip(place, factor * found.T[:, :3, 3].T, strict=True)) | dict(zip(turn, x.T, strict=True))
    file = write_csv(lab.folder / "p.csv", table | dict(zip(JOINTS, found.q.T, strict=True)))
    text = init_mapping([file], lab.folder / "lab.yaml", ARM)
    assert len(text.splitlines()) <= 25 and f"order: {order}" in text and "pose: true" in text
    import_files(None, [file], lab.folder / "lab.yaml", lab.out)
    dataset = load(lab.out)
    ((_, means),) = dataset.means("calibration")
    body = dataset.description.hand_body
    T = body_poses(np.array([m.xyz for m in body.markers]), means.marker_position).T
    np.testing.assert_allclose(T, found.T, atol=1e-6)
