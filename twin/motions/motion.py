"""Motions: what the joints are commanded to do, as set-points at the robot's rate.

A motion follows a path q(s) at s(t), where ds/dt is a trapezoid: it rises to 1 in `ramp` seconds, stays, and falls.
Short ramps start and stop a swing abruptly, as on the real robot, whatever the path is.

    swing:  q_j(s) = c_j + A_j (sin(2 pi f_j s + phi_j) - sin phi_j)
    base:   left = (way - yaw b/2) / r,    right = (way + yaw b/2) / r,    d way = (dx, dy) . (cos yaw, sin yaw)

The driven wheels of a base that moves: a differential drive without slip, b the track, r the wheels' radius; yaw in the
middle of each step.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from calibration.recording import schema
from twin.motions.campaign import Campaign
from twin.motions.swings import FORWARD, JOINTS, TAU, Swing, in_step
from twin.transforms import exp6

RATE = 100.0  # [Hz] of the set-points
REST = 1.5  # [s] before and after a motion, unless a campaign says otherwise
SETTLE = 2.0  # [s] before a recording starts, not recorded
BEYOND = np.array([5e-3, *7 * [5e-2]])  # how far off a joint turns to approach from a given side [m, rad]
_SWEEP_SPEED = 0.2 * np.pi  # [rad/s]


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


def halting_time(t: np.ndarray, duration: float, ramp: float, period: float) -> np.ndarray:
    """The same with equal rests between parts of a period each [s of the path]; one part where only one has room."""
    part = min(period + ramp, duration)
    n = int(duration / part + 1e-9)
    each = (duration - part) / max(n - 1, 1)
    return np.sum([path_time(t - k * each, part, ramp) for k in range(n)], axis=0)


def _times(duration: float) -> np.ndarray:
    return np.arange(round(duration * RATE) + 1) / RATE


def no_dwells() -> tuple[np.ndarray, np.ndarray]:
    """Dwells and approaches of a motion without rests in between."""
    return np.empty((0, 2)), np.empty((0, len(JOINTS)), dtype=np.int8)


def _straight(a: np.ndarray, b: np.ndarray, campaign: Campaign) -> np.ndarray:
    """Set-points (n, 8) of a move, its start left out."""
    ramp = campaign.ramp if campaign.posture_ramp is None else campaign.posture_ramp
    move = float(np.ceil(RATE * max(0.5, np.abs(b - a)[1:].max() / campaign.speed)) / RATE) + ramp
    s = path_time(_times(move)[1:], move, ramp) / (move - min(ramp, move / 2.0))
    return np.asarray(a + s[:, None] * (b - a))


def sweep_path(joint: str, duration: float) -> Swing:
    """One joint back and forth twice about a posture in which gravity loads most of the arm.

    It starts and stops at its highest speed, 0.63 rad/s at most: faster, and arm_1 pushes the base away.
    """
    index, amplitude = JOINTS.index(joint), min(0.6, _SWEEP_SPEED * duration / (2.0 * TAU))
    amplitudes = tuple(amplitude if i == index else 0.0 for i in range(len(JOINTS)))
    return in_step(2.0 / duration, FORWARD, amplitudes)


@dataclass(frozen=True)
class BasePath:
    """Path of the base during a motion.

    Attributes:
        planar: x, y [m] and yaw [rad] in the base frame at the start, (n, 3), one a set-point.
    """

    planar: np.ndarray

    def poses(self) -> np.ndarray:
        """T_start_base (n, 4, 4)."""
        T = exp6(np.column_stack([np.zeros((len(self.planar), 5)), self.planar[:, 2]]))
        T[:, :2, 3] = self.planar[:, :2]
        return T

    def wheel_angles(self, track: float, radius: float) -> np.ndarray:
        """Angles of the left and right wheel (n, 2) [rad] for a track and a wheel's radius [m], from zero."""
        step, yaw = np.diff(self.planar, axis=0), self.planar[:, 2]
        middle = 0.5 * (yaw[1:] + yaw[:-1])
        way = np.concatenate([[0.0], np.cumsum(step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle))])
        aside = 0.5 * track * (yaw - yaw[0])
        return np.column_stack([way - aside, way + aside]) / radius


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
        kinematic: Whether joints and base are where they are commanded to be, without physics.
    """

    id: str
    role: schema.Role
    kind: schema.Kind
    name: str
    command: np.ndarray
    dwells: np.ndarray
    approach: np.ndarray
    payload: float | None = None
    push: np.ndarray | None = None
    base: BasePath | None = None
    kinematic: bool = False

    @property
    def rolls(self) -> bool:
        """Whether the base moves on its wheels."""
        return self.base is not None and not self.kinematic

    @property
    def duration(self) -> float:
        """Duration of the recording [s]."""
        return (len(self.command) - 1) / RATE


def swing(id: str, role: schema.Role, kind: schema.Kind, path: Swing, duration: float, campaign: Campaign) -> Motion:
    """A swing between two rests."""
    t = _times(duration + 2.0 * campaign.rest)
    period = 1.0 / min(path.frequency) if path.halts else np.inf
    s = halting_time(t - campaign.rest, duration, campaign.ramp, period)
    return Motion(id, role, kind, id, path.at(s), *no_dwells())


def pushed(id: str, role: schema.Role, force: float, campaign: Campaign) -> Motion:
    """The hand held out in front, pushed sideways, towards the robot and down: two seconds each, with pauses."""
    t = _times(2.0 * campaign.rest + 3 * 4.0)
    push = np.zeros((len(t), 3))
    for k, axis in enumerate((1, 0, 2)):
        since = t - campaign.rest - 4.0 * k
        push[:, axis] = -force * np.clip(np.minimum(since / 0.2, (2.2 - since) / 0.2), 0.0, 1.0)
    still = np.repeat(np.array(FORWARD)[None], len(t), axis=0)
    return Motion(id, role, "swing", id, still, *no_dwells(), push=push)


def static_postures(
    id: str, role: schema.Role, through: np.ndarray, campaign: Campaign, sides: np.ndarray | None = None
) -> Motion:
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
