"""Motions: what the joints are commanded to do, as set-points at the robot's rate.

A motion follows a path q(s) at s(t), where ds/dt is a trapezoid: it rises to 1 in `ramp` seconds, stays, and falls.
Short ramps start and stop a swing abruptly, as on the real robot, whatever the path is.

    swing:  q_j(s) = c_j + A_j (sin(2 pi f_j s + phi_j) - sin phi_j)
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from calibration.schema import Kind, Role
from twin.base_path import BasePath
from twin.config_campaign import Campaign

JOINTS = ("torso_lift_joint", *(f"arm_{i}_joint" for i in range(1, 8)))
RATE = 100.0  # [Hz] of the set-points
SETTLE = 2.0  # [s] before a recording starts, not recorded
TAU = 2.0 * np.pi
BEYOND = np.array([5e-3, *7 * [5e-2]])  # how far off a joint turns to approach from a given side [m, rad]
_SWEEP_SPEED = 0.2 * np.pi  # [rad/s]


@dataclass(frozen=True)
class Motion:
    """Set-points of one trial.

    Attributes:
        id: Name of the trial.
        role: calibration | validation.
        kind: static | sweep | swing | spin | drive.
        name: Name of the motion.
        command: Set-points (n, 8) at RATE, recording starts at the first [m, rad].
        dwells: Start and stop of each rest (n_postures, 2) [s from the first set-point]; empty where there is none.
        approach: Sign of each joint's motion into each posture (n_postures, 8).
        payload: Mass in the hand [kg]; None: the campaign's.
        push: Force on the hand at each set-point (n, 3), tool axes [N]; None: none.
        base: Where the base goes; None: nowhere.
    """

    id: str
    role: Role
    kind: Kind
    name: str
    command: np.ndarray
    dwells: np.ndarray
    approach: np.ndarray
    payload: float | None = None
    push: np.ndarray | None = None
    base: BasePath | None = None

    @property
    def duration(self) -> float:
        """Duration of the recording [s]."""
        return (len(self.command) - 1) / RATE


@dataclass(frozen=True)
class Swing:
    """A periodic motion: centre, amplitude, frequency and phase of each joint.

    Attributes:
        start: Posture (8,) at s = 0 [m, rad].
        amplitude: (8,) [m, rad].
        frequency: (8,) [Hz].
        phase: (8,) [rad].
    """

    start: tuple[float, ...]
    amplitude: tuple[float, ...]
    frequency: tuple[float, ...]
    phase: tuple[float, ...]

    def at(self, s: np.ndarray) -> np.ndarray:
        """Path (n, 8) at path times s (n,) [s]."""
        c, A, f, phi = (np.array(v) for v in (self.start, self.amplitude, self.frequency, self.phase))
        return c + A * (np.sin(TAU * f * s[:, None] + phi) - np.sin(phi))


def path_time(t: np.ndarray, duration: float, ramp: float) -> np.ndarray:
    """s(t) (n,) [s] with trapezoidal ds/dt; reaches duration - ramp at t = duration, constant outside.

    Args:
        t: Times (n,) [s].
        duration: Of the whole motion, ramps included [s].
        ramp: Duration of each velocity ramp [s], at most half the duration.
    """
    ramp = min(ramp, duration / 2.0)
    t = np.clip(t, 0.0, duration)
    up, down = np.minimum(t, ramp), np.clip(t - (duration - ramp), 0.0, ramp)
    return t - ramp / 2.0 - np.where(t < ramp, t - ramp / 2.0 - up**2 / (2 * ramp), 0.0) - down**2 / (2 * ramp)


def _times(duration: float) -> np.ndarray:
    return np.arange(round(duration * RATE) + 1) / RATE


def swing(id: str, role: Role, kind: Kind, path: Swing, duration: float, campaign: Campaign) -> Motion:
    """A swing between two rests."""
    t = _times(duration + 2.0 * campaign.rest)
    s = path_time(t - campaign.rest, duration, campaign.ramp)
    return Motion(id, role, kind, id, path.at(s), *_no_dwells())


def pushed(id: str, role: Role, force: float, campaign: Campaign) -> Motion:
    """The hand held out in front, pushed sideways, towards the robot and down: two seconds each, with pauses."""
    t = _times(2.0 * campaign.rest + 3 * 4.0)
    push = np.zeros((len(t), 3))
    for k, axis in enumerate((1, 0, 2)):
        since = t - campaign.rest - 4.0 * k
        push[:, axis] = -force * np.clip(np.minimum(since / 0.2, (2.2 - since) / 0.2), 0.0, 1.0)
    still = np.repeat(np.array(_FORWARD)[None], len(t), axis=0)
    return Motion(id, role, "swing", id, still, *_no_dwells(), push=push)


def _no_dwells() -> tuple[np.ndarray, np.ndarray]:
    return np.empty((0, 2)), np.empty((0, len(JOINTS)), dtype=np.int8)


def postures(id: str, role: Role, through: np.ndarray, campaign: Campaign, sides: np.ndarray | None = None) -> Motion:
    """Rests in postures (n, 8), the first of them at the start, with straight moves in joint space between.

    Where `sides` (n - 1, 8) of -1, 0, 1 are given, each posture is reached by way of a point BEYOND * side before it.
    """
    pieces, dwells, clock = [np.repeat(through[:1], round(campaign.rest * RATE) + 1, axis=0)], [], campaign.rest
    via = through[1:] - (0.0 if sides is None else BEYOND * sides)
    for a, v, b in zip(through[:-1], via, through[1:], strict=True):
        stops = (b,) if (v == b).all() else (v, b)
        moves = [_straight(*ends, campaign) for ends in pairwise((a, *stops))]
        pieces += [*moves, np.repeat(b[None], round(campaign.dwell * RATE), axis=0)]
        clock += sum(map(len, moves)) / RATE + campaign.dwell
        dwells.append((clock - campaign.dwell, clock))
    last = np.where(through[1:] == via, through[1:] - through[:-1], through[1:] - via)
    approach = np.sign(np.round(last, 6)).astype(np.int8)
    return Motion(id, role, "static", id, np.concatenate(pieces), np.array(dwells), approach)


def _straight(a: np.ndarray, b: np.ndarray, campaign: Campaign) -> np.ndarray:
    """Set-points (n, 8) of a move, its start left out."""
    move = float(np.ceil(RATE * max(0.5, np.abs(b - a)[1:].max() / campaign.speed)) / RATE) + campaign.ramp
    s = path_time(_times(move)[1:], move, campaign.ramp) / (move - min(campaign.ramp, move / 2.0))
    return np.asarray(a + s[:, None] * (b - a))


# arm_1 = 1.5: arm forward, 0.3: to the right. arm_2 > 0 lifts the upper arm, arm_3 = -1.57 turns the elbow outwards.
_FORWARD = (0.12, 1.50, 0.10, -1.55, 0.60, 0.10, 0.10, 0.10)
_SIDE = (0.12, 0.35, 0.10, -1.55, 0.60, 0.10, 0.10, 0.10)


def _one(frequency: float, start: tuple[float, ...], amplitudes: tuple[float, ...]) -> Swing:
    n = len(JOINTS)
    return Swing(start, amplitudes, (frequency,) * n, (0.0,) * n)


# The paper's families: about each axis of the base, folding along two of them. 0.2 Hz, wrists moving along.
CALIBRATION_SWINGS = {
    "around_x": _one(0.2, _SIDE, (0.0, 0.0, 0.55, 0.0, 0.0, 0.5, -0.4, 0.5)),
    "around_y": _one(0.2, _FORWARD, (0.0, 0.0, 0.55, 0.0, 0.0, -0.5, 0.4, 0.5)),
    "around_z": _one(0.2, _FORWARD, (0.0, 0.70, 0.0, 0.0, 0.0, 0.5, 0.4, -0.5)),
    "x_fold": _one(0.2, (0.12, 1.5, -0.55, -3.0, 1.3, 0.1, 0.1, 0.1), (0.0, 0.0, 0.45, 0.0, -0.7, 0.4, -0.5, 0.4)),
    "y_fold": _one(0.2, (0.12, 0.4, -0.55, -3.0, 1.3, 0.1, 0.1, 0.1), (0.0, 0.0, 0.45, 0.3, -0.7, -0.4, -0.5, 0.4)),
}

# Never seen in calibration: all joints at once at unequal frequencies, and its mirror image.
_XYZ_FREQUENCY = (0.16, 0.20, 0.23, 0.17, 0.26, 0.19, 0.31, 0.22)
VALIDATION_SWINGS = {
    "xyz": Swing(
        (0.15, 1.30, 0.0, -1.60, 0.85, 0.0, 0.5, 0.0),
        (0.03, 0.45, 0.35, 0.40, 0.40, 0.6, 0.45, 0.6),
        _XYZ_FREQUENCY,
        (0.0, 0.0, 0.5, 1.0, 0.3, 0.8, 0.2, 1.2),
    ),
    "xyz_mirror": Swing(
        (0.15, 1.30, 0.0, -1.60, 0.85, 0.0, 0.5, 0.0),
        (0.03, -0.45, 0.35, -0.40, -0.40, -0.6, -0.45, -0.6),
        _XYZ_FREQUENCY[::-1],
        (0.0, 0.0, 0.9, 0.4, 1.1, 0.2, 0.7, 0.1),
    ),
}


def sweep_path(joint: str, duration: float) -> Swing:
    """One joint back and forth twice about a posture in which gravity loads most of the arm.

    It starts and stops at its highest speed, 0.63 rad/s at most: faster, and arm_1 pushes the base away.
    """
    index, amplitude = JOINTS.index(joint), min(0.6, _SWEEP_SPEED * duration / (2.0 * TAU))
    amplitudes = tuple(amplitude if i == index else 0.0 for i in range(len(JOINTS)))
    return _one(2.0 / duration, _FORWARD, amplitudes)
