"""Where the search for friction in a joint's mesh begins: many starts on one trial, the best of them on all.

Friction at the mesh, friction at the link and the gap trade for each other: a dead zone fitted to a mesh that rubs has
too wide a gap and too little friction. So the search begins from smaller gaps and more friction as well. Its cost has
kinks at which Levenberg-Marquardt stops: a fit is made again from its end until it stays.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from calibration.stages.drive_trains.fit.joint_data import JointData
from calibration.stages.drive_trains.fit.train_fit import FLOORS, Problem, TrainFit, fit_train

_HINT = 6.0  # cost that friction in the mesh must save in one trial
_SLIPS = (0.1, 0.3, 2.0)  # [N.m]
_RUBS = 3.0  # [N.m] friction of the link
_GAPS = (1.0, 0.5)  # of the dead zone's
_SPRING = 1e-5  # [rad/(N.m)] least compliance whose inverse a mesh begins with
_TRIED, _LIKELY, _KEPT = 5, 3, 2  # starts in coarse windows, in fine ones, and on all trials
_AGAIN, _GAIN = 4, 1.0  # fits from the end of the one before, and the cost worth one


def hinted(problem: Problem, richer: Problem, coarse: JointData, theta: np.ndarray) -> list[np.ndarray]:
    """Starts with friction in the mesh, where it explains the trial of most travel better than a dead zone's theta.

    In coarse windows and in fine ones: jolts that no model of one joint has look like friction in either alone.
    """
    motion, starts = coarse.motion, _with_friction(theta, richer.prior.nominal[1])
    travel = np.add.reduceat(np.abs(np.diff(motion.q, append=motion.q[-1])), motion.begins[:-1])
    trial = int(np.argmax(travel))
    for data, floors, tried, kept in (
        (coarse, FLOORS[1:2], _TRIED, _LIKELY),
        (problem.data, FLOORS[1:3], _LIKELY, _KEPT),
    ):
        one = data.only(trial)
        plain = fit_train(replace(problem, form="dead_zone", data=one), theta, floors)
        if plain.cost < plain.problem.of_sizes(np.full(one.n_groups, floors[-1])) + _HINT:
            return []
        of = replace(richer, data=one)
        glances = sorted((fit_train(of, x, ()) for x in starts), key=lambda fit: fit.cost)[:tried]
        again = _AGAIN if data is problem.data else 0
        fits = sorted((continued(of, fit.theta, floors, again) for fit in glances), key=lambda fit: fit.cost)
        if fits[0].cost > plain.cost - _HINT:
            return []
        starts = [fit.theta for fit in fits[:kept]]
    return starts


def continued(problem: Problem, theta: np.ndarray, floors: tuple[float, ...], again: int = _AGAIN) -> TrainFit:
    """A fit from theta (p,), made again from its end until it gains next to nothing."""
    best = fit_train(problem, theta, floors)
    for _ in range(again):
        new = fit_train(problem, best.theta, floors[-1:])
        if new.cost > best.cost - _GAIN:
            return min(best, new, key=lambda fit: fit.cost)
        best = new
    return best


def _with_friction(theta: np.ndarray, compliance: float) -> list[np.ndarray]:
    """Starts from theta without friction in the mesh.

    A dead zone that friction misled may be far too stiff as well: from a `compliance` [rad/(N.m)], too.
    """
    soft = {float(theta[1]), max(float(theta[1]), compliance)}
    return [
        np.concatenate([[share * theta[0], c, rubs, theta[3], 0.0, 1.0 / max(c, _SPRING), slip], theta[5:]])
        for share, c, slip in product(_GAPS, sorted(soft), _SLIPS)
        for rubs in (theta[2] + slip, _RUBS)
    ]
