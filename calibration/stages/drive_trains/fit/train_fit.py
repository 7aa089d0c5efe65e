"""Drive train of one joint from motor minus link readings: robust, every trial with an error of its own size.

    r = y - delta(theta) - terms gamma       theta  half gap, compliance, frictions, ..., z       gamma  zero, e(theta)
    minimise  1 / c sum_t sum_i (nu + 1) / 2 log(1 + r_i^2 / (nu s_t^2)) + sum_j ((theta_j - nominal_j) / width_j)^2 / 2

s_t is the size of trial t's residuals: where switching from side to side is predicted at the wrong time the trial
counts less; at first no trial's is small, that none of them fixes a compliance alone. c windows hang together. z
(unit normal) are the largest modes of what other masses and centres of mass do to the torque. Levenberg-Marquardt
with derivatives over finite steps, wide enough to move the moments of switching by whole windows; those of the play
operator lead the steps of the link's full motion, which accepts them or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.numerics.compiled import njit
from calibration.stages.drive_trains.drive_train import DriveTrain, Form
from calibration.stages.drive_trains.fit.joint_data import JointData

FLOORS = (4e-4, 1e-4, 5e-5, 2e-5)  # [rad] least size of residuals, round by round
NU = 4.0
_ECCENTRIC = np.array([3e-3, 3e-3, 1e-3, 1e-3])  # [rad] prior of once and twice per turn
GAMMA_INFORMATION = np.append(0.0, _ECCENTRIC**-2.0)  # [1/rad2]
_PARAMETERS = ("half_gap", "compliance", "coulomb", "viscous", "link_inertia")
_MESH = ("spring", "slip")
_STEPS = 6
_OPEN = 0.5  # of the prior's standard deviation: more, and a parameter is not known
_RUBS = 2.0  # [N.m] friction of a link that friction holds
_SOFT = 1e-3  # [rad/(N.m)] compliance of a small gear
_LESS = 0.03  # decrease of the cost [-] that is worth another step


@dataclass(frozen=True)
class Prior:
    """What is believed of theta beforehand.

    Attributes:
        nominal: (p,).
        width: (p,) standard deviations.
        least: (p,) lower limits.
        step: (p,) of finite differences.
        gamma: (5,) [rad].
        information: (p + 5, p + 5) of theta and gamma.
    """

    nominal: np.ndarray
    width: np.ndarray
    least: np.ndarray
    step: np.ndarray
    gamma: np.ndarray
    information: np.ndarray

    def off(self, theta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
        """Theta and gamma (p + 5,) less the believed ones."""
        return np.append(theta - self.nominal, gamma - self.gamma)


@dataclass(frozen=True)
class Problem:
    """A joint's trials and what is believed.

    Attributes:
        joint: Name.
        data: Its trials.
        prior: Of theta.
        form: Which mesh.
        dynamic: Whether the link's inertia counts.
    """

    joint: str
    data: JointData
    prior: Prior
    form: Form = "dead_zone"
    dynamic: bool = True

    @property
    def correlated(self) -> float:
        """Windows that hang together."""
        return max(1.0, self.data.correlated / self.data.window)

    @property
    def names(self) -> tuple[str, ...]:
        """Of theta."""
        mesh = _MESH if self.form == "friction_held" else ()
        return (*_PARAMETERS, *mesh, *(f"mode_{i}" for i in range(self.data.modes.shape[1])))

    def train(self, theta: np.ndarray) -> DriveTrain:
        """The drive train with parameters theta (p,)."""
        n = len(_PARAMETERS)
        mesh = theta[n : n + 2] if self.form == "friction_held" else np.zeros(2)
        values = np.concatenate([theta[:4], [self.data.relaxation], mesh])
        return DriveTrain(self.joint, self.form, values, float(theta[4]), self.dynamic)

    def modes(self, theta: np.ndarray) -> np.ndarray:
        """z (z,) of theta."""
        return theta[len(theta) - self.data.modes.shape[1] :]

    def deltas(self, theta: np.ndarray, gamma: np.ndarray, off: float = 0.0) -> np.ndarray:
        """Window means (k,) of delta [rad]; `off` as `JointData.delta` has it."""
        return self.data.delta(self.train(theta), self.modes(theta), gamma, off)

    def of_sizes(self, scales: np.ndarray) -> float:
        """1 / c sum_j n_j log s_j of sizes (n_groups,) of residuals: the least ones cost what any fit does, or less."""
        data = self.data
        return float(np.bincount(data.group[data.known], minlength=len(scales)) @ np.log(scales)) / self.correlated

    def believes(self, information: np.ndarray, i: int) -> bool:
        """Whether of parameter i little more is known than the prior, by information (p + 5, p + 5)."""
        return bool(np.linalg.inv(information)[i, i] > (_OPEN * self.prior.width[i]) ** 2)

    def left(self, theta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
        """r (k,) [rad]."""
        return np.asarray(self.data.y - self.deltas(theta, gamma) - self.data.terms @ gamma)


@dataclass(frozen=True)
class TrainFit:
    """A fitted drive train.

    Attributes:
        problem: What was fitted.
        theta: (p,).
        gamma: (5,) zero and eccentricities [rad].
        scales: (n_groups,) sizes of the residuals [rad].
        cost: At the solution.
    """

    problem: Problem
    theta: np.ndarray
    gamma: np.ndarray
    scales: np.ndarray
    cost: float

    @property
    def residuals(self) -> np.ndarray:
        """r (k,) [rad]."""
        return self.problem.left(self.theta, self.gamma)


@dataclass(frozen=True)
class _State:
    """Where the search is: theta, gamma, y - delta, its cost and the damping of the next step."""

    theta: np.ndarray
    gamma: np.ndarray
    difference: np.ndarray
    cost: float
    damping: float


def prior_of(data: JointData, form: Form, backlash: float, deflection: float) -> Prior:
    """Wide priors: half gap `backlash` [rad], compliance that turns by `deflection` [rad] at the largest torque."""
    largest = float(np.abs(data.motion.torque).max())
    inertia = float(data.motion.inertia.mean())
    soft = min(deflection / max(0.5, largest), _SOFT)
    rows = [  # nominal, width, least, step
        (0.0, backlash, 0.0, 5e-3 * backlash),
        (0.5 * soft, 0.5 * soft, 0.0, 4e-3 * soft),
        (0.0, _RUBS if form == "friction_held" else 0.2 + 0.1 * largest, 0.0, 0.02),
        (0.0, 0.5, 0.0, 0.02),
        (0.0, 0.05 * inertia + 3e-3, -0.5 * inertia, 0.05 * inertia + 5e-4),
    ]
    if form == "friction_held":
        rows += [(0.0, 1e4, 50.0, 50.0), (0.0, 2.0, 0.0, 0.03)]
    rows += [(0.0, 1.0, -np.inf, 0.1)] * data.modes.shape[1]
    nominal, width, least, step = (np.array(x) for x in zip(*rows, strict=True))
    return Prior(nominal, width, least, step, np.zeros(5), np.diag(np.append(width**-2.0, GAMMA_INFORMATION)))


def fit_train(problem: Problem, theta: np.ndarray, floors: Sequence[float] = FLOORS) -> TrainFit:
    """Fit from theta (p,)."""
    gamma = np.append(np.nanmedian(problem.data.y), np.zeros(4))
    for _ in range(2):
        difference = problem.data.y - problem.deltas(theta, gamma)
        gamma = _linear(problem, difference, FLOORS[0])
    state = _State(theta, gamma, difference, np.inf, 1e-2)
    for floor in floors:
        scales = sizes(problem, _left(problem, state.difference, state.gamma), floor)
        state = replace(state, cost=cost(problem, state.theta, state.difference, state.gamma, scales))
        quick = _quick(problem)
        for _ in range(_STEPS):
            before, state = state.cost, _improved(problem, quick, state, scales)
            if before - state.cost < _LESS and quick is not problem:
                quick, state = problem, replace(state, damping=1e-2)
            elif before - state.cost < _LESS:
                break
    scales = sizes(problem, _left(problem, state.difference, state.gamma), floors[-1] if floors else FLOORS[0])
    total = cost(problem, state.theta, state.difference, state.gamma, scales)
    return TrainFit(problem, state.theta, state.gamma, scales, total + problem.of_sizes(scales))


def evaluated(problem: Problem, theta: np.ndarray, gamma: np.ndarray) -> TrainFit:
    """Given theta (p,) and gamma (5,) as a fit."""
    difference = problem.data.y - problem.deltas(theta, gamma)
    scales = sizes(problem, _left(problem, difference, gamma), FLOORS[-1])
    return TrainFit(problem, theta, gamma, scales, cost(problem, theta, difference, gamma, scales))


def weights(problem: Problem, r: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Of residuals r (k,) in least squares [1/rad2], 0 where there is none."""
    data, s, r = problem.data, scales[problem.data.group] ** 2, np.where(problem.data.known, r, 0.0)
    return np.where(data.known, data.weight * (NU + 1.0) / (NU * s + data.weight * r**2), 0.0)


def sizes(problem: Problem, r: np.ndarray, floor: float) -> np.ndarray:
    """Size (n_groups,) [rad] of each group's residuals: the scale of Student's distribution, by its fixed point."""
    data = problem.data
    weight = np.where(data.known, data.weight, 0.0)
    return np.asarray(_sizes(weight, np.where(data.known, r, 0.0) ** 2, data.group, data.n_groups, floor))


@njit(cache=True, error_model="numpy")
def _sizes(weight: np.ndarray, square: np.ndarray, group: np.ndarray, n: int, floor: float) -> np.ndarray:
    """`sizes` by squares (k,), 0 where there is no residual, as its weight is."""
    count, total, s = np.zeros(n), np.zeros(n), np.empty(n)
    for i in range(len(group)):
        count[group[i]] += weight[i] > 0.0
        total[group[i]] += square[i]
    for j in range(n):
        count[j] = max(count[j], 1.0)
        s[j] = max(np.sqrt(total[j] / count[j]), floor)
    for _ in range(12):
        for j in range(n):
            total[j] = 0.0
        for i in range(len(group)):
            if weight[i] > 0.0:
                left = NU * s[group[i]] ** 2 + weight[i] * square[i]
                total[group[i]] += weight[i] * (NU + 1.0) / left * square[i]
        for j in range(n):
            s[j] = max(np.sqrt(s[j] ** 2 * total[j] / count[j]), floor)
    return s


def cost(problem: Problem, theta: np.ndarray, difference: np.ndarray, gamma: np.ndarray, scales: np.ndarray) -> float:
    """What is minimised, at theta with y - delta = `difference` (k,)."""
    r, prior, data = _left(problem, difference, gamma), problem.prior, problem.data
    square = data.weight * np.where(data.known, r, 0.0) ** 2 / (NU * scales[data.group] ** 2)
    off = prior.off(theta, gamma)
    return 0.5 * (NU + 1.0) * float(np.log1p(square).sum()) / problem.correlated + 0.5 * float(
        off @ prior.information @ off
    )


def derivatives(problem: Problem, theta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    """d(delta + terms gamma)/d(theta, gamma) (k, p + 5) over finite steps; rows without y are 0."""
    step = problem.prior.step
    moved = theta + np.vstack([np.zeros(len(theta)), np.diag(step)])
    if problem.form == "dead_zone" and not problem.dynamic:
        n = len(_PARAMETERS)
        deltas = problem.data.played(moved[:, :n], moved[:, n:], gamma)
    else:
        deltas = np.array([problem.deltas(of, gamma) for of in moved])
    J = np.column_stack([((deltas[1:] - deltas[0]) / step[:, None]).T, problem.data.terms])
    return np.where(problem.data.known[:, None], J, 0.0)


def _left(problem: Problem, difference: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    return np.asarray(difference - problem.data.terms @ gamma)


def _linear(problem: Problem, difference: np.ndarray, floor: float) -> np.ndarray:
    """gamma (5,) by iteratively weighted least squares."""
    A, gamma = problem.data.terms, np.append(np.nanmedian(difference), np.zeros(4))
    known, believed = np.where(np.isfinite(difference), difference, 0.0), problem.prior.information[-5:, -5:]
    for _ in range(4):
        r = _left(problem, difference, gamma)
        w = weights(problem, r, sizes(problem, r, floor)) / problem.correlated
        gamma = np.linalg.solve((A.T * w) @ A + believed, A.T @ (w * known) + believed @ problem.prior.gamma)
    return gamma


def _quick(problem: Problem) -> Problem:
    """The problem whose derivatives lead a step: without the link's inertia, where that can be."""
    return replace(problem, dynamic=False) if problem.dynamic and problem.form == "dead_zone" else problem


def _improved(problem: Problem, quick: Problem, state: _State, scales: np.ndarray) -> _State:
    """By derivatives of `quick`, after a step that lowers the cost; the same with more damping where none does."""
    prior, n, theta = problem.prior, len(state.theta), state.theta
    A = derivatives(quick, theta, state.gamma)
    r = _left(problem, state.difference, state.gamma)
    w = weights(problem, r, scales) / problem.correlated
    H = (A.T * w) @ A + prior.information
    b = A.T @ (w * np.where(np.isfinite(r), r, 0.0)) - prior.information @ prior.off(theta, state.gamma)
    free = np.flatnonzero(~np.append((theta <= prior.least) & (b[:n] < 0.0), np.zeros(5, dtype=bool)))
    D, damping = H[np.ix_(free, free)], state.damping
    for _ in range(7):
        step = np.zeros(len(b))
        step[free] = np.linalg.solve(D + damping * np.diag(np.diag(D)), b[free])
        at, gamma = np.maximum(theta + step[:n], prior.least), state.gamma + step[n:]
        difference = problem.data.y - problem.deltas(at, gamma)
        new = cost(problem, at, difference, gamma, scales)
        if new < state.cost:
            return _State(at, gamma, difference, new, max(1e-4, 0.2 * damping))
        damping *= 6.0
    return replace(state, damping=min(damping, 1e3))
