"""From one joint's trials to its drive train: modes of its load, form, parameters, and how sure its side is.

The torque of a joint is known as well as masses and centres of mass are; its largest modes over the trials' samples,
R S = U D V' with S S' the covariance of the inertial parameters, are estimated with the drive train. What no mode holds
- coupled links, friction that is not quite Coulomb's - leaves the load unknown to a share of the friction, or to some
hundredths of a newton metre: as `torque_sigma` it decides where the side of a mesh is called known.

The form that holds is the one that predicts trials left out best:

    score = 1 / c sum_t n_t log s_t        s_t  size of what a fit without trial t leaves of trial t in motion

A fit without a trial is one Gauss-Newton step from the fit of all. c windows hang together. Where a link rests is left
out: a stop or a jolt before decides it, whatever the form.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.fit.joint_data import JointData
from calibration.stages.drive_trains.fit.mesh_friction import continued, hinted
from calibration.stages.drive_trains.fit.quantities import covariance_of, reported
from calibration.stages.drive_trains.fit.steady_contact import SteadyContact, steady_contact
from calibration.stages.drive_trains.fit.train_fit import (
    FLOORS,
    Problem,
    TrainFit,
    cost,
    derivatives,
    evaluated,
    fit_train,
    prior_of,
    sizes,
    weights,
)
from calibration.stages.drive_trains.kernel.link_motion import COULOMB, HALF_GAP

_FRICTION, _TORQUE = 0.15, 0.045  # share of the friction, and [N.m], to which a load is not known
SURE, _FEW = 0.1, 20  # of the half gap that an error of the torque moves a link by; windows
OTHER_SIDE = 12.0**0.5  # doubt of a link that is at the other end each time
_SPREAD = 0.15  # least standard deviation of where trials start [-]
_GAPS = (0.0, 0.2, 0.35, 0.45)  # of the discrepancy's spread
_SOFTNESS = (0.15, 0.5)  # of the prior
_FRICTIONS = (0.15, 0.5)  # [N.m]
_VISCOUS = 0.05  # [N.m.s/rad]
_ROUGH, _FINE = FLOORS[:2], FLOORS[2:]
_TRIED = 3
_BETTER = 10.0  # score by which a richer form must win
_PATTERN, _WORTH = (1.0, 0.5, 0.25), 0.5  # steps of a search [standard deviations], and the cost worth one
_DAMPED = 0.02  # share of the information that damps a step without a trial


@dataclass(frozen=True)
class Candidate:
    """A fit and how it predicts.

    Attributes:
        fit: Of all trials.
        score: Of trials left out; less is better.
        left_out: (k,) windows of trials left out less their prediction [rad].
        covariance: (p + 5, p + 5) of theta and gamma.
        steady: Whether steady contact alone has it, which jolts do not mislead.
    """

    fit: TrainFit
    score: float
    left_out: np.ndarray
    covariance: np.ndarray
    steady: bool = False


def identify(
    joint: str,
    data: JointData,
    coarse: JointData,
    modes: np.ndarray,
    backlash: float,
    deflection: float,
    motor_offset: float,
) -> tuple[DriveTrain, TrainFit]:
    """The drive train of a joint and its fit.

    `modes` (p, z) as in its data, priors as `prior_of`, `coarse` as `best_train`.
    """
    prior = prior_of(data, "dead_zone", backlash, deflection)
    chosen = best_train(Problem(joint, data, prior), coarse, backlash, deflection)
    fit = chosen.fit
    residual, doubt = residual_and_doubt(chosen)
    train = replace(
        fit.problem.train(fit.theta),
        link=np.append(motor_offset - fit.gamma[0], -fit.gamma[1:]),
        start=_start(fit),
        residual=residual,
        doubt=doubt,
        doubt_at_rest=doubt,
        inertials=modes @ fit.problem.modes(fit.theta),
        torque_sigma=torque_sigma(float(fit.problem.train(fit.theta).values[COULOMB])),
        range=_range(data.means(data.motion.torque)[data.known]),
    )
    return reported(train, fit, chosen.covariance, motor_offset), fit


def _range(torque: np.ndarray) -> np.ndarray:
    return np.array([torque.min(), torque.max()])


def torque_sigma(coulomb: float) -> float:
    """Standard deviation [N.m] of the torque at which a link with this friction [N.m] changes its side."""
    return max(_FRICTION * coulomb, min(_TORQUE, 2.0 * _FRICTION * coulomb))


def residual_and_doubt(chosen: Candidate) -> tuple[float, float]:
    """Residual and doubt of a drive train, by windows whose side an error of the torque does not change, and others."""
    fit, moves = chosen.fit, chosen.fit.problem.data.moves
    train = fit.problem.train(fit.theta)
    off = 2.0 * torque_sigma(float(train.values[COULOMB]))
    ends = np.array([fit.problem.deltas(fit.theta, fit.gamma, x) for x in (-off, 0.0, off)])
    wide, square = np.ptp(ends, axis=0), chosen.left_out**2
    sure = moves & (wide <= SURE * train.values[HALF_GAP])
    if sure.sum() < _FEW:
        return float(np.sqrt(square[moves].mean())), 1.0
    least, open_ = float(square[sure].mean()), moves & ~sure
    if not open_.any():
        return float(np.sqrt(least)), 1.0
    doubt = np.sqrt(max(square[open_].mean() - least, 0.0) / (wide[open_] ** 2 / 12.0).mean())
    return float(np.sqrt(least)), float(np.clip(doubt, 1.0, OTHER_SIDE))


def _start(fit: TrainFit) -> tuple[float, float]:
    """Share of the gap at which trials start, mean and standard deviation; NaN where fewer than two show it."""
    data, train = fit.problem.data, fit.problem.train(fit.theta)
    torque = data.loaded(fit.problem.modes(fit.theta)).torque[data.motion.begins[:-1]]
    low, high = train.ends(torque)
    wide = high - low > train.values[0]
    share = (data.started(fit.gamma) - low)[wide] / (high - low)[wide]
    share = np.clip(share[np.isfinite(share)], 0.0, 1.0)
    if len(share) < 2:
        return np.nan, np.nan
    return float(share.mean()), max(_SPREAD, float(share.std()))


def best_train(problem: Problem, coarse: JointData, backlash: float, deflection: float) -> Candidate:
    """The form that holds; priors as `prior_of`. The search begins with the joint's data in `coarse` windows.

    Where steady contact does not show the friction, the search for a dead zone may end far off; one that begins where
    friction in the mesh ended takes its place if it predicts better.
    """
    first = replace(problem, form="dead_zone", dynamic=False, data=coarse.sliding)
    rough = min((fit_train(first, theta, _ROUGH) for theta in _starts(first)), key=lambda fit: fit.cost)
    plain = _dead_zone(problem, rough)
    prior = prior_of(problem.data, "friction_held", backlash, deflection)
    richer = Problem(problem.joint, problem.data, prior, "friction_held", True)
    whole, starts = replace(richer, data=coarse), hinted(problem, richer, coarse, plain.fit.theta)
    starts += [fit_train(whole, theta, _ROUGH[1:]).theta for theta in starts]
    if not starts:
        return plain
    found = [judged(continued(richer, theta, _FINE)) for theta in starts]
    richest = min(found, key=lambda candidate: candidate.score)
    without = replace(richer, form="dead_zone", prior=problem.prior)
    n = len(richest.fit.theta) - problem.data.modes.shape[1]
    same = judged(fit_train(without, np.delete(richest.fit.theta, [n - 2, n - 1]), _FINE))
    best = same if not plain.steady and same.score < plain.score - _BETTER else plain
    return richest if richest.score < min(plain.score, same.score) - _BETTER else best


def _dead_zone(problem: Problem, rough: TrainFit) -> Candidate:
    """The plain dead zone, with the link's inertia or without, whichever predicts better."""
    still, moving = (replace(problem, form="dead_zone", dynamic=dynamic) for dynamic in (False, True))
    steady = steady_contact(still, rough.theta, rough.gamma)
    if steady is None:
        slides = fit_train(replace(moving, data=problem.data.sliding), rough.theta, FLOORS[1:])
        found = [judged(fit_train(of, slides.theta, _FINE)) for of in (moving, still)]
    elif problem.believes(steady.information, COULOMB):
        begun = rubbing(steady, moving, float(rough.theta[COULOMB]))
        found = [*_continued(begun, moving), *_continued(begun, still, moving)]
    else:
        steady = loaded(steady, moving)
        fits = [evaluated(of, steady.theta, steady.gamma) for of in (moving, still)]
        found = [replace(_predicting(fit, steady.without(fit.problem), steady.covariance), steady=True) for fit in fits]
    best, plain = (
        min((one for one in found if one.fit.problem.dynamic is dynamic), key=lambda one: one.score)
        for dynamic in (True, False)
    )
    return plain if plain.score < best.score - _BETTER else best


def loaded(steady: SteadyContact, problem: Problem) -> SteadyContact:
    """The same with the modes of the load that the other windows show; steady contact hardly shows a stiff joint's.

    Pattern search, no derivatives: a change of side is a kink. What hangs together with a mode moves with it.
    """
    whole, C, p = steady.continued(problem), steady.covariance, len(steady.theta)
    modes = (C / np.sqrt(np.diag(C))).T[p - problem.data.modes.shape[1] : p]
    found, least = steady, _unexplained(whole, steady)
    for share, mode, sign in product(_PATTERN, modes, (1.0, -1.0)):
        step = sign * share * mode
        while True:
            theta = np.maximum(found.theta + step[:p], problem.prior.least)
            moved = replace(found, theta=theta, gamma=found.gamma + step[p:])
            left = _unexplained(whole, moved)
            if left >= least - _WORTH:
                break
            found, least = moved, left
    return found


def _unexplained(problem: Problem, at: SteadyContact) -> float:
    """What the modes minimise: cost and sizes of what is left [-]."""
    theta, gamma = at.theta, at.gamma
    difference = problem.data.y - problem.deltas(theta, gamma)
    scales = sizes(problem, difference - problem.data.terms @ gamma, FLOORS[1])
    return cost(problem, theta, difference, gamma, scales) + problem.of_sizes(scales)


def rubbing(steady: SteadyContact, problem: Problem, coulomb: float) -> SteadyContact:
    """The same with another friction [N.m] where the other windows say so: steady contact has no more than a prior.

    What hangs together with it moves with it.
    """
    C, p = steady.covariance[:, COULOMB], len(steady.theta)
    step = C / C[COULOMB] * (coulomb - steady.theta[COULOMB])
    theta = np.maximum(steady.theta + step[:p], problem.prior.least)
    other, whole = replace(steady, theta=theta, gamma=steady.gamma + step[p:]), steady.continued(problem)
    return min((steady, other), key=lambda at: _unexplained(whole, at))


def _continued(steady: SteadyContact, problem: Problem, *others: Problem) -> list[Candidate]:
    """Where steady contact does not separate friction from the gap: other windows, too, and how far they move it.

    As well for other problems with the parameters of this one: a play operator finds a friction more easily, but lets a
    link in its gap jump where its own inertia would need more than that friction.
    """
    fit = fit_train(steady.continued(problem), steady.theta, _FINE)
    moved = np.append(fit.theta - steady.theta, fit.gamma - steady.gamma)
    covariance = steady.covariance + np.outer(moved, moved)
    return [replace(judged(fit, of), covariance=covariance) for of in (problem, *others)]


def judged(fit: TrainFit, whole: Problem | None = None) -> Candidate:
    """How a fit predicts trials left out; fits without them are one Gauss-Newton step away.

    `whole` is the problem with all windows, where the fit's counts some.
    """
    problem, data, n = fit.problem, fit.problem.data, len(fit.theta)
    A, r, prior = derivatives(problem, fit.theta, fit.gamma), fit.residuals, fit.problem.prior
    w = weights(problem, r, fit.scales) / problem.correlated
    H = (A.T * w) @ A + prior.information
    known, without = np.where(np.isfinite(r), r, 0.0), []
    for i in range(data.part[-1] + 1):
        rows = np.flatnonzero((data.part == i) & np.isfinite(r))
        B = A[rows].T * w[rows]
        step = -np.linalg.solve(H - B @ A[rows] + _DAMPED * np.diag(np.diag(H)), B @ known[rows])
        without.append(np.append(np.maximum(fit.theta + step[:n], prior.least), fit.gamma + step[n:]))
    covariance = covariance_of(fit)
    return _predicting(fit if whole is None else evaluated(whole, fit.theta, fit.gamma), np.array(without), covariance)


def _predicting(fit: TrainFit, without: np.ndarray, covariance: np.ndarray) -> Candidate:
    """A fit with the score of fits `without` each part (n_parts, p + 5)."""
    problem, data, n = fit.problem, fit.problem.data, len(fit.theta)
    left = np.full(len(data.y), np.nan)
    for i, x in enumerate(without):
        rows = data.part == i
        trial = data.trial[rows][0]
        left[rows] = replace(problem, data=data.only(trial)).left(x[:n], x[n:])[rows[data.trial == trial]]
    size = sizes(problem, left, FLOORS[-1])
    moves = data.moves
    count = np.bincount(data.group[moves], minlength=len(size))
    score = float((count * np.log(size)).sum()) / problem.correlated
    return Candidate(fit, score, left, covariance)


def _starts(problem: Problem) -> list[np.ndarray]:
    """Some theta of a grid, the best for each size of gap."""
    spread = float(np.diff(np.nanquantile(problem.data.y, [0.01, 0.99]))[0])
    soft, z = problem.prior.width[1], np.zeros(problem.data.modes.shape[1])
    found = []
    for a in _GAPS:
        grid = [
            np.concatenate([[a * spread, b * 2.0 * soft, f, _VISCOUS, 0.0], z]) for b in _SOFTNESS for f in _FRICTIONS
        ]
        found.append(min((fit_train(problem, theta, ()) for theta in grid), key=lambda fit: fit.cost))
    return [fit.theta for fit in sorted(found, key=lambda fit: fit.cost)[:_TRIED]]
