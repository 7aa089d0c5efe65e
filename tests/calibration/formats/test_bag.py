"""Bags out and in, ROS 1 and ROS 2: JointState with a second topic for link encoders, and PAL's introspection."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import load
from calibration.errors import InputError
from calibration.formats.bag.messages import JOINT_STATE, MOTOR, STATISTICS_NAMES, STATISTICS_VALUES, VALUES, typestore
from calibration.formats.bag.read import read_bag
from calibration.formats.bag.write import write_bag
from calibration.formats.mapping.layouts import BagLayout
from calibration.recording.trial import Trial
from tests.calibration.formats.test_csv import mapping as described_robot
from tests.doubles import rigid_robot
from tests.doubles.c3d_data import trial as empty_trial

FIELDS = ("q_motor", "q_link", "v_motor", "effort", "q_command", "wrist_wrench")
EXACT = {"source": "joint_states", "link": "/joint_states_absolute", "command": "/joint_states_command"}
WRIST = {"wrist": "/wrist_ft", "wrist_convention": "action"}
LAYOUT = BagLayout.model_validate(EXACT | {"joints": {j: j for j in rigid_robot.JOINTS}})


def trial(n: int = 50) -> Trial:
    """Readings of eight joints, the torso without a link encoder."""
    rng, t = np.random.default_rng(2), (9610 + np.arange(n)) / 100.0
    q = rigid_robot.CENTRE + 0.1 * np.sin(t)[:, None]
    link = q + 1e-3
    link[:, 0] = np.nan
    noise = [rng.normal(size=q.shape) for _ in range(3)]
    return replace(
        empty_trial(0.5), t_robot=t, q_motor=q, q_link=link, v_motor=noise[0], effort=noise[1],
        q_command=q + 1e-4 * noise[0], wrist_wrench=rng.normal(size=(n, 6)),
    )  # fmt: skip


def layout(**changes):
    return LAYOUT.model_copy(update=changes)


def write_messages(path, rows, topic=MOTOR, kind=JOINT_STATE):
    """A ROS 1 bag of messages (stamp [s], names, values) as some other program might have written it."""
    from rosbags.rosbag1 import Writer

    store = typestore(1)
    Time, Header = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Header"]
    with Writer(path) as bag:
        connection = bag.add_connection(topic, kind, typestore=store)
        for k, (stamp, names, values) in enumerate(rows):
            ns = round(stamp * 1e9)
            header = Header(seq=k, stamp=Time(sec=ns // 10**9, nanosec=ns % 10**9), frame_id="")
            none = np.zeros(0)
            message = store.types[kind](
                header=header, name=list(names), position=np.array(values, float), velocity=none, effort=none
            )
            bag.write(connection, 10**9 * (k + 1), store.serialize_ros1(message, kind))
    return path


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("source", ["joint_states", "introspection"])
def test_readings_come_back_bit_for_bit(tmp_path, ros, source):
    path, true = tmp_path / ("log.bag" if ros == 1 else "log"), trial()
    write_bag(path, true, ros)
    found = read_bag([path], layout(source=source, **WRIST)).joints
    assert found is not None and found.names == rigid_robot.JOINTS
    np.testing.assert_array_equal(found.t, true.t_robot)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(true, name))


def test_names_of_the_introspection_have_pals_prefix(tmp_path):
    write_bag(tmp_path / "log.bag", trial())
    from rosbags.highlevel import AnyReader

    with AnyReader([tmp_path / "log.bag"]) as bag:
        (row,) = [r for r in bag.messages() if r[0].msgtype == STATISTICS_NAMES]
        names = bag.deserialize(row[2], STATISTICS_NAMES).names
        assert sum(c.msgcount for c in bag.connections if c.msgtype == STATISTICS_VALUES) == 50
    assert "- arm_3_joint_absolute_encoder_position" in names and "- torso_lift_joint_position" in names
    assert "- torso_lift_joint_absolute_encoder_position" not in names


def test_times_are_the_stamps_not_when_the_bag_wrote_them(tmp_path):
    rows = [(5.0 + 0.01 * k, rigid_robot.JOINTS, rigid_robot.CENTRE) for k in range(9)]
    found = read_bag([write_messages(tmp_path / "log.bag", rows)], layout(link=None, command=None)).joints
    np.testing.assert_array_equal(found.t, [r[0] for r in rows])


def test_readings_are_taken_by_name_and_other_publishers_are_passed_over(tmp_path):
    rng, rows = np.random.default_rng(0), []
    for k in range(20):
        order = rng.permutation(8)
        rows.append((0.01 * k, [rigid_robot.JOINTS[i] for i in order], rigid_robot.CENTRE[order] + k))
        rows.append((0.01 * k + 0.001, ["wheel_left_joint"], [100.0 * k]))
    found = read_bag([write_messages(tmp_path / "log.bag", rows)], layout(link=None, command=None)).joints
    np.testing.assert_array_equal(found.q_motor, rigid_robot.CENTRE + np.arange(20)[:, None])


def test_link_readings_on_their_own_stamps_are_interpolated_and_nan_outside(tmp_path):
    from rosbags.rosbag1 import Writer

    store, path = typestore(1), tmp_path / "log.bag"
    Time, Header = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Header"]
    with Writer(path) as bag:
        for topic, shift in (("/joint_states", 0), ("/joint_states_absolute", 5_000_000)):
            connection = bag.add_connection(topic, JOINT_STATE, typestore=store)
            for k in range(10):
                ns = k * 10_000_000 + shift
                header = Header(seq=0, stamp=Time(sec=0, nanosec=ns), frame_id="")
                position = np.full(8, ns * 1e-9)
                message = store.types[JOINT_STATE](
                    header=header, name=list(rigid_robot.JOINTS), position=position, velocity=position, effort=position
                )
                bag.write(connection, ns + 1, store.serialize_ros1(message, JOINT_STATE))
    found = read_bag([path], layout(command=None)).joints
    np.testing.assert_allclose(found.q_link[1:], found.q_motor[1:], atol=1e-12)
    assert np.isnan(found.q_link[0]).all()


def test_the_wrist_s_reaction_is_turned_into_its_action_and_must_be_declared(tmp_path):
    true = trial()
    true.wrist_wrench[:3] = np.nan  # the sensor's driver started late
    write_bag(tmp_path / "log.bag", true)
    found = read_bag([tmp_path / "log.bag"], layout(wrist="/wrist_ft", wrist_convention="reaction")).joints
    np.testing.assert_array_equal(found.wrist_wrench, -true.wrist_wrench)
    assert read_bag([tmp_path / "log.bag"], LAYOUT).joints.wrist_wrench is None
    with pytest.raises(ValueError, match="no bag contains whose wrench it is"):
        BagLayout.model_validate(EXACT | {"joints": {"a": "a"}, "wrist": "/wrist_ft"})


def test_a_bag_becomes_a_dataset(lab):
    described = described_robot(trials=[{"id": "log", "role": "calibration", "kind": "swing"}])
    described["bag"] = LAYOUT.model_dump()
    write_bag(lab.folder / "log.bag", trial())
    lab.run(described, lab.folder / "log.bag", kind="bag")
    ((_, found),) = load(lab.out).trials("calibration")
    np.testing.assert_array_equal(found.q_motor, trial().q_motor.astype(np.float32))
    assert len(found.t_mocap) == len(found.t_plate) == 0


def rows(n=20):
    return [[0.01 * k, list(rigid_robot.JOINTS), rigid_robot.CENTRE.copy()] for k in range(n)]


def repeated(r):
    r[7][0] = r[6][0]


def backwards(r):
    r[7][0] = 0.001


def partial(r):
    r[7][1], r[7][2] = r[7][1][:-1], r[7][2][:-1]


def unknown(r):
    for row in r:
        row[1] = [f"left_{n}" for n in row[1]]


def missing(r):
    r[7][2][3] = np.nan


def degrees(r):
    for row in r:
        row[2] = np.append(row[2][:1], np.degrees(row[2][1:]))


BAD = {
    "stamp twice": (repeated, ["/joint_states: message 7 of our joints has the stamp of the one before (0.060000 s)"]),
    "stamp goes back": (backwards, ["/joint_states: message 7", "earlier stamp", "log one publisher"]),
    "some joints": (partial, ["/joint_states: message 7 has no ['arm_7_joint'], but others of our joints"]),
    "other names": (unknown, ["/joint_states: none of", "it has ['left_arm_1_joint'", "correct the mapping file"]),
    "a reading missing": (missing, ["joint arm_3_joint: 1 readings are missing, the first in sample 7"]),
    "degrees": (degrees, ["joint 'arm_", "degrees?"]),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_bag_is_reported_with_topic_and_remedy(lab, capsys, name):
    change, words = BAD[name]
    changed = rows()
    change(changed)
    described = described_robot(trials=[{"id": "log", "role": "calibration", "kind": "swing"}])
    described["bag"] = layout(link=None, command=None).model_dump()
    said = lab.refused(capsys, described, write_messages(lab.folder / "log.bag", changed), kind="bag")
    for word in ("log.bag: ", *words):
        assert word in said


@pytest.mark.parametrize("size", [0, 10, 5000, -100])
@pytest.mark.parametrize("ros", [1, 2])
def test_a_truncated_bag_is_reported(lab, capsys, size, ros):
    described = described_robot(trials=[{"id": "log", "role": "calibration", "kind": "swing"}])
    described["bag"] = LAYOUT.model_dump()
    path = lab.folder / ("log.bag" if ros == 1 else "log")
    write_bag(path, trial(), ros)
    file = path if ros == 1 else path / "log.mcap"
    file.write_bytes(file.read_bytes()[:size])
    assert f"{path}: cannot be read as a ROS bag" in lab.refused(capsys, described, path, kind="bag")


def test_a_topic_that_is_not_there_is_reported(tmp_path):
    write_bag(tmp_path / "log.bag", trial())
    with pytest.raises(InputError, match=r"no messages on \['/states'\]; the bag has \['/introspection_data/names'"):
        read_bag([tmp_path / "log.bag"], layout(motor="/states"))


def test_values_without_their_names_are_reported(tmp_path):
    from rosbags.rosbag1 import Writer

    store, path = typestore(1), tmp_path / "log.bag"
    header = store.types["std_msgs/msg/Header"](
        seq=0, stamp=store.types["builtin_interfaces/msg/Time"](sec=1, nanosec=0), frame_id=""
    )
    with Writer(path) as bag:
        for topic, kind, part in (
            ("/introspection_data/names", STATISTICS_NAMES, {"names": ["- a_position"]}),
            (VALUES, STATISTICS_VALUES, {"values": np.zeros(1)}),
        ):
            version = 1 if "names" in part else 2
            message = store.types[kind](header=header, names_version=version, **part)
            bag.write(bag.add_connection(topic, kind, typestore=store), 1, store.serialize_ros1(message, kind))
    with pytest.raises(InputError, match="message 0 has no names of version 2"):
        read_bag([path], layout(source="introspection"))


def test_times_before_zero_are_not_written(tmp_path):
    with pytest.raises(InputError, match="ROS has no stamps before zero"):
        write_bag(tmp_path / "log.bag", replace(trial(), t_robot=trial().t_robot - 100.0))
