"""A trial with two plates, one turned by 25 deg and 5 mm high, and an occlusion; and a mapping that reads it back."""

import json

import numpy as np

from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from tests.doubles import rigid_robot

TURN = np.radians(25.0)
DEPTH = 0.0413
PLATES = [
    {"name": "first", "centre": [0.9, 0.45, 0.0], "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "size": [0.6, 0.4]},
    {
        "name": "turned",
        "centre": [0.31, 0.45, 0.005],
        "axes": [[np.cos(TURN), np.sin(TURN), 0], [-np.sin(TURN), np.cos(TURN), 0], [0, 0, 1]],
        "size": [0.6, 0.5],
    },
]


def described() -> Description:
    return rigid_robot.described(plates=PLATES)


def trial(seconds: float = 2.0, start: float = 100.0, rate: float = 100.0, plate_rate: float = 1000.0) -> Trial:
    """Base markers that stand, hand markers that swing, plates loaded with a robot's weight and horizontal forces."""
    rng, n = np.random.default_rng(5), round(seconds * rate)
    t, s = np.arange(n) / rate, np.arange(round(seconds * plate_rate) - 3) / plate_rate
    T = rigid_robot.se3(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6]))
    p = np.concatenate([np.array(x) for _, x in rigid_robot.BODIES.values()]) @ T[:3, :3].T + T[:3, 3]
    swing = 0.1 * np.sin(2.0 * t)[:, None, None] * np.repeat([0.0, 1.0], 4)[:, None] * [1.0, 0.5, -0.3]
    p = p + swing
    p[20:35, 5] = np.nan
    f = np.stack([30 * np.sin(3 * s), 20 * np.cos(2 * s), -370.0 + 15 * np.sin(5 * s)], axis=1)
    wrench = []
    for k in range(len(PLATES)):
        r = np.array([0.05 * np.sin(s), -0.03 * np.cos(s), 0.0 * s]).T
        m = np.cross(r, f) + [0.0, 0.0, 0.7 * (k + 1)]
        wrench.append(np.concatenate([f, m], axis=1) + 0.1 * rng.normal(size=(len(s), 6)))
    names = tuple(f"{b}{i}" for b in rigid_robot.BODIES for i in range(4))
    joints = np.zeros((0, 8))
    return Trial(
        "log", rigid_robot.JOINTS, np.zeros(0), joints, joints, joints, joints, joints, names,
        tuple(n[:-1] for n in names), start + t, p, ("first", "turned"), start + 0.123 + s, np.stack(wrench, axis=1),
        np.array([p["centre"] for p in PLATES]),
    )  # fmt: skip


def mapping(**changes):
    description = json.loads(described().model_dump_json(by_alias=True))
    bodies = [{k: v for k, v in b.items() if k != "placement"} for b in description["bodies"]]
    setup = {k: v for k, v in description.items() if k not in ("schema", "trials", "bodies")}
    names = [m["name"] for b in bodies for m in b["markers"]]
    plates = {p["name"]: {"number": k + 1, "convention": "reaction"} for k, p in enumerate(PLATES)}
    return {
        "urdf": "tiago",
        "setup": setup,
        "bodies": bodies,
        "trials": [{"id": "log", "role": "calibration", "kind": "swing"}],
        "c3d": {"markers": {n: n for n in names}, "plates": plates},
    } | changes
