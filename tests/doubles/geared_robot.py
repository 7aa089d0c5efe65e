"""A robot whose links hang behind loaded gears, quasi-static, without a simulator: what a clock must not take for lag.

    motor - link = h sgn(tau) + tau / k,   tau = tau_gravity(q) + c dq/dt + f,   |f| <= coulomb friction

A link stays where it is while friction can hold it there, so it is the play operator with the moving bounds
motor - d(tau_g + c dq/dt +- f_max), d(tau) = h sgn(tau) + tau / k. Stamps jitter about the ticks of the robot's clock.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from calibration.recording.trial import Trial
from tests.doubles import rigid_robot
from twin.instruments import Clock

GRID = 250.0
_COARSE = 5  # gravity is computed on every so many samples


@dataclass(frozen=True)
class Gears:
    half_gap: np.ndarray
    stiffness: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray

    def behind(self, tau: np.ndarray) -> np.ndarray:
        return self.half_gap * np.sign(tau) + tau / self.stiffness


def gears(rng: np.random.Generator) -> Gears:
    """The default robot's drives, each value within 30 %; friction, cold or worn in, by a factor of the whole robot.

    Viscous friction over stiffness is 42 to 56 us times that factor, exp N(0, 0.6^2): what `lateness` declares.
    """
    gap = np.array([0.0, 2.0, 2.0, 3.0, 3.0, 6.0, 24.0, 20.0]) * 1e-3
    k = np.array([1e9, 9e3, 9e3, 6e3, 6e3, 1.2e3, 1e3, 1e3])
    f = np.array([1e-9, 0.6, 0.6, 0.5, 0.5, 0.15, 0.15, 0.15])
    c = np.array([0.0, 0.5, 0.5, 0.3, 0.3, 0.05, 0.05, 0.05])
    rubs = float(np.exp(0.6 * rng.normal()))
    return Gears(*(x * rng.uniform(0.7, 1.3, 8) for x in (0.5 * gap, k, rubs * f, rubs * c)))


def swing(rng: np.random.Generator, seconds: float = 60.0) -> np.ndarray:
    """Motor angles (n, 8) on GRID: every joint at a frequency of its own, about a drawn posture, rest at both ends."""
    amplitudes = np.array([0.02, 0.4, 0.3, 0.4, 0.4, 0.5, 0.4, 0.5]) * rng.uniform(0.7, 1.2, 8)
    frequencies = rng.permutation([0.1, 0.2, 0.23, 0.17, 0.26, 0.19, 0.31, 0.22])
    q = rigid_robot.swing(amplitudes, frequencies, seconds)[:: int(rigid_robot.GRID / GRID)]
    return q + 0.2 * rng.uniform(-1.0, 1.0, 8) * np.array([0.0, 1, 1, 1, 1, 1, 1, 1])


def sweep(joint: int, seconds: float = 15.0) -> np.ndarray:
    """Motor angles (n, 8) on GRID of one joint back and forth."""
    return rigid_robot.sweep(joint, seconds=seconds)[:: int(rigid_robot.GRID / GRID)]


def statics(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Motor angles (n, 8) on GRID through n postures, and the dwells."""
    q, dwells = rigid_robot.through(rigid_robot.near_postures(rng, n))
    return q[:: int(rigid_robot.GRID / GRID)], dwells


def link_angles(truth: rigid_robot.Truth, drives: Gears, motor: np.ndarray) -> np.ndarray:
    """Link angles (n, 8) behind motor angles."""
    m = rigid_robot.model(truth)
    m.gravity = pin.Motion(np.array([0.0, 0.0, -9.81, 0.0, 0.0, 0.0]))
    d, t = m.createData(), np.arange(len(motor))
    some = np.append(t[:-1:_COARSE], t[-1])
    coarse = np.array([pin.computeGeneralizedGravity(m, d, q).copy() for q in motor[some]])
    tau = np.stack([np.interp(t, some, column) for column in coarse.T], axis=1)
    tau += drives.viscous * np.gradient(motor, 1.0 / GRID, axis=0)
    low, high = motor - drives.behind(tau + drives.coulomb), motor - drives.behind(tau - drives.coulomb)
    link = np.empty_like(motor)
    link[0] = 0.5 * (low[0] + high[0])
    for k in range(1, len(motor)):
        link[k] = np.minimum(np.maximum(link[k - 1], low[k]), high[k])
    return link


def record(
    truth: rigid_robot.Truth,
    drives: Gears,
    motor: np.ndarray,
    start: float,
    rng: np.random.Generator,
    jitter: float = 0.0,
    dwells: np.ndarray | None = None,
) -> Trial:
    """A trial along motor angles (n, 8) on GRID, `start` [s, mocap clock]; stamps jitter by `jitter` [s]."""
    t = np.arange(len(motor)) / GRID
    link = link_angles(truth, drives, motor)
    shown, true = Clock("robot", *truth.robot).ticks(start, start + t[-1], 100.0)
    dwells = np.zeros((0, 2)) if dwells is None else dwells

    def at(x: np.ndarray, when: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(when, t, column) for column in x.T], axis=1)

    n = int(t[-1] * 100.0)
    t_mocap, zeros = np.arange(n) / 100.0, np.zeros((len(shown), 8))
    T_lab_B = rigid_robot.se3(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6])) @ rigid_robot.se3(truth.base)
    T = {"base": np.repeat(T_lab_B[None], n, axis=0)}
    T["gripper"] = T_lab_B @ rigid_robot.hand_in_base(truth, at(link, t_mocap))
    position = np.concatenate([rigid_robot.positions(T[b], x) for b, (_, x) in rigid_robot.BODIES.items()], axis=1)
    reading = at(motor, true - start) + truth.offset
    labels = [(f"{b}{i}", b) for b, (_, x) in rigid_robot.BODIES.items() for i in range(len(x))]
    trial = Trial(
        "trial", rigid_robot.JOINTS, shown + jitter * np.clip(rng.normal(size=len(shown)), -4.5, 4.5),
        np.round(reading / truth.encoder_quantum) * truth.encoder_quantum, zeros + np.nan, zeros, zeros, zeros,
        tuple(m for m, _ in labels), tuple(b for _, b in labels), t_mocap + start,
        position + truth.marker_sigma * rng.normal(size=position.shape),
    )  # fmt: skip
    return replace(trial, dwell_start=dwells[:, 0] + start, dwell_stop=dwells[:, 1] + start, approach=np.zeros((0, 0)))
