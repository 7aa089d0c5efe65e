"""6D poses in bags: TF, PoseStamped and poses with covariance, of an arm of six axes that rests in postures."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration import calibrate, load
from calibration.errors import InputError
from calibration.formats.bag.messages import JOINT_STATE, typestore
from calibration.formats.bag.read import read_bag
from calibration.formats.mapping.layouts import BagLayout
from calibration.formats.mapping.poses import shape_of
from calibration.mocap.cluster_pose import body_poses
from scenarios.steps.import_export import init_mapping, read_mapping
from tests.calibration.formats.test_poses import SIGMA_P, SIGMA_R, mapping
from tests.doubles.six_axis_arm import ARM, JOINTS, measured

RATE, DWELL, MOVE = 20.0, 26, 16  # [Hz], samples
TYPES = {
    "PoseStamped": "geometry_msgs/msg/PoseStamped",
    "PoseWithCovarianceStamped": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "TransformStamped": "geometry_msgs/msg/TransformStamped",
    "TFMessage": "tf2_msgs/msg/TFMessage",
}


def path_of(n):
    """Joint positions (k, 6) and hand poses (k, 4, 4) along n postures with rests."""
    found = measured(0, n)
    s = np.concatenate([k + np.r_[np.zeros(DWELL), np.linspace(0.0, 1.0, MOVE)] for k in range(n - 1)])
    k, part = np.minimum(s.astype(int), n - 2), (s - np.minimum(s.astype(int), n - 2))[:, None]
    step = Rotation.from_matrix(np.swapaxes(found.T[k, :3, :3], 1, 2) @ found.T[k + 1, :3, :3]).as_rotvec()
    R = Rotation.from_matrix(found.T[k, :3, :3]) * Rotation.from_rotvec(part * step)
    p = (1.0 - part) * found.T[k, :3, 3] + part * found.T[k + 1, :3, 3]
    return (1.0 - part) * found.q[k] + part * found.q[k + 1], p, R.as_quat()


def message(store, kind, stamp, p, xyzw, frame="world", child="hand"):
    of = {name.rpartition("/")[2]: store.types[name] for name in store.types}
    ns = round(stamp * 1e9)
    header = of["Header"](stamp=of["Time"](sec=ns // 10**9, nanosec=ns % 10**9), frame_id=frame)
    rotation = of["Quaternion"](**dict(zip("xyzw", map(float, xyzw), strict=True)))
    vector = dict(zip("xyz", map(float, p), strict=True))
    if kind.startswith("Pose"):
        pose = of["Pose"](position=of["Point"](**vector), orientation=rotation)
        if kind == "PoseWithCovarianceStamped":
            covariance = np.diag([1e-2**2] * 3 + [SIGMA_R**2] * 3).ravel()
            pose = of["PoseWithCovariance"](pose=pose, covariance=covariance)
        return of[kind](header=header, pose=pose)
    transform = of["Transform"](translation=of["Vector3"](**vector), rotation=rotation)
    one = of["TransformStamped"](header=header, child_frame_id=child, transform=transform)
    return one if kind == "TransformStamped" else of["TFMessage"](transforms=[one])


def write(path, kind, n=24, late=0.0, factor=1.0, frames=("world",)):
    """A ROS 2 bag of readings and poses; TF has another body between, and each transform twice."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    store = typestore(2)
    q, p, xyzw = path_of(n)
    of = {name.rpartition("/")[2]: store.types[name] for name in store.types}
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        joints = bag.add_connection("/joint_states", JOINT_STATE, typestore=store)
        poses = bag.add_connection("/poses", TYPES[kind], typestore=store)
        for k, row in enumerate(q):
            t, none = 1.0 + k / RATE, np.zeros(0)
            ns = round(t * 1e9)
            header = of["Header"](stamp=of["Time"](sec=ns // 10**9, nanosec=ns % 10**9), frame_id="")
            state = of["JointState"](header=header, name=list(JOINTS), position=row.copy(), velocity=none, effort=none)
            bag.write(joints, ns, store.serialize_cdr(state, JOINT_STATE))
            frame = frames[k % len(frames)]
            sent = [message(store, kind, t + late, factor * p[k], xyzw[k], frame)] * (2 if kind == "TFMessage" else 1)
            sent += [message(store, kind, t, p[0], xyzw[0], frame, "table")] if kind == "TFMessage" else []
            for one in sent:
                bag.write(poses, ns, store.serialize_cdr(one, TYPES[kind]))
    return path


def layout(**changes):
    pose = {"topic": "/poses", "sigma_position": SIGMA_P, "sigma_rotation": SIGMA_R} | changes
    return {"joints": {j: j for j in JOINTS}, "poses": {"hand": pose}}


def read(path, **changes):
    return read_bag([path], BagLayout.model_validate(layout(**changes)))


@pytest.mark.parametrize("kind", TYPES)
def test_every_type_of_pose_is_the_same_pose(tmp_path, kind):
    found = read(write(tmp_path / "log", kind, 3), **({"frame": "hand"} if kind == "TFMessage" else {}))
    _, p, xyzw = path_of(3)
    body = BagLayout.model_validate(layout()).poses["hand"]
    T = body_poses(shape_of(body), found.markers.position).T
    np.testing.assert_allclose(T[:, :3, 3], p, atol=1e-9)
    np.testing.assert_allclose(T[:, :3, :3], Rotation.from_quat(xyzw).as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found.markers.t, found.joints.t, atol=1e-9)
    assert found.together == ("robot",)
    assert bool(found.notes) == (kind == "PoseWithCovarianceStamped")


def test_other_frames_and_units_are_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"in frame \['base_link', 'world'\], wanted is 'base_link'"):
        read(write(tmp_path / "mixed", "PoseStamped", 3, frames=("world", "base_link")))
    one = write(tmp_path / "one", "PoseStamped", 3)
    with pytest.raises(InputError, match="in frame .'world'., wanted is 'odom'"):
        read(one, parent="odom")
    with pytest.raises(InputError, match="position_unit: mm"):
        read(write(tmp_path / "mm", "PoseStamped", 3, factor=1e3))
    with pytest.raises(InputError, match="no pose of frame 'wrist'"):
        read(write(tmp_path / "tf", "TFMessage", 3), frame="wrist")


def test_an_arm_is_calibrated_from_a_bag_alone(lab):
    described = mapping("quat_xyzw") | {"bag": layout()}
    described.pop("csv")
    described["trials"] = {"static": ["log"]}
    notes = lab.run(described, write(lab.folder / "log", "PoseStamped"), kind="bag")
    assert any("rests of" in note for note in notes)
    estimate = calibrate(load(lab.out), cross_validate=True)
    assert estimate.calibrated and estimate.model("model_2").rank == 30
    (said,) = [v.message for v in estimate.verdicts if "left-out postures" in v.message]
    error, base = (float(said.split(word)[1].split()[0]) for word in ("left-out postures ", "registration "))
    assert error < 0.5 < base


def test_a_draft_of_a_bag_names_its_poses(lab):
    log = write(lab.folder / "log", "PoseStamped", 8)
    text = init_mapping([log], lab.folder / "lab.yaml", ARM)
    assert "poses: {topic: '/poses', sigma_position:" in text and "name: poses, link: tool0, pose: true" in text
    assert "static: [log]" in text and read_mapping(lab.folder / "lab.yaml").hand_name == "poses"
