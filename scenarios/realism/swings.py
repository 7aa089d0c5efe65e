"""A swing of one sampled robot in the figures the log of a real one was read by, in lab axes.

    rotation      of the base's markers since rest; raw with start and stop, low-passed at 2.5 Hz for steady cycles
    displacement  of their centroid, raw
    wrench        about the plate's centre, low-passed at 2.5 Hz

peak to peak, but for `set`: how far the heading at the end is from that at the start.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.numerics.signals import RATE, Signal, low_passed, play
from calibration.recording import Trial
from scenarios.realism.arm_as_logged import AS_LOGGED
from twin import motions
from twin.campaign import EPOCH, laboratory, measure
from twin.config import TwinConfig
from twin.random_streams import generator
from twin.simulation import simulate

RAMP = (0.07, 0.09)  # [s] in which the log's hand starts: its markers show it, samples are 10 ms apart
_SLOW = 2.5  # [Hz]
_TRANSIENT = 3.0  # [s] after a start in which a swing is not steady
_OPERATORS = 8


@dataclass(frozen=True)
class Figures:
    """Peak to peak [rad, m, N, N.m], and the set [rad]."""

    steady_roll: float
    steady_pitch: float
    steady_yaw: float
    roll: float
    pitch: float
    yaw: float
    set: float
    x: float
    y: float
    z: float
    Fz: float
    Mx: float
    My: float
    Mz: float


LOG = {
    "steady_roll": (1.7e-3, 1.7e-3),
    "steady_pitch": (2.8e-3, 2.8e-3),
    "steady_yaw": (5.4e-3, 6.6e-3),
    "roll": (2.9e-3, 2.9e-3),
    "pitch": (5.8e-3, 5.8e-3),
    "yaw": (47e-3, 47e-3),
    "set": (5e-3, 5e-3),
    "x": (5.1e-3, 5.1e-3),
    "y": (3.9e-3, 3.9e-3),
    "z": (0.4e-3, 0.4e-3),
    "Fz": (19.0, 19.0),
    "Mx": (35.0, 35.0),
    "My": (65.0, 65.0),
    "Mz": (25.0, 25.0),
}
"""The log's, of its whole 56 s; the steady yaw depends on which cycles are taken."""


@dataclass(frozen=True)
class YawFromMoment:
    """How much of the yaw's variance in the second half of the motion Mz explains, fitted to the first.

    Attributes:
        linear: R2 of yaw = a Mz + b.
        hysteretic: R2 with play operators of Mz added.
    """

    linear: float
    hysteretic: float


@dataclass(frozen=True)
class SwingResponse:
    """Base and wrench of a trial on one even grid.

    Attributes:
        t: (n,) [s from the trial's start].
        rotation: (n, 3) [rad, lab].
        centroid: (n, 3) [m, lab].
        wrench: (n, 6) [N, N.m, lab, about the plate's centre].
    """

    t: np.ndarray
    rotation: np.ndarray
    centroid: np.ndarray
    wrench: np.ndarray

    def slow(self, x: np.ndarray) -> np.ndarray:
        """x (n, c) without what is faster than 2.5 Hz."""
        return low_passed(Signal(self.t, x, np.ones(len(x), dtype=bool)), _SLOW).x


def swung(config: TwinConfig, seed: int) -> SwingResponse:
    """Simulate and measure a swing of a sampled robot; how the arm carries the hand, and the ramp, are sampled too."""
    rng = generator(seed, "arm")
    path = AS_LOGGED[int(rng.integers(len(AS_LOGGED)))]
    lab = laboratory(config, seed)
    c = replace(lab.config.campaign, ramp=float(rng.uniform(*RAMP)))
    motion = motions.swing("as_logged", "validation", "swing", path, c.validation_swing, c)
    trial, _ = measure(lab, motion, simulate(lab.twin, motion, lab.T_lab_base), EPOCH)
    clock = lab.config.instruments.plate_clock
    return swing_response(trial, trial.t_plate * (1.0 + clock.drift) + clock.offset)


def swing_response(trial: Trial, t_plate: np.ndarray) -> SwingResponse:
    """Base and wrench of a trial whose plate's samples were at t_plate [s, mocap clock]."""
    base = trial.marker_position[:, trial.markers_of("base")]
    centroid = base.mean(axis=1)
    first = trial.t_mocap <= trial.t_mocap[0] + 1.0
    at_rest = base[first].mean(axis=0)
    arms = base - centroid[:, None]
    turned = [Rotation.align_vectors(a, at_rest - at_rest.mean(axis=0))[0].as_rotvec() for a in arms]
    size = max(1, round(1.0 / RATE / float(np.median(np.diff(t_plate)))))
    n = len(t_plate) // size * size
    t_block = t_plate[:n].reshape(-1, size).mean(axis=1)
    blocks = trial.plate_wrench[:n, 0].reshape(-1, size, 6).mean(axis=1)
    wrench = np.stack([np.interp(trial.t_mocap, t_block, column) for column in blocks.T], axis=1)
    return SwingResponse(trial.t_mocap - trial.t_mocap[0], np.array(turned), centroid - at_rest.mean(axis=0), wrench)


def figures(s: SwingResponse, rest: float) -> Figures:
    """The figures of a swing between two rests of `rest` [s]."""
    steady = (s.t > rest + _TRANSIENT) & (s.t < s.t[-1] - rest - 1.0)
    calm, load = s.slow(s.rotation)[steady], s.slow(s.wrench)
    end, start = s.t > s.t[-1] - 0.5, s.t < 1.0
    shift = abs(float(s.rotation[end, 2].mean() - s.rotation[start, 2].mean()))
    values = (*np.ptp(calm, axis=0), *np.ptp(s.rotation, axis=0), shift, *np.ptp(s.centroid, axis=0))
    return Figures(*map(float, (*values, *np.ptp(load[:, 2:], axis=0))))


def matrix(found: list[Figures]) -> np.ndarray:
    """(n, 14) of n figures."""
    return np.array([[getattr(f, field.name) for field in fields(Figures)] for f in found])


def yaw_from_moment(yaw: np.ndarray, moment: np.ndarray) -> YawFromMoment:
    """Fit yaw (n,) by Mz (n,) on the first half, judge on the second."""
    half, u = len(yaw) // 2, moment - moment[0]
    gaps = np.abs(u).max() * np.arange(1, _OPERATORS + 1) / (_OPERATORS + 1)
    played = play(np.repeat(u[:, None], _OPERATORS, axis=1), gaps)
    linear = np.column_stack([np.ones(len(u)), u])

    def judged(A: np.ndarray) -> float:
        theta = np.linalg.lstsq(A[:half], yaw[:half])[0]
        left, there = yaw[half:] - A[half:] @ theta, yaw[half:] - yaw[half:].mean()
        return float(1.0 - (left @ left) / (there @ there))

    return YawFromMoment(judged(linear), judged(np.column_stack([linear, played])))
