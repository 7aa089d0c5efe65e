"""A ROS bag by its topics and the names in their messages."""

from pathlib import Path

from calibration.errors import InputError
from calibration.formats.bag.messages import JOINT_STATE, NAMES, POSES, VALUES, WRENCH
from calibration.formats.bag.read import read_bag, topics_of
from calibration.formats.mapping.layouts import BagLayout
from calibration.formats.survey.poses_in_columns import SIGMAS, TYPICAL
from calibration.formats.survey.robot import UrdfRobot
from calibration.formats.survey.view import GUESS, WHOSE, WRIST, FileView, flow

_LINK = ("absolute", "link", "encoder")
_COMMAND = ("command", "target", "desired")


def view_bag(path: Path, robot: UrdfRobot) -> FileView:
    """What a bag shows.

    Raises:
        InputError: It cannot be read, or no message names a joint of the URDF.
    """
    topics = topics_of(path)
    states = {t: names & set(robot.movable) for t, (kind, names) in topics.items() if kind == JOINT_STATE}
    states = {t: names for t, names in states.items() if names}
    link = next((t for t in states if any(word in t for word in _LINK)), None)
    command = next((t for t in states if any(word in t for word in _COMMAND)), None)
    motor = max((t for t in states if t not in (link, command)), key=lambda t: len(states[t]), default=None)
    if motor is None and {NAMES, VALUES} <= topics.keys():
        names = robot.in_order(topics[NAMES][1] & set(robot.movable))
        layout = BagLayout(source="introspection", joints={n: n for n in names})
        lines = ["source: introspection", "joints: same"]
    elif motor is None:
        raise InputError(path, f"no JointState message names a joint of the URDF; topics: {sorted(topics)}")
    else:
        names = robot.in_order(states[motor])
        layout = BagLayout(source="joint_states", joints={n: n for n in names}, motor=motor, link=link, command=command)
        pairs = [("motor", motor), ("link", link), ("command", command)]
        lines = ["source: joint_states", "joints: same", *(f"{k}: {v}" for k, v in pairs if v)]
    poses = {_body(t): {"topic": t} | SIGMAS for t, (kind, _) in topics.items() if kind in POSES}
    if poses:
        layout = BagLayout.model_validate(layout.model_dump() | {"poses": poses})
        rows = (f"  {flow(name)}: {flow(p)}  {GUESS}: {TYPICAL}" for name, p in poses.items())
        lines += ["poses:", *rows]
    wrist = next((t for t, (kind, _) in sorted(topics.items()) if kind == WRENCH and WRIST.search(t)), None)
    if wrist:
        layout = layout.model_copy(update={"wrist": wrist, "wrist_convention": "action"})
        lines += [f"wrist: {wrist}", f"wrist_convention: action{WHOSE}"]
    used = {wrist, motor, link, command, *(p["topic"] for p in poses.values())}
    left = tuple(sorted(t for t in topics if t not in used and t not in (NAMES, VALUES)))
    return FileView(path, "bag", read_bag([path], layout), (), tuple(lines), left)


def _body(topic: str) -> str:
    """What a topic of poses is about: /vrpn/hand/pose is of the hand."""
    parts = [part for part in topic.split("/") if part]
    return parts[-2] if len(parts) > 1 and parts[-1] in ("pose", "transform", "odom") else parts[-1]
