"""How the base stands: where the plate is under it, and the compliance of heave and tilt of wheels that lift off.

The plate's place, by where it is declared and by what the links weigh, from seconds at rest:

    v - u = |v_1| (0, o) + g sum_i (dm_i (1, x_i, y_i) + m_i (0, (R_i dc_i)_xy))

v, u: (-Fz, My, -Mx) by the plate and by inverse dynamics of the nominal robot [N, N.m, frame 0]; o how far the plate
seems from its declared place; body i has its nominal mass m_i and centre of mass (x_i, y_i), axes R_i, and is off by
dm_i and dc_i. All of them normal: o as a marker body is on its link, links as `Tolerances` has them; the centre of mass
of the root, which stands as it was built, to 2 mm. Postures tell the links' masses from the plate's place.

The suspension's compliance has springs that pull. Where wheels lift off in calibration trials, z, rx, ry follow the
wrench that is as if they could (`kernel.lifted`), on vertical springs k of three types of wheels. When one lifts off
depends on the plate's place, too: 2 mm of 730 N lift a caster, or do not. So both are found together,

    min sum_t (h(k, o) - h)' S^-2 (h(k, o) - h) / c + prior        K = sum_i k_i a_i a_i',  a_i = (1, y_i, -x_i)

h are heave and tilt, S the markers' noise; c samples hang together.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from calibration.errors import NotEnoughData
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import interpolate_columns
from calibration.recording.schema import Description, Tolerances
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.stick_slip.forcing import HEAVE, Tilting, Wrenches
from calibration.stages.stick_slip.kernel.lifted import on_wheels, vertical
from calibration.stages.stick_slip.wheels import LENGTH, LOADS, PRIOR_SIGMA, WIDE, Prior, WheelSet, prior_by_tilt
from calibration.stages.suspension.base_response import BaseResponse, WrenchSources, base_response_of, forcing_of
from calibration.stages.suspension.floor_wrench import Load, root_in_base
from calibration.stages.suspension.modal_response import predicted
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest

SOURCES: tuple[Source, ...] = ("plate", "dynamics")

_ROOT = 2e-3  # [m]
_STILL = 0.01  # [rad, m] of a joint in a second
_FEWEST = 20  # readings in it
_FEWEST_TRIALS = 2
_FORCE, _LEVER = 2.0, 3e-4  # [N], [m] of the weight: what a second at rest leaves unexplained
_LIFTED = 0.01  # share of the samples in which a wheel is off the floor
_TOGETHER, _WORTH = 100, 20.0  # samples that err alike; chi-square that springs by type of wheel must gain
_LOST = 1e3  # what a base that does not settle is off [noise]
_STEP, _SAME = 0.02, 1e-4  # of logarithms and LENGTH, for derivatives; share of them that a last step changes
_PLACED = 5e-4  # [m] to which the plate's place is known at best


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
    off, place, seems = plate_place(sources, read)
    tilts = any(suspension.moves(source)[[*HEAVE[1:]]].all() for source in SOURCES)
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


def _lifted(standing: np.ndarray, load: Load) -> float:
    """Share of the samples of a plate's load in which a wheel, rows (m, 10), is off the floor."""
    N = standing[:, 6] + vertical(load.signal.x) @ standing[:, 7:10].T
    return float((N < 0.0).any(axis=1).mean())


class _Rocked(NamedTuple):
    """A trial's load, and what its markers show under it."""

    one: Read
    load: Load
    seen: BaseResponse

    def left(self, K: np.ndarray, C: np.ndarray, standing: np.ndarray) -> np.ndarray:
        """Predicted less measured heave and tilt (3 n,) [noise], 0 where not measured."""
        forcing = forcing_of(on_wheels(self.load, standing, self.one.wrenches.slid), self.one.wrenches.start)
        x = interpolate_columns(self.seen.forcing.t, forcing.t, predicted(K, C, forcing)[:, HEAVE])
        noise = np.sqrt(_TOGETHER * self.seen.noise[[*HEAVE]])
        off = np.where(self.seen.valid[:, None], (x - self.seen.x[:, HEAVE]) / noise, 0.0)
        return np.asarray(np.nan_to_num(off, nan=_LOST, posinf=_LOST, neginf=-_LOST).ravel())


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

    def stiffness(k: np.ndarray, off: np.ndarray) -> np.ndarray:
        K = linear.K.copy()
        K[np.ix_(HEAVE, HEAVE)] = wheels.tilting(k, off)
        return K

    def residuals(theta: np.ndarray) -> np.ndarray:
        k, off = np.exp(theta[:3]), theta[3:] * LENGTH
        K, standing = stiffness(k, off), wheels.standing(k[[0, 2]] / k[1], off)
        left = side_by_side(lambda one: one.left(K, linear.C, standing), rocked)
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
    if 2.0 * found.cost > sum(float((one.left(*pulling) ** 2).sum()) for one in rocked) - _WORTH:
        return None
    K, off = stiffness(np.exp(found.x[:3]), found.x[3:] * LENGTH), found.x[3:] * LENGTH
    sigma = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))[3:] * LENGTH
    prior = _prior(wheels, K, np.hypot(sigma, _PLACED))
    return Tilting(K, linear.C, off, prior.shares, off - linear.off + linear.over), prior


def plate_place(sources: WrenchSources, read: Sequence[Read]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far (2,) [m] the plate seems from its declared place under the base, and sigma (2,); 0 without readings.

    And how far it seems by the nominal robot, were its links what they nominally are.

    Args:
        sources: The nominal robot and the clock of its readings.
        read: Calibration trials.
    """
    lab, rows = sources.lab, []
    for one in read:
        own = lab.of_trial(one.trial.id)
        rows += [(*weighed(own, q, v), v - u) for q, v, u in _seconds(sources, one.trial, one.wrenches)]
    if not rows:
        return np.zeros(2), np.full(2, lab.description.tolerances.body_translation), np.zeros(2)
    A, b = (np.concatenate(column) for column in ([np.hstack(row[:2]) for row in rows], [row[2] for row in rows]))
    weight = np.mean([row[1][1, 0] for row in rows])
    noise = np.tile([_FORCE, _LEVER * weight, _LEVER * weight], len(rows))
    sigma = _tolerances(lab.floating.njoints - 1, lab.description.tolerances)
    A = A * sigma / noise[:, None]
    covariance = np.linalg.inv(A.T @ A + np.eye(len(sigma)))
    found, left = sigma * (covariance @ A.T @ (b / noise)), sigma * np.sqrt(np.diag(covariance))
    return found[-2:], left[-2:], np.mean([row[2] for row in rows], axis=0)[1:] / weight


def weighed(lab: Laboratory, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What bodies and the plate's place change of a load v (3,) at readings q (k,): (3, 4 bodies), (3, 2).

    By the share of a mass [-] and by its centre [m], x, y, z of its own axes, body by body, the root first.
    """
    model, description = lab.floating, lab.description
    move, data = np.zeros(model.nv), model.createData()
    move[[model.idx_vs[model.getJointId(name)] for name in description.joint_names]] = q
    pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), move))
    T_0_root, g = root_in_base(model, description), float(np.linalg.norm(description.gravity))
    found = np.zeros((3, model.njoints - 1, 4))
    for i in range(1, model.njoints):
        body, T = model.inertias[i], T_0_root * data.oMi[i]
        found[:, i - 1, 0] = body.mass * g * np.append(1.0, T.act(body.lever)[:2])
        found[1:, i - 1, 1:] = body.mass * g * T.rotation[:2]
    return found.reshape(3, -1), v[0] * np.eye(3)[:, 1:]


def _tolerances(bodies: int, known: Tolerances) -> np.ndarray:
    """Standard deviations of the columns of `weighed`."""
    links = np.tile([known.link_mass, *[known.link_com] * 3], bodies)
    links[1:4] = _ROOT
    return np.append(links, [known.body_translation] * 2)


def _seconds(
    sources: WrenchSources, trial: Trial, wrench: Wrenches
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Readings (k,), v and u (3,) of the seconds of a trial in which no joint moves."""
    inverse = wrench.inverse_dynamics
    if sources.robot is None or wrench.plate is None or inverse is None:
        return
    known = np.isfinite(trial.q_motor).all(axis=1)
    t, q = sources.robot.to_mocap(trial.t_robot[known]), trial.q_motor[known]
    plate, dynamics = wrench.plate.signal, inverse.signal
    grids = t, plate.t, dynamics.t
    starts = np.arange(max(g[0] for g in grids), min(g[-1] for g in grids) - 1.0, 1.0)
    ends = [np.searchsorted(g, [starts, starts + 1.0]) for g in grids]
    for own, of_plate, of_dynamics in zip(*(np.transpose(e) for e in ends), strict=True):
        still = q[slice(*own)]
        if len(still) >= _FEWEST and np.ptp(still, axis=0).max() < _STILL:
            loads = (s.x[slice(*e)].mean(axis=0) for s, e in ((plate, of_plate), (dynamics, of_dynamics)))
            v, u = (vertical(load[None])[0] for load in loads)
            yield still.mean(axis=0), v, u
