"""Drive train from steady contact: while the motor slides and the mesh lies on one side, its model is linear.

    y = terms gamma + g s + c (tau + modes z + I a) + c f_c sign(v) + c f_v v              s = -1, 1  the side
    x = (gamma, g, c, c f_c, c f_v, c I, c z)           theta = (g, c, f_c, f_v, I, z)

The sides are those of a simulation with the theta of the round before. Windows beside a change of side, in which either
is on no side or they disagree, starts, stops and rests do not count: where friction holds a link at rest within
+-c f_c is settled by jolts that no model of one joint has. What is linear has one minimum, and is free of the kinks
that a change of side puts into a simulation's cost.

A link encoder that slips on its shaft: from some moment on its readings are off by a constant.

    y = delta(theta) + terms gamma + d h(t - t_0)        while the motor slides steadily, all trials in order of time

d by weighted least squares together with theta and gamma, linear about the fit, for every t_0 with `_EACH` windows on
either side; the one that lowers the cost most. It slipped where d exceeds `_STEP` and `_SIGMAS` standard deviations.
Where the joint does not slide in between, t_0 is where absolute residuals add up to least. Windows on the side opposite
to the predicted one do not count where they are fewer than `_EACH`: a link that crosses its gap once, sooner or later
than predicted, looks like a slip by the gap.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibration.stages.drive_trains.fit.train_fit import GAMMA_INFORMATION, NU, Problem, TrainFit, derivatives

_ROUNDS, _WEIGHTED = 4, 8
_CLEAR = 2  # windows beside a change of side
_APART = 3e-4  # [rad] y and the simulation may differ on a side, half of the gap apart
_FLOOR, _ROUGH = 1.5e-5, 1e-4  # [rad] least size of residuals; size to begin with
_SIDE = 1e-5  # [rad] by which all of a side is off, of what no term holds
_FEWEST = 60  # windows
_EACH, _STEPPED = 10, 3  # windows; rounds
_STEP, _SIGMAS = 5e-4, 5.0  # [rad], [-]
_NORMAL = 1.4826  # standard deviations in a median absolute deviation
_ZERO = 1.0  # [rad] prior of the zero


@dataclass(frozen=True)
class SteadyContact:
    """Theta and gamma of steady contact.

    Attributes:
        theta: (p,).
        gamma: (5,) [rad].
        used: (k,) windows.
        J: (k, p + 5) derivatives of y by theta, gamma.
        residuals: (k,) [rad].
        weights: (k,) of them [1/rad2], 0 where not used.
        information: (p + 5, p + 5) of all; windows that hang together count as one.
    """

    theta: np.ndarray
    gamma: np.ndarray
    used: np.ndarray
    J: np.ndarray
    residuals: np.ndarray
    weights: np.ndarray
    information: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """(p + 5, p + 5) of theta and gamma."""
        C = np.linalg.inv(self.information)
        C[0, 0] += _SIDE**2
        return np.asarray(C)

    def without(self, problem: Problem) -> np.ndarray:
        """Theta and gamma (n_parts, p + 5) of the windows beside each part's."""
        found, least = [], np.append(problem.prior.least, np.full(len(self.gamma), -np.inf))
        for i in range(problem.data.part[-1] + 1):
            own = self.used & (problem.data.part == i)
            A, w = self.J[own], self.weights[own] / problem.correlated
            step = -np.linalg.solve(self.information - (A.T * w) @ A, A.T @ (w * self.residuals[own]))
            found.append(np.maximum(np.append(self.theta, self.gamma) + step, least))
        return np.array(found)

    def continued(self, problem: Problem) -> Problem:
        """The problem of the other windows, with what is known now as its prior."""
        prior = replace(problem.prior, nominal=self.theta, gamma=self.gamma, information=self.information)
        return replace(problem, prior=prior, data=problem.data.counting(~self.used))


def steady_contact(problem: Problem, theta: np.ndarray, gamma: np.ndarray) -> SteadyContact | None:
    """Theta (p,) and gamma (5,) of a dead zone, begun with others; None where steady contact is too rare."""
    found = None
    for _ in range(_ROUNDS):
        side = _sides(problem, theta, gamma)
        if (side != 0.0).sum() < _FEWEST:
            return None
        found = _regressed(problem, side, theta[1])
        theta, gamma = found.theta, found.gamma
    return found


def _sides(problem: Problem, theta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    """(k,) 1 or -1 where a window counts, 0 where not."""
    data = problem.data
    delta = problem.deltas(theta, gamma)
    agree = np.abs(data.y - data.terms @ gamma - delta) < 0.5 * theta[0] + _APART
    side = np.where(data.known & agree & (np.abs(delta) > theta[0]), np.sign(delta), 0.0)
    alone = np.ones(len(side), dtype=bool)
    for shift in range(-_CLEAR, _CLEAR + 1):
        alone &= np.roll(side, shift) == side
    return np.where((data.regime == 0) & alone, side, 0.0)


def _regressed(problem: Problem, side: np.ndarray, compliance: float) -> SteadyContact:
    data, motion, prior = problem.data, problem.data.motion, problem.prior
    used, c = side != 0.0, max(compliance, 0.02 * prior.width[1])
    v, modes = data.means(motion.v), data.means(data.modes)
    A = np.column_stack([side, data.means(motion.torque), np.sign(v), v, data.means(motion.a), modes, data.terms])
    by_c = np.append([1.0, 1.0], np.full(A.shape[1] - 7, c))
    p = len(by_c)
    information = np.append((by_c * prior.width) ** -2.0, np.append(_ZERO**-2.0, GAMMA_INFORMATION[1:]))
    nominal = np.append(by_c * prior.nominal, np.zeros(5))
    y, size, r = np.where(used, data.y, 0.0), np.full(data.n_groups, _ROUGH), np.zeros(len(side))
    count = np.maximum(np.bincount(data.group, used, data.n_groups), 1.0)
    for i in range(_WEIGHTED):
        w = np.where(used, data.weight * (NU + 1.0) / (NU * size[data.group] ** 2 + data.weight * r**2), 0.0)
        H = (A.T * w) @ A / problem.correlated + np.diag(information)
        x = np.linalg.solve(H, A.T @ (w * y) / problem.correlated + information * nominal)
        r = np.where(used, y - A @ x, 0.0)
        for _ in range(4 if i else 12):
            w = np.where(used, data.weight * (NU + 1.0) / (NU * size[data.group] ** 2 + data.weight * r**2), 0.0)
            size = np.maximum(size * np.sqrt(np.bincount(data.group, w * r**2, data.n_groups) / count), _FLOOR)
    c = max(x[1], 0.02 * prior.width[1])
    theta = np.append(np.maximum(np.append([x[0], c], x[2:p] / c), prior.least), x[p:])
    own = np.append(prior.width**-2.0, np.append(_ZERO**-2.0, GAMMA_INFORMATION[1:]))
    meant, least = np.append(prior.nominal, np.zeros(5)), np.append(prior.least, np.full(5, -np.inf))
    for _ in range(_WEIGHTED):  # what the priors mean: a load that is nearly all of modes has its size by them alone
        J = A.copy()  # by theta
        J[:, 2:p] *= theta[1]
        r = np.where(used, y - J @ theta, 0.0)
        J[:, 1] += A[:, 2:p] @ theta[2:p]
        H = (J.T * w) @ J / problem.correlated + np.diag(own)
        theta = np.maximum(
            theta + np.linalg.solve(H, J.T @ (w * r) / problem.correlated + own * (meant - theta)), least
        )
    return SteadyContact(theta[:p], theta[p:], used, J, r, w, H)


@dataclass(frozen=True)
class Slip:
    """Where a link encoder slipped.

    Attributes:
        trial_id: The trial.
        t: Since its first reading [s].
        size: Change of motor minus link reading [rad].
    """

    trial_id: str
    t: float
    size: float


def slipped_encoder(fit: TrainFit) -> Slip | None:
    """The slip that a joint's readings show; None where they show none."""
    problem, data, r = replace(fit.problem, dynamic=False), fit.problem.data, fit.residuals
    times = data.motion.t[data.first]
    known = np.flatnonzero(np.isfinite(r))
    known = known[np.argsort(times[known], kind="stable")]
    at = np.flatnonzero((data.regime[known] == 0) & ~_crossing(fit, r)[known])
    if len(at) < _FEWEST:
        return None
    rows = known[at]
    A = derivatives(problem, fit.theta, fit.gamma)
    k, size, sigma, x = _step(A[rows], r[rows], data.group[rows], problem)
    if abs(size) < max(_STEP, _SIGMAS * sigma):
        return None
    between = known[at[k - 1] + 1 : at[k] + 1]
    left = r[between] - A[between] @ x
    i = between[int(np.argmin(np.cumsum(np.abs(left) - np.abs(left - size)) - np.abs(left) + np.abs(left - size)))]
    trial = int(data.trial[i])
    return Slip(data.trial_ids[trial], float(times[i] - data.motion.t[data.motion.begins[trial]]), size)


def _crossing(fit: TrainFit, r: np.ndarray) -> np.ndarray:
    """(k,) windows on the other side than predicted, by residuals r (k,), and beside them; none where many are."""
    side = np.sign(fit.problem.deltas(fit.theta, fit.gamma))
    opposite = np.abs(r + 2.0 * fit.theta[0] * side) < np.minimum(_APART, np.abs(r))
    opposite &= fit.problem.data.regime == 0
    opposite &= opposite.sum() < _EACH
    return np.asarray(np.any([np.roll(opposite, shift) for shift in range(-_CLEAR, _CLEAR + 1)], axis=0))


def _step(A: np.ndarray, r: np.ndarray, group: np.ndarray, problem: Problem) -> tuple[int, float, float, np.ndarray]:
    """First row after the likeliest step in residuals r (n,), its size and standard deviation [rad], and x (q,).

    A (n, q) are derivatives by theta and gamma; sizes of residuals are medians in each group.
    """
    n, left = len(r), r
    for _ in range(_STEPPED):
        scale = np.full(problem.data.n_groups, _FLOOR)
        for g in np.unique(group):
            own = left[group == g]
            scale[g] = max(_FLOOR, _NORMAL * float(np.median(np.abs(own - np.median(own)))))
        w = (NU + 1.0) / (NU * scale[group] ** 2 + left**2) / problem.correlated
        B = A * w[:, None]
        C = np.linalg.inv(A.T @ B + problem.prior.information)
        after, weight, total = (np.cumsum(x[::-1], axis=0)[::-1] for x in (B, w, w * r))
        by_x = C @ (B.T @ r)
        information = weight - np.einsum("ij,jk,ik->i", after, C, after)
        known = information > 0.0  # none where the derivatives explain all that follows
        d = np.divide(total - after @ by_x, information, out=np.zeros(n), where=known)
        k = _EACH + int(np.argmax(np.where(known, d**2 * information, 0.0)[_EACH : n - _EACH]))
        x = by_x - C @ after[k] * d[k]
        left = r - A @ x - d[k] * (np.arange(n) >= k)
    return k, float(d[k]), float(max(information[k], np.finfo(float).tiny) ** -0.5), x
