"""A robot without physics: Pinocchio's rigid chain with known defects, recorded like a laboratory would.

It shares its model with the pipeline on purpose: here what the pipeline must recover exactly is known.
    reading = angle + offset, angle = play(motor)        marker = T_lab_base T_base_body x + noise
"""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

import mjcf
from calibration.mocap.postures import Postures
from calibration.numerics.signals import play
from calibration.recording.schema import Description
from calibration.recording.trial import Trial, write_trial
from calibration.robot.blocks import BacklashPreload, Compliance, EncoderZeros, Frames
from calibration.robot.hand import HandModel

JOINTS = ("torso_lift_joint", *(f"arm_{i}_joint" for i in range(1, 8)))
GRID = 500.0
BODIES = {
    "base": ("base_footprint", [[0.15, 0.15, 0.3], [0.15, -0.15, 0.3], [-0.2, 0.0, 0.3], [0.0, 0.1, 0.45]]),
    "gripper": (
        "gripper_grasping_frame",
        [[-0.1, 0.08, 0.0], [-0.1, -0.08, 0.0], [-0.2, 0.0, 0.09], [-0.12, 0.0, -0.08]],
    ),
}
CENTRE = np.array([0.12, 1.5, -0.2, -1.4, 0.9, 0.0, 0.1, 0.1])


@dataclass(frozen=True)
class Readings:
    """Of a trial, both sides, the motors' corrected."""

    q_motor: np.ndarray
    q_link: np.ndarray


@dataclass(frozen=True)
class Truth:
    xi: np.ndarray = field(default_factory=lambda: np.zeros((8, 6)))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(8))
    base: np.ndarray = field(default_factory=lambda: np.zeros(6))
    hand: np.ndarray = field(default_factory=lambda: np.zeros(6))
    half_gap: np.ndarray = field(default_factory=lambda: np.zeros(8))
    robot: tuple[float, float] = (3.9, 40e-6)
    plate: tuple[float, float] = (-2.7, -25e-6)
    marker_sigma: float = 1e-4
    encoder_quantum: float = 1.534e-5


def defects(seed: int, scale: float = 1.0) -> Truth:
    rng = np.random.default_rng(seed)
    size = np.array([1.35e-3] * 3 + [2.7e-3] * 3)
    offset = np.array([0.0, 4e-3, -3e-3, 4e-3, -4e-3, 0.106, 0.024, 0.027])
    return Truth(
        xi=scale * size * rng.normal(size=(8, 6)),
        offset=scale * offset,
        base=scale * np.array([2e-3] * 3 + [4e-3] * 3) * rng.normal(size=6),
        hand=scale * np.array([2e-3] * 3 + [1e-2] * 3) * rng.normal(size=6),
    )


def model(truth: Truth, root: pin.JointModel | None = None) -> pin.Model:
    text = mjcf.urdf()
    full = pin.buildModelFromXML(text) if root is None else pin.buildModelFromXML(text, root)
    keep = {"universe", "root_joint", *JOINTS}
    m = pin.buildReducedModel(full, [full.getJointId(n) for n in full.names if n not in keep], pin.neutral(full))
    for name, xi in zip(JOINTS, truth.xi, strict=True):
        i = m.getJointId(name)
        m.jointPlacements[i] = m.jointPlacements[i] * pin.exp6(xi)
    return m


def se3(vector: np.ndarray) -> np.ndarray:
    return pin.SE3(pin.exp3(vector[3:]), vector[:3]).homogeneous


def hand_in_base(truth: Truth, q: np.ndarray) -> np.ndarray:
    """T_B_H of the two marker bodies at joint ANGLES q (n, 8)."""
    m = model(truth)
    d = m.createData()
    left, right = np.linalg.inv(se3(truth.base)), se3(truth.hand)
    out = np.empty((len(q), 4, 4))
    for k, q_k in enumerate(q):
        pin.framesForwardKinematics(m, d, q_k)
        base, tool = (d.oMf[m.getFrameId(BODIES[b][0])] for b in ("base", "gripper"))
        out[k] = left @ base.actInv(tool).homogeneous @ right
    return out


def positions(T: np.ndarray, xyz: list[list[float]]) -> np.ndarray:
    """Markers (n, m, 3) of a cluster along its poses (n, 4, 4)."""
    return np.einsum("nij,mj->nmi", T[:, :3, :3], np.array(xyz)) + T[:, None, :3, 3]


def random_angles(rng: np.random.Generator, n: int, torso: bool = True) -> np.ndarray:
    m = model(Truth())
    q = np.array([rng.uniform(m.lowerPositionLimit, m.upperPositionLimit) for _ in range(n)])
    if not torso:
        q[:, 0] = 0.15
    return q


def sweep(joint: int, amplitude: float = 0.5, seconds: float = 20.0, frequency: float = 0.2) -> np.ndarray:
    """Motor angles on GRID: a second of rest, abrupt start, a sine, abrupt stop, rest."""
    t = np.arange(int((seconds + 3.0) * GRID)) / GRID
    s = np.clip(t - 1.5, 0.0, seconds)
    ramp = 0.1
    s = np.where(s < ramp, s**2 / (2 * ramp), s - ramp / 2)
    q = np.tile(CENTRE, (len(t), 1))
    q[:, joint] += amplitude * np.sin(2 * np.pi * frequency * s)
    return q


def swing(amplitudes: np.ndarray, frequencies: np.ndarray, seconds: float = 20.0) -> np.ndarray:
    q = np.zeros_like(sweep(1, 0.0, seconds))
    for j in range(8):
        q[:, j] = sweep(j, amplitudes[j], seconds, frequencies[j])[:, j]
    return q


def through(postures: np.ndarray, dwell: float = 1.0, move: float = 1.5) -> tuple[np.ndarray, np.ndarray]:
    """Motor angles on GRID through postures, and the dwells (n, 2) [s]."""
    n_dwell, n_move = int(dwell * GRID), int(move * GRID)
    s = np.linspace(0.0, 1.0, n_move)[:, None] ** 2 * (3.0 - 2.0 * np.linspace(0.0, 1.0, n_move)[:, None])
    parts, dwells, n = [np.repeat(postures[:1], int(1.2 * GRID), axis=0)], [], int(1.2 * GRID)
    for a, b in zip(postures[:1].tolist() + postures[:-1].tolist(), postures, strict=True):
        parts += [np.array(a) + s * (b - np.array(a)), np.repeat(b[None], n_dwell, axis=0)]
        dwells.append((n + n_move, n + n_move + n_dwell))
        n += n_move + n_dwell
    return np.concatenate(parts), np.array(dwells) / GRID


def record(
    truth: Truth,
    motor: np.ndarray,
    start: float,
    rng: np.random.Generator,
    dwells: np.ndarray | None = None,
    plate: bool = True,
) -> Trial:
    """A trial along motor angles (n, 8) on GRID; `start` [s] on the mocap clock."""
    t = np.arange(len(motor)) / GRID
    link = play(motor, truth.half_gap)

    def at(x: np.ndarray, when: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(when, t, column) for column in x.T], axis=1)

    n = int(t[-1] * 100.0)
    t_mocap = np.arange(n) / 100.0
    t_robot = np.arange(n) / 100.0 + rng.uniform(0.0, 0.01)
    reading = at(motor, t_robot) + truth.offset
    if truth.encoder_quantum:
        reading = np.round(reading / truth.encoder_quantum) * truth.encoder_quantum
    T_lab_base = se3(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6]))
    T_lab_B = T_lab_base @ se3(truth.base)
    T = {"base": np.repeat(T_lab_B[None], n, axis=0), "gripper": T_lab_B @ hand_in_base(truth, at(link, t_mocap))}
    position = np.concatenate([positions(T[b], x) for b, (_, x) in BODIES.items()], axis=1)
    position = position + truth.marker_sigma * rng.normal(size=position.shape)
    t_plate = np.arange(int(t[-1] * 200.0)) / 200.0 + 0.5 / 200.0
    wrench = np.zeros((len(t_plate), 6))
    if plate:
        some = slice(None, None, 5)
        found = plate_wrench(truth, link[some], T_lab_base, GRID / 5.0)
        wrench = np.stack([np.interp(t_plate, t[some], w) for w in found.T], axis=1)
    dwells = np.zeros((0, 2)) if dwells is None else dwells
    zeros = np.zeros((n, 8))

    def clock(t: np.ndarray, epoch: tuple[float, float]) -> np.ndarray:
        return (t + start - epoch[0]) / (1.0 + epoch[1])

    return Trial(
        "trial", JOINTS, clock(t_robot, truth.robot), reading, zeros + np.nan, zeros, zeros, zeros,
        tuple(f"{b}{i}" for b, (_, x) in BODIES.items() for i in range(len(x))),
        tuple(b for b, (_, x) in BODIES.items() for _ in x),
        t_mocap + start, position, ("plate",), clock(t_plate, truth.plate),
        (wrench + rng.normal(size=(len(t_plate), 6)) * np.array([1.5] * 3 + [0.4] * 3))[:, None],
        np.zeros((1, 3)), dwells[:, 0] + start, dwells[:, 1] + start,
    )  # fmt: skip


def plate_wrench(truth: Truth, q: np.ndarray, T_lab_base: np.ndarray, rate: float) -> np.ndarray:
    """Action on the plate (n, 6) about the lab origin, base held still."""
    m = model(truth, pin.JointModelFreeFlyer())
    d = m.createData()
    v = np.gradient(q, 1.0 / rate, axis=0)
    a = np.gradient(v, 1.0 / rate, axis=0)
    root = pin.SE3(T_lab_base)
    start = pin.SE3ToXYZQUAT(root)
    out, zero = np.empty((len(q), 6)), np.zeros(6)
    for k in range(len(q)):
        tau = pin.rnea(m, d, np.r_[start, q[k]], np.r_[zero, v[k]], np.r_[zero, a[k]])
        out[k] = -root.act(pin.Force(tau[:6])).vector
    return out


def without_plate(trial: Trial) -> Trial:
    empty = {"plate": (), "t_plate": np.zeros(0), "plate_wrench": np.zeros((0, 0, 6)), "plate_centre": np.zeros((0, 3))}
    return replace(trial, **empty)


def description(trials: list[dict], **changes: object) -> dict:
    bodies = [
        {"name": b, "link": link, "markers": [{"name": f"{b}{i}", "xyz": p} for i, p in enumerate(x)]}
        for b, (link, x) in BODIES.items()
    ]
    return {
        "schema": 1, "robot": "matched", "base_frame": "base_footprint", "tool_frame": "gripper_grasping_frame",
        "joints": [{"name": j, "encoders": ["motor"], "rate": 100.0} for j in JOINTS], "bodies": bodies,
        "plates": [{"name": "plate", "centre": [0, 0, 0], "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "size": [2, 2]}],
        "sigmas": {"marker": 1e-4, "encoder": 1e-5, "plate_force": 1.5, "plate_moment": 0.4},
        "tolerances": {
            "joint_translation": 2e-3, "joint_rotation": 4e-3, "encoder_offset": 0.1, "joint_play": 5e-3,
            "body_translation": 4e-3, "body_rotation": 1e-2, "link_mass": 0.05, "link_com": 5e-3,
        },
        "trials": trials,
    } | changes  # fmt: skip


def described(**changes: object) -> Description:
    return Description.model_validate(description([], **changes))


def write(folder: Path, trials: list[tuple[str, str, str, Trial]], **changes: object) -> Path:
    """A dataset folder from (id, role, kind, trial)."""
    (folder / "trials").mkdir(parents=True)
    entries = []
    for name, role, kind, trial in trials:
        file = f"trials/{name}.nc"
        digest = write_trial(folder / file, trial)
        entries.append({"id": name, "role": role, "kind": kind, "motion": name, "file": file, "sha256": digest})
    (folder / "dataset.json").write_text(json.dumps(description(entries, **changes), indent=1))
    (folder / "nominal.urdf").write_text(mjcf.urdf())
    return folder


def near_postures(rng: np.random.Generator, n: int, torso: bool = True) -> np.ndarray:
    span = np.array([0.2, 1.2, 1.0, 1.2, 1.2, 1.8, 1.2, 1.8])
    q = CENTRE + rng.uniform(-0.5, 0.5, size=(n, 8)) * span
    if not torso:
        q[:, 0] = CENTRE[0]
    return q


def campaign(folder: Path, truth: Truth, seed: int = 0, n_postures: int = 20, plate: bool = True) -> Path:
    """A short campaign: one static trial, three sweeps, a swing; validation: a swing and a static trial."""
    rng = np.random.default_rng(seed)
    static, dwells = through(near_postures(rng, n_postures))
    other, other_dwells = through(near_postures(rng, 4))
    amplitudes = np.array([0.02, 0.4, 0.3, 0.4, 0.4, 0.5, 0.4, 0.5])
    frequencies = np.array([0.1, 0.2, 0.23, 0.17, 0.26, 0.19, 0.31, 0.22])
    plan = [
        ("postures", "calibration", "static", static, dwells),
        *((f"sweep{j}", "calibration", "sweep", sweep(j, seconds=10.0), None) for j in (1, 2, 4)),
        ("swing", "calibration", "swing", swing(amplitudes, frequencies, 10.0), None),
        ("xyz", "validation", "swing", swing(amplitudes, frequencies[::-1], 10.0), None),
        ("others", "validation", "static", other, other_dwells),
    ]
    trials, start = [], 12.0
    for name, role, kind, motor, rests in plan:
        trial = record(truth, motor, start, rng, rests, plate)
        trials.append((name, role, kind, trial if plate else without_plate(trial)))
        start += len(motor) / GRID + 20.0
    return write(folder, trials)


def postures(truth: Truth, q: np.ndarray, sigma: float = 1e-9, seed: int = 0) -> Postures:
    """Static postures at joint angles q (n, 8), pose noise sigma [m, rad] on every axis, no file between."""
    rng = np.random.default_rng(seed)
    T = np.array([T @ se3(sigma * rng.normal(size=6)) for T in hand_in_base(truth, q)])
    return Postures(q + truth.offset, T, np.tile(sigma**2 * np.eye(6), (len(q), 1, 1)), np.zeros(len(q)))


_READINGS = {"offset": EncoderZeros, "compliance": Compliance, "gap": BacklashPreload}


def with_values(model: HandModel, **values: np.ndarray) -> HandModel:
    """The model with other values of base, hand, offset, compliance or gap."""
    frames = np.concatenate([values.get("base", model.base), values.get("hand", model.hand)])
    new = {Frames: frames} | {kind: values[name] for name, kind in _READINGS.items() if name in values}
    blocks = tuple(replace(b, values=np.asarray(new.get(type(b), b.values))) for b in model.blocks)
    return replace(model, blocks=blocks)
