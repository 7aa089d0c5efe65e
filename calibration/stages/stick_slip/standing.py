"""How the base stands: where the plate is under it, and the compliance of heave and tilt of wheels that lift off.

The plate's place is known by where it is declared and by what the links weigh, see `suspension.weighing`.

The suspension's compliance has springs that pull. Where wheels lift off in calibration trials, z, rx, ry follow the
wrench that is as if they could (`kernel.lifted`), on vertical springs k of three types of wheels. When one lifts off
depends on the plate's place, too: 2 mm of 730 N lift a caster, or do not. So both are found together,

    min sum_t (h(k, o) - h)' S^-2 (h(k, o) - h) / c + prior        K = sum_i k_i a_i a_i',  a_i = (1, y_i, -x_i)

h are heave and tilt, S the markers' noise, c samples hang together. All n samples of a trial share the noise of its
reference, m independent samples of the first second: of e = h(k, o) - h counts e - (1 - (1 + n / (c m))^-1/2) mean e.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import interpolate_columns
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.stages.stick_slip.forcing import Tilting, Wrenches
from calibration.stages.stick_slip.kernel.bases import HEAVE
from calibration.stages.stick_slip.kernel.lifted import on_wheels
from calibration.stages.stick_slip.wheels import (
    LENGTH,
    LOADS,
    PLACES,
    PRIOR,
    PRIOR_SIGMA,
    WIDE,
    Prior,
    WheelSet,
)
from calibration.stages.suspension.base_response import (
    BaseResponse,
    WrenchSources,
    base_response_of,
    forcing_of,
    without_reference,
)
from calibration.stages.suspension.floor_wrench import Load, vertical
from calibration.stages.suspension.modal_response import predicted
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest
from calibration.stages.suspension.weighing import declared_place, seconds_at_rest, weighed

SOURCES: tuple[Source, ...] = ("plate", "dynamics")

_FEWEST_TRIALS = 2
_LIFTED = 0.01  # share of the samples in which a wheel is off the floor
_TOGETHER, _WORTH = 100, 20.0  # samples that err alike; chi-square that springs by type of wheel must gain
_LOST = 1e3  # what a base that does not settle is off [noise]
_STEP, _SAME = 0.02, 1e-4  # of logarithms and LENGTH, for derivatives; share of them that a last step changes
_PLACED = 5e-4  # [m] to which the plate's place is known at best
_BY_SLIPS = np.array([0.3, 1.0])  # of that sigma, along x and across: prior of how far slips move the load from there
_ELEMENTS = ((0, 0), (1, 1), (2, 2), (0, 2))
_KNOWN = np.array([0.3, 0.03, 0.05, 0.04])  # sigmas of the elements: heave hardly moves
_MODEL = 0.05  # of a logarithm: loads are shared by more than springs
_TYPES = ("drive", "front", "back")
_RATIOS = np.array([[1.0, -1.0, 0.0], [0.0, -1.0, 1.0]])  # of drives and back casters to front ones, of logarithms


@dataclass(frozen=True)
class Read:
    """A trial: where it begins, its wrenches."""

    trial: Trial
    rest: Rest
    wrenches: Wrenches


def tilting_of(
    sources: WrenchSources, read: Sequence[Read], wheels: WheelSet, suspension: Suspension
) -> tuple[Tilting, Prior]:
    """Heave and tilt by calibration trials, and the prior of how wheels share the load, by the tilt where it shows."""
    tilts = any(suspension.moves(source)[[*HEAVE[1:]]].all() for source in SOURCES)
    off, place, seems = plate_place(sources, read, suspension.K if tilts else None)
    prior = _prior(wheels, suspension.K, place) if tilts else WIDE
    tilting = Tilting(suspension.K, suspension.C, off, prior.shares, off - seems)
    standing = tilting.standing(wheels, "plate")
    shown = [one for one in read if tilts and one.wrenches.plate is not None]
    loads = [sources.plate_load(one.trial, one.rest.T_lab_0) for one in shown]
    if loads and np.mean([_lifted(standing, load) for load in loads]) > _LIFTED:
        rocked = _rocked(sources.lab.description, shown, loads)
        found = _on_springs(rocked, wheels, tilting, place) if len(rocked) >= _FEWEST_TRIALS else None
        return found or (tilting, prior)
    return tilting, prior


def _prior(wheels: WheelSet, K: np.ndarray, place: np.ndarray) -> Prior:
    return prior_by_tilt(wheels, K[np.ix_(HEAVE, HEAVE)], place)


def vertical_stiffness(wheels: WheelSet, tilting: Tilting, prior: Prior) -> float:
    """Of a front caster [N/m], by the stiffness of roll about wheels that share the load; 0 where no tilt shows it."""
    drives, backs = tilting.shares
    return 0.0 if prior is WIDE else float(tilting.K[3, 3] / wheels.tilting(np.array([drives, 1.0, backs]))[1, 1])


def prior_by_tilt(wheels: WheelSet, K: np.ndarray, place: np.ndarray) -> Prior:
    """The wide prior, its shares of the load by the stiffness K (3, 3) of z, rx, ry [N/m, N, N.m/rad].

        K = sum_i k_i a_i a_i',   a_i = (1, y_i, -x_i)

    Wheels share the load as their vertical springs do. The logarithms of the three types' k are fitted to K_zz, K_rx,
    K_ry and K_z,ry each relative to sqrt(K_ii K_jj); ratios to front casters have the wide prior too, which decides
    where a type is missing.

    Args:
        wheels: Of the robot.
        K: Stiffness.
        place: (2,) sigma of where the load is [m].
    """
    a = np.column_stack([np.ones(len(wheels.position)), wheels.position[:, 1], -wheels.position[:, 0]])
    rows, columns = np.transpose(_ELEMENTS)
    size = np.sqrt(np.diag(K))
    size = size[rows] * size[columns]
    own = [a[[kind == one for one in wheels.types]] for kind in _TYPES]
    A = np.stack([(part.T @ part)[rows, columns] for part in own], axis=1) / (size * _KNOWN)[:, None]
    b = K[rows, columns] / (size * _KNOWN)
    weighted = _RATIOS / PRIOR_SIGMA[LOADS][:, None]

    def residuals(log_k: np.ndarray) -> np.ndarray:
        return np.concatenate([A @ np.exp(log_k) - b, weighted @ log_k])

    def jacobian(log_k: np.ndarray) -> np.ndarray:
        return np.concatenate([A * np.exp(log_k), weighted])

    start = np.full(3, np.log(K[0, 0] / len(wheels.types)))
    found = least_squares(residuals, start, jac=jacobian, method="lm")
    return _sharing(found.x, np.linalg.pinv(found.jac.T @ found.jac), place)


def _sharing(log_k: np.ndarray, covariance: np.ndarray, place: np.ndarray) -> Prior:
    """The wide prior, its shares of the load as springs of log_k (3,) with a covariance (3, 3) have them.

    `place` (2,) is the sigma of where the load is [m]. Slips show it across the base; along x they err by as much as
    weighing does, so that its prior is narrower there.
    """
    mean, sigma = PRIOR.copy(), PRIOR_SIGMA.copy()
    mean[LOADS], sigma[LOADS] = _RATIOS @ log_k, np.sqrt(np.diag(_RATIOS @ covariance @ _RATIOS.T) + _MODEL**2)
    sigma[PLACES] = place / LENGTH * _BY_SLIPS
    return Prior(mean, sigma)


def _lifted(standing: np.ndarray, load: Load) -> float:
    """Share of the samples of a plate's load in which a wheel, rows (m, 10), is off the floor."""
    N = standing[:, 6] + vertical(load.signal.x) @ standing[:, 7:10].T
    return float((N < 0.0).any(axis=1).mean())


class _Rocked(NamedTuple):
    """A trial's load, and what its markers show under it."""

    one: Read
    load: Load
    seen: BaseResponse

    def left(self, noise: np.ndarray, K: np.ndarray, C: np.ndarray, standing: np.ndarray) -> np.ndarray:
        """Predicted less measured heave and tilt (3 n,) [noise (3,)], 0 where not measured."""
        forcing = forcing_of(on_wheels(self.load, standing, self.one.wrenches.slid), self.one.wrenches.start)
        x = interpolate_columns(self.seen.forcing.t, forcing.t, predicted(K, C, forcing)[:, HEAVE])
        off = np.nan_to_num((x - self.seen.x[:, HEAVE]) / noise, nan=_LOST, posinf=_LOST, neginf=-_LOST)
        off = np.where(self.seen.valid[:, None], off, 0.0)
        off[self.seen.valid] = without_reference(off[self.seen.valid], _TOGETHER)
        return np.asarray(off.ravel())


def _rocked(description: Description, read: Sequence[Read], loads: Sequence[Load]) -> list[_Rocked]:
    found = []
    for one, load in zip(read, loads, strict=True):
        with suppress(NotEnoughData):
            found.append(_Rocked(one, load, base_response_of(description, one.trial, one.rest, load)))
    return found


def _on_springs(
    rocked: Sequence[_Rocked], wheels: WheelSet, linear: Tilting, place: np.ndarray
) -> tuple[Tilting, Prior] | None:
    """Heave and tilt on springs that do not pull, and the prior of how wheels share the load; None: no better.

    Args:
        rocked: Trials.
        wheels: Of the robot.
        linear: On springs that pull.
        place: (2,) sigma of the plate's place [m].
    """
    noise = np.sqrt(_TOGETHER * np.mean([one.seen.noise[[*HEAVE]] for one in rocked], axis=0))

    def stiffness(k: np.ndarray, off: np.ndarray) -> np.ndarray:
        K = linear.K.copy()
        K[np.ix_(HEAVE, HEAVE)] = wheels.tilting(k, off)
        return K

    def residuals(theta: np.ndarray) -> np.ndarray:
        k, off = np.exp(theta[:3]), theta[3:] * LENGTH
        K, standing = stiffness(k, off), wheels.standing(k[[0, 2]] / k[1], off)
        left = side_by_side(lambda one: one.left(noise, K, linear.C, standing), rocked)
        ratios, moved = theta[[0, 2]] - theta[1], off - linear.off
        return np.concatenate([*left, ratios / PRIOR_SIGMA[LOADS], moved / place])

    def jacobian(theta: np.ndarray) -> np.ndarray:
        at = residuals(theta)
        return np.stack([(residuals(theta + own) - at) / _STEP for own in _STEP * np.eye(len(theta))], axis=1)

    k = np.array([linear.shares[0], 1.0, linear.shares[1]])
    k *= linear.K[3, 3] / wheels.tilting(k)[1, 1]
    start = np.append(np.log(k), linear.off / LENGTH)
    found = least_squares(residuals, start, jac=jacobian, method="lm", ftol=1e-3, xtol=_SAME)
    pulling = linear.K, linear.C, linear.standing(wheels, "plate")
    if 2.0 * found.cost > sum(float((one.left(noise, *pulling) ** 2).sum()) for one in rocked) - _WORTH:
        return None
    K, off = stiffness(np.exp(found.x[:3]), found.x[3:] * LENGTH), found.x[3:] * LENGTH
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    prior = _sharing(found.x[:3], covariance[:3, :3], np.hypot(np.sqrt(np.diag(covariance)[3:]) * LENGTH, _PLACED))
    return Tilting(K, linear.C, off, prior.shares, off - linear.off + linear.over), prior


def plate_place(
    sources: WrenchSources, read: Sequence[Read], K: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far (2,) [m] the plate seems from its declared place under the base, and sigma (2,); 0 without readings.

    And how far it seems by an upright robot, were its links what they are taken for.

    Args:
        sources: The robot and the clock of its readings.
        read: Calibration trials.
        K: As of `weighed`.
    """
    lab, robot, seconds = sources.lab, sources.robot, []
    for one in read:
        trial, rest, wrench = one.trial, one.rest, one.wrenches
        inverse, own = wrench.inverse_dynamics, lab.of_trial(trial.id)
        if robot is not None and wrench.plate is not None and inverse is not None:
            seen = MeasuredTrial.of(lab.description, trial)
            rested = seconds_at_rest(seen, rest, robot, wrench.plate.signal, inverse.signal)
            seconds += [(own, second) for second in rested]
    if not seconds:
        return np.zeros(2), declared_place(lab.description), np.zeros(2)
    found = weighed(seconds, K)
    return found.off, found.sigma, found.seems
