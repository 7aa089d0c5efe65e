"""How the base stands: where the plate is under it, and the compliance of heave and tilt of wheels that lift off.

The plate's place, by where it is declared and by what the links weigh, from seconds at rest:

    v - u = |v_1| (0, o) + g sum_i (dm_i (1, x_i, y_i) + m_i (0, (R_i dc_i)_xy))

v, u: (-Fz, My, -Mx) by the plate and by inverse dynamics of the nominal robot [N, N.m, frame 0]; o how far the plate
seems from its declared place; body i has its nominal mass m_i and centre of mass (x_i, y_i), axes R_i, and is off by
dm_i and dc_i. All of them normal: o as a marker body is on its link, links as `Tolerances` has them; the centre of mass
of the root, which stands as it was built, to 2 mm. Postures tell the links' masses from the plate's place.

The suspension's compliance has springs that pull. Where wheels lift off in calibration trials, z, rx, ry are fitted
again under the wrench that is as if they could (`kernel.lifted`), by rounds until K stays: it says how wheels share the
load, and so when one lifts off.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from calibration.errors import NotEnoughData
from calibration.numerics.side_by_side import side_by_side
from calibration.recording.schema import Tolerances
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.stick_slip.forcing import HEAVE, Tilting, Wrenches, on_wheels, vertical
from calibration.stages.stick_slip.wheels import WIDE, Prior, WheelSet, prior_by_tilt
from calibration.stages.suspension.base_response import BaseResponse, WrenchSources, base_response_of
from calibration.stages.suspension.compliance_fit import fit_compliance
from calibration.stages.suspension.floor_wrench import Load, root_in_base
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest
from calibration.stages.suspension.wheels import wheel_model

SOURCES: tuple[Source, ...] = ("plate", "dynamics")

_ROOT = 2e-3  # [m]
_STILL = 0.01  # [rad, m] of a joint in a second
_FEWEST = 20  # readings in it
_FEWEST_TRIALS = 2
_FORCE, _LEVER = 2.0, 3e-4  # [N], [m] of the weight: what a second at rest leaves unexplained
_LIFTED = 0.01  # share of the samples in which a wheel is off the floor
_ROUNDS, _SAME = 6, 0.01  # fits at most, and by how much the last one still changes the stiffness in tilt


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
    off, place = plate_place(sources, read)
    tilts = any(suspension.moves(source)[[*HEAVE[1:]]].all() for source in SOURCES)
    prior = _prior(wheels, suspension.K, place) if tilts else WIDE
    tilting = Tilting(suspension.K, suspension.C, off, prior.shares)
    loads = [(one, sources.plate_load(one.trial, one.rest.T_lab_0)) for one in read if one.wrenches.plate is not None]
    for _ in range(_ROUNDS if tilts else 0):
        standing = tilting.standing(wheels, "plate")
        found = _lifting_compliance(sources, loads, standing, tilting)
        if found is None:
            break
        change = np.abs(np.diag(found[0]) / np.diag(tilting.K) - 1.0)[[*HEAVE[1:]]].max()
        prior = _prior(wheels, found[0], place)
        tilting = Tilting(*found, off, prior.shares)
        if change < _SAME:
            break
    return tilting, prior


def _prior(wheels: WheelSet, K: np.ndarray, place: np.ndarray) -> Prior:
    return prior_by_tilt(wheels, K[np.ix_(HEAVE, HEAVE)], place)


def _lifted(standing: np.ndarray, load: Load) -> float:
    """Share of the samples of a plate's load in which a wheel, rows (m, 10), is off the floor."""
    N = standing[:, 6] + vertical(load.signal.x) @ standing[:, 7:10].T
    return float((N < 0.0).any(axis=1).mean())


def _lifting_compliance(
    sources: WrenchSources, loads: Sequence[tuple[Read, Load]], standing: np.ndarray, before: Tilting
) -> tuple[np.ndarray, np.ndarray] | None:
    """K and C (6, 6), those of z, rx, ry fitted to what wheels, rows (m, 10), bear of the plate's loads.

    None where hardly one lifts off.
    """

    def response(one: Read, load: Load) -> BaseResponse | None:
        load = on_wheels(load, standing, one.wrenches.slid)
        try:
            return base_response_of(sources.lab.description, one.trial, one.rest, load)
        except NotEnoughData:
            return None

    if len(loads) < _FEWEST_TRIALS or np.mean([_lifted(standing, load) for _, load in loads]) < _LIFTED:
        return None
    responses = [one for one in side_by_side(response, *zip(*loads, strict=True)) if one is not None]
    if len(responses) < _FEWEST_TRIALS:
        return None
    fitted = fit_compliance(responses, wheel_model(sources.lab.description.wheels, "contact").couples)
    h, K, C = np.ix_(HEAVE, HEAVE), before.K.copy(), before.C.copy()
    K[h], C[h] = fitted.K[h], fitted.C[h]
    return K, C


def plate_place(sources: WrenchSources, read: Sequence[Read]) -> tuple[np.ndarray, np.ndarray]:
    """How far (2,) [m] the plate seems from its declared place under the base, and sigma (2,); 0 without readings.

    Args:
        sources: The nominal robot and the clock of its readings.
        read: Calibration trials.
    """
    lab, rows = sources.lab, []
    for one in read:
        own = lab.of_trial(one.trial.id)
        rows += [(*weighed(own, q, v), v - u) for q, v, u in _seconds(sources, one.trial, one.wrenches)]
    if not rows:
        return np.zeros(2), np.full(2, lab.description.tolerances.body_translation)
    A, b = (np.concatenate(column) for column in ([np.hstack(row[:2]) for row in rows], [row[2] for row in rows]))
    weight = np.mean([row[1][1, 0] for row in rows])
    noise = np.tile([_FORCE, _LEVER * weight, _LEVER * weight], len(rows))
    sigma = _tolerances(lab.floating.njoints - 1, lab.description.tolerances)
    A = A * sigma / noise[:, None]
    covariance = np.linalg.inv(A.T @ A + np.eye(len(sigma)))
    found, left = sigma * (covariance @ A.T @ (b / noise)), sigma * np.sqrt(np.diag(covariance))
    return found[-2:], left[-2:]


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
