"""Where the plate is under the base: by its declared place and by what the links weigh, from seconds at rest.

    v - u = |v_1| (0, o) + g sum_i (dm_i (1, x_i, y_i) + m_i (0, (R_i dc_i)_xy))

v, u: (-Fz, My, -Mx) by the plate and by inverse dynamics of the nominal robot [N, N.m, frame 0]; o how far the plate
seems from its declared place; body i has its nominal mass m_i and centre of mass (x_i, y_i), axes R_i, and is off by
dm_i and dc_i. All of them normal: o as a marker body is on its link, links as `Tolerances` has them; the centre of mass
of the root, which stands as it was built, to 2 mm. Postures tell the links' masses from the plate's place.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio as pin

from calibration.recording.schema import Tolerances
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.stick_slip.forcing import Wrenches, vertical
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.floor_wrench import root_in_base

_ROOT = 2e-3  # [m]
_STILL = 0.01  # [rad, m] of a joint in a second
_FEWEST = 20  # readings in it
_FORCE, _LEVER = 2.0, 3e-4  # [N], [m] of the weight: what a second at rest leaves unexplained


def plate_place(sources: WrenchSources, trials: Sequence[Trial], wrenches: Sequence[Wrenches]) -> np.ndarray:
    """How far (2,) [m] the plate seems from its declared place under the base, 0 without joint readings.

    Args:
        sources: The nominal robot and the clock of its readings.
        trials: Calibration trials.
        wrenches: Theirs.
    """
    lab, rows = sources.lab, []
    for trial, wrench in zip(trials, wrenches, strict=True):
        own = lab.of_trial(trial.id)
        rows += [(*weighed(own, q, v), v - u) for q, v, u in _seconds(sources, trial, wrench)]
    if not rows:
        return np.zeros(2)
    A, b = (np.concatenate(column) for column in ([np.hstack(row[:2]) for row in rows], [row[2] for row in rows]))
    weight = np.mean([row[1][1, 0] for row in rows])
    noise = np.tile([_FORCE, _LEVER * weight, _LEVER * weight], len(rows))
    sigma = _tolerances(lab.floating.njoints - 1, lab.description.tolerances)
    A = A * sigma / noise[:, None]
    found = sigma * np.linalg.solve(A.T @ A + np.eye(len(sigma)), A.T @ (b / noise))
    return np.asarray(found[-2:])


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
    if sources.robot is None or wrench.plate is None or wrench.dynamics is None:
        return
    known = np.isfinite(trial.q_motor).all(axis=1)
    t, q = sources.robot.to_mocap(trial.t_robot[known]), trial.q_motor[known]
    plate, dynamics = wrench.plate.signal, wrench.dynamics.signal
    grids = t, plate.t, dynamics.t
    starts = np.arange(max(g[0] for g in grids), min(g[-1] for g in grids) - 1.0, 1.0)
    ends = [np.searchsorted(g, [starts, starts + 1.0]) for g in grids]
    for own, of_plate, of_dynamics in zip(*(np.transpose(e) for e in ends), strict=True):
        still = q[slice(*own)]
        if len(still) >= _FEWEST and np.ptp(still, axis=0).max() < _STILL:
            loads = (s.x[slice(*e)].mean(axis=0) for s, e in ((plate, of_plate), (dynamics, of_dynamics)))
            v, u = (vertical(load[None])[0] for load in loads)
            yield still.mean(axis=0), v, u
