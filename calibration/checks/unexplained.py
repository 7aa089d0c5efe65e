"""What a calibrated geometry leaves of the hand's poses along all motion, and what columns explain of that.

    r_i = log6(T_measured_i^-1 T_B_H(q_i)) = J_theta e + J_g g + C x + noise                            [m, rad]

e are the errors of the geometry, as large as its fit says, g gears' compliance and backlash under gravity, as large as
gears are: both are taken out of r and C alike. What is left is divided by its own size, and the variance of x sums over
blocks of time, because gears lag for as long as a motion lasts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from calibration.inference.parameters import Model
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import passed_rows, readings_at
from calibration.numerics.lie import inverse, log6
from calibration.recording.clock import Clock
from calibration.robot.blocks import BacklashPreload, Compliance
from calibration.robot.hand import HandModel, HandPoses

_SPACING, _MOST = 0.25, 600  # [s] between samples, at least; so many of them, about
_STEP = 0.02  # [s] either side, for velocities
_BLOCK = 4.0  # [s] of samples that hang together
_CORRELATED = 0.25  # share of a block's samples that count as one, at least: a few blocks do not show their scatter
_PLAY = 1e-2  # [rad, rad/(N.m)] width of what gears do under gravity


@dataclass(frozen=True)
class Passed:
    """Samples of all trials.

    Attributes:
        trial: (n,) number of the trial.
        t: (n,) [s, mocap clock].
        q: (n, n_measured) readings [rad, m].
        v: (n, n_measured) their velocities [rad/s, m/s].
        link: (n, n_measured) link readings [rad, m], NaN without one.
        T: (n, 4, 4) measured T_B_H.
        late: (n,) standard deviation of the readings' clock [s].
        payload: (n,) what is in the hand [kg].
    """

    trial: np.ndarray
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    link: np.ndarray
    T: np.ndarray
    late: np.ndarray
    payload: np.ndarray


@dataclass(frozen=True)
class Unexplained:
    """What a calibrated geometry leaves of the hand's poses.

    Attributes:
        hand: Calibrated.
        x: Samples.
        J: (n, 6, k) derivatives by joint position.
        r: (6 n,) residuals over their size, what errors of the geometry and of gears explain taken out.
        keep: Takes the same out of columns (n, 6, g), in the same units, (6 n, g).
        rms: Of the hand's position, before anything is taken out [m].
    """

    hand: HandModel
    x: Passed
    J: np.ndarray
    r: np.ndarray
    keep: Callable[[np.ndarray], np.ndarray]
    rms: float

    def fitted(self, columns: np.ndarray, tested: int | None = None) -> tuple[np.ndarray, np.ndarray, float]:
        """Sizes (g,) of the first `tested` of columns, all where None, their covariance (g, g), and what they explain.

        Columns (n, 6, m); the other ones are fitted as well.
        """
        C = self.keep(columns)
        g = C.shape[1] if tested is None else tested
        value, S, H_inv = _fitted(C, self.r, _blocks(self.x))
        value = value[:g]
        return value, S[:g, :g], float(value @ np.linalg.solve(H_inv[:g, :g], value))


def unexplained(hand: HandModel, model: Model, x: Passed) -> Unexplained:
    """Residuals of samples x of a hand with the values of an estimated model."""
    known = [k for k, p in enumerate(model.parameters) if p.name in hand.names]
    names, covariance = [model.parameters[k].name for k in known], model.random_covariance[np.ix_(known, known)]
    gears = [n for kind in (Compliance, BacklashPreload) for n in hand.block(kind).names if n not in names]
    at = _loaded(hand, x, (*names, *gears))
    r, p = log6(inverse(x.T) @ at.T), len(names)
    size = np.repeat([np.sqrt((r[:, part] ** 2).mean()) for part in (slice(3), slice(3, 6))], 3)
    B = np.concatenate([at.J[:, :, :p] @ _root(covariance), _PLAY * at.J[:, :, p:]], axis=2) / size[:, None]
    without = _without(_stacked(B))
    return Unexplained(
        hand,
        x,
        at.J_joint,
        without((r / size).ravel()),
        lambda columns: without(_stacked(columns / size[:, None])),
        float(np.sqrt((r[:, :3] ** 2).sum(axis=1).mean())),
    )


def _loaded(hand: HandModel, x: Passed, names: Sequence[str]) -> HandPoses:
    """Poses and derivatives, the payload of its trial in the hand at every sample."""
    found: list[HandPoses] = []
    masses, of = np.unique(x.payload, return_inverse=True)
    for k, mass in enumerate(masses):
        loaded, q = hand.carrying(float(mass)), x.q[of == k]
        found.append(loaded.poses_and_derivatives(q, loaded.chain.gravity_torques(loaded.angles(q)), names))
    back = np.argsort(np.argsort(of, kind="stable"))
    return HandPoses(*(np.concatenate([getattr(part, f.name) for part in found])[back] for f in fields(HandPoses)))


def passed(trials: Sequence[MeasuredTrial], robot: Clock) -> Passed:
    """Samples along all trials, their first seconds left out."""
    seconds = sum(float(t.t_mocap[-1] - t.t_mocap[0]) for t in trials)
    found = []
    for k, trial in enumerate(trials):
        t = trial.t_mocap
        rows = passed_rows(t, max(_SPACING, seconds / _MOST))
        before, q, after = (readings_at(trial, robot, t[rows] + d, trial.q_motor) for d in (-_STEP, 0.0, _STEP))
        T = trial.T_base_hand[rows]
        good = np.isfinite(before + q + after).all(axis=1) & np.isfinite(T).all(axis=(1, 2))
        v = (after - before) / (2.0 * _STEP)
        link = readings_at(trial, robot, t[rows], trial.q_link)
        at = t[rows][good]
        late = robot.sigma_at(robot.from_mocap(at))
        payload = np.full(good.sum(), trial.description.payload_of(trial.id))
        found.append((np.full(good.sum(), k), at, q[good], v[good], link[good], T[good], late, payload))
    return Passed(*(np.concatenate(x) for x in zip(*found, strict=True)))


def _stacked(columns: np.ndarray) -> np.ndarray:
    return columns.reshape(-1, columns.shape[2])


def _root(covariance: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _without(B: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """What is left of columns when those of B (m, p), each of unit size before the data, explain what they can."""
    root = np.linalg.cholesky(B.T @ B + np.eye(B.shape[1]))
    W = np.linalg.solve(root, B.T)
    return lambda c: c - W.T @ (W @ c)


def _blocks(x: Passed) -> np.ndarray:
    """(n,) number of the block of time each sample belongs to."""
    return np.unique(np.stack([x.trial, (x.t // _BLOCK).astype(int)], axis=1), axis=0, return_inverse=True)[1].ravel()


def _fitted(C: np.ndarray, y: np.ndarray, blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sizes (g,) of columns C (6 n, g), their covariance (g, g), residuals of a block hanging together, (C'C)^-1."""
    H = C.T @ C + 1e-12 * np.trace(C.T @ C) * np.eye(C.shape[1])
    value = np.linalg.solve(H, C.T @ y)
    each = (C * (y - C @ value)[:, None]).reshape(len(blocks), 6, -1).sum(axis=1)
    summed = np.zeros((blocks.max() + 1, C.shape[1]))
    np.add.at(summed, blocks, each)
    H_inv = np.linalg.inv(H)
    least = _CORRELATED * len(blocks) / len(summed) * float(((y - C @ value) ** 2).mean())
    return value, H_inv @ (summed.T @ summed) @ H_inv + least * H_inv, H_inv
