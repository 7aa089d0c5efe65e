"""What hangs on the wrist's sensor beyond the nominal links and the declared payload, weighed in all trials together.

    w + f = -Y(q, v, a) (dphi + m_p [0, d]) + z        w  readings, f of what is nominal, see `robot.wrist_sensor`

Y (6, 4): regressor of a mass and its first moment, linear; dphi (4,) of links, the same in all trials; d (3,) how far
the payload's centre is from where it is declared, m_p its mass in the trial; z the sensor's zero in the trial. Means of
a second: what links do behind their gears is faster. Each trial's forces and moments weigh by what is left of them; a
normal prior by the tolerances. Trials in which the hand is pushed are left out. With one payload alone
only the sum is known; how it divides into dphi and d is the prior's.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE
from calibration.recording.schema import Description, Tolerances
from calibration.recording.trial import Trial
from calibration.robot.wrist_sensor import (
    STRIDE,
    Push,
    SmoothReadings,
    WristSensor,
    smoothed,
    wrist_sensor,
)

_BLOCK = round(RATE / STRIDE)  # of a mean
_LEAST = 1e-12  # [kg2, (kg.m)2, m2] of a prior variance
DEPARTS = 24.3  # square of a distance that one in a thousand exceeds, of 7 degrees of freedom
_FEWEST = 3  # means
_ROUNDS = 4
_TOGETHER = 10  # means that err alike: two periods of a swing
_SENSOR = np.repeat([0.1, 0.01], 3)  # [N, N.m] a mean is known to at best


@dataclass(frozen=True)
class HungLoad:
    """What hangs there besides; axes and origin of the tree's last body.

    Attributes:
        links: dphi (4,): mass [kg], first moment [kg.m].
        centre: d (3,) [m].
        covariance: (7, 7) of both.
        payload: The campaign's [kg].
        nominal: (4,) mass and first moment of all that hangs there, with that payload, as far as they were known.
        departs: Squared distance from it in the tolerances' covariance, of 7 degrees of freedom [-].
    """

    links: np.ndarray
    centre: np.ndarray
    covariance: np.ndarray
    payload: float
    nominal: np.ndarray
    departs: float = 0.0

    @property
    def uncertain(self) -> np.ndarray:
        """Covariance (4, 4) of what is added with the campaign's payload."""
        J = np.hstack([np.eye(4), self.payload * np.eye(4)[:, 1:]])
        return np.asarray(J @ self.covariance @ J.T)

    def added(self, payload: float) -> np.ndarray:
        """(4,) mass and first moment, with a payload [kg]."""
        return self.links + payload * np.append(0.0, self.centre)

    def on(self, model: pin.Model, payload: float) -> None:
        """Hang it on a model's last body."""
        found = model.inertias[-1].toDynamicParameters()
        found[:4] += self.added(payload)
        model.inertias[-1] = pin.Inertia.FromDynamicParameters(found)


def hung_load(urdf: str, description: Description, offset: np.ndarray, trials: Sequence[Trial]) -> HungLoad | None:
    """By the trials' readings; None where no sensor was read. `offset` (k,) zeros of the motors' readings [rad, m]."""
    rows: list[tuple[np.ndarray, np.ndarray, float]] = []
    nominal = wrist_sensor(urdf, description)
    for trial in trials if nominal is not None else ():
        mass = description.payload_of(trial.id)
        known = np.isfinite(trial.q_motor).all(axis=1) & np.isfinite(trial.wrist_wrench).all(axis=1)
        sensor = wrist_sensor(urdf, description.carrying(mass)) if known.any() else None
        readings = trial.t_robot[known], trial.q_motor[known] - offset, trial.wrist_wrench[known]
        if sensor is None:
            continue
        with suppress(NotEnoughData):
            read = smoothed(*readings)
            if sensor.push(trial.t_robot[known], read) is None:
                rows.append((*_means(sensor, read), mass))
    if nominal is None or not rows:
        return None
    prior = _prior(nominal, description.tolerances)
    x, C = _fitted(rows, np.zeros(7), prior)
    return HungLoad(x[:4], x[4:], C, description.payload_of(), _hung(nominal), float(x @ np.linalg.solve(prior, x)))


class Hanging(NamedTuple):
    """What hangs on a trial's sensor, or pushes it.

    Attributes:
        sensor: With nominal links and the declared payload.
        read: What it read, and the motors or links.
        known: (4,) what hangs there besides by the calibration: mass [kg], first moment [kg.m].
        found: (4,) the same by the trial.
        pushed: What pushes the hand.
    """

    sensor: WristSensor
    read: SmoothReadings
    known: np.ndarray
    found: np.ndarray
    pushed: Push | None = None


def hand_on_joints(
    urdf: str, description: Description, hung: HungLoad | None, t: np.ndarray, q: np.ndarray, wrench: np.ndarray
) -> Push | None:
    """What the sensor shows of the hand to load joints in a trial, beside what hangs there by calibration.

    A push, see `robot.wrist_sensor`, or what a payload that is not the campaign's has less than was taken for it: its
    centre the calibration does not tell, but the same fit to the trial alone, its prior what the calibration found.

    Args:
        urdf: Nominal robot.
        description: With the payload of the trial.
        hung: By the calibration; None where nothing was weighed.
        t: (n,) [s].
        q: (n, k) motor readings less their zeros, or the links' angles where they are known [rad, m].
        wrench: (n, 6) readings of the sensor.
    """
    of = hanging(urdf, description, hung, t, q, wrench)
    if of is None or of.pushed is not None:
        return None if of is None else of.pushed
    return None if of.found is of.known else of.sensor.alone(of.known - of.found).lacking(len(t))


def hand_on_floor(
    urdf: str,
    description: Description,
    hung: HungLoad | None,
    t: np.ndarray,
    q: np.ndarray,
    wrench: np.ndarray,
    base: np.ndarray | None = None,
) -> Push | None:
    """What it shows of the hand to load the floor: a push, or how a hand that nothing pushes moves.

    Arguments as of `hand_on_joints`; `base` (n, 12) how the root moves, see `torques.base_motion`; None: it is at rest.
    """
    of = hanging(urdf, description, hung, t, q, wrench)
    if of is None:
        return None
    if of.pushed is not None:
        return of.pushed._replace(hung=of.sensor.tree)
    return of.sensor.carrying(of.found).hand(t, of.read, of.sensor.tree, base)


def hanging(
    urdf: str, description: Description, hung: HungLoad | None, t: np.ndarray, q: np.ndarray, wrench: np.ndarray
) -> Hanging | None:
    """None where the sensor tells nothing."""
    sensor = wrist_sensor(urdf, description) if np.isfinite(wrench).any() else None
    if sensor is None:
        return None
    mass = description.payload_of()
    known = np.zeros(4) if hung is None else hung.added(mass)
    try:
        read = smoothed(t, q, wrench)
        pushed = sensor.carrying(known).push(t, read)
        if pushed is not None or hung is None:
            return None if pushed is None else Hanging(sensor, read, known, known, pushed)
        if mass == hung.payload:
            return Hanging(sensor, read, known, known)
        row = (*_means(sensor, read), mass)
    except NotEnoughData:
        return None
    x, _ = _fitted([row], np.append(hung.links, hung.centre), hung.covariance)
    return Hanging(sensor, read, known, replace(hung, links=x[:4], centre=x[4:]).added(mass))


def _means(sensor: WristSensor, read: SmoothReadings) -> tuple[np.ndarray, np.ndarray]:
    """-(w + f) (m, 6) and Y (m, 6, 4), means of blocks less those of the trial."""
    found = sensor.beyond(read.thinned(STRIDE))
    m = len(found[0]) // _BLOCK
    if m < _FEWEST:
        raise NotEnoughData(f"{m} s of the wrist's sensor do not show what hangs on it")
    means = [x[: m * _BLOCK].reshape(m, _BLOCK, *x.shape[1:]).mean(axis=1) for x in found]
    y, Y = (x - x.mean(axis=0) for x in means)
    return y, Y


def inertial_tolerance(body: np.ndarray, mass: float, centre: float) -> np.ndarray:
    """Covariance (4, 4) of a body's mass and first moment (4,), its mass to a share, its centre to `centre` [m]."""
    C = mass**2 * np.outer(body, body)
    C[1:, 1:] += (centre * body[0]) ** 2 * np.eye(3)
    return C


def _hung(sensor: WristSensor) -> np.ndarray:
    return np.append(sensor.tree.mass[-1], sensor.tree.moment[-1])


def _prior(sensor: WristSensor, tolerances: Tolerances) -> np.ndarray:
    """Covariance (7, 7)."""
    C = _LEAST * np.eye(7)
    C[:4, :4] += inertial_tolerance(_hung(sensor), tolerances.link_mass, tolerances.link_com)
    C[4:, 4:] += tolerances.link_com**2 * np.eye(3)
    return C


def _fitted(
    rows: Sequence[tuple[np.ndarray, np.ndarray, float]], mean: np.ndarray, prior: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(7,) and its covariance, by rows (y, Y, payload) and a normal prior."""
    A = [np.concatenate([Y, mass * Y[:, :, 1:]], axis=2) for _, Y, mass in rows]
    P, left = np.linalg.inv(prior), [np.zeros(6) for _ in rows]  # at first the sensor's errors alone
    for _ in range(_ROUNDS):
        H, g = P.copy(), P @ mean
        for B, (y, _, _), square in zip(A, rows, left, strict=True):
            weight = 1.0 / (_TOGETHER * (_SENSOR**2 + square))
            H += np.einsum("nij,i,nik->jk", B, weight, B)
            g += np.einsum("nij,i,ni->j", B, weight, y)
        x = np.linalg.solve(H, g)
        left = [((y - B @ x) ** 2).mean(axis=0) for B, (y, _, _) in zip(A, rows, strict=True)]
    return x, np.linalg.inv(H)
