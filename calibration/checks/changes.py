"""What changed while a campaign was recorded, or does not follow the robot: from the hand's residuals along all motion.

    r_i = log6(T_measured_i^-1 T_B_H(q_i)) = J_theta e + J_j c_ij x + noise        x the size of a change    [m, rad]

c_ij of joint j        gain q_ij - mean, slip 0 before a time and 1 after, drift the time
of the readings        late by x after a time: the joints' velocities
of the hand's markers, slipped after a time: a constant twist in the hand, and of the base's markers in the base

e are the errors of the geometry, as large as its fit says; gears' compliance and backlash under gravity are nuisances
as well, since they follow the angle too. So is J_j (link - motor) of a joint whose link encoder shows more backlash
than its datasheet, on the same sides after a time as before: it crosses its gap, no reading slipped. What is left is
divided by its own size, and the variance of x sums over blocks of time, because gears lag for as long as a motion
lasts. The change that explains most is named, where it is larger than gears, clocks and mounts explain (their
datasheet's tolerances) and than five of its standard deviations.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from calibration.checks.unexplained import Passed, Unexplained
from calibration.inference.parameters import Model
from calibration.numerics.lie import adjoint, inverse
from calibration.recording.schema import Description
from calibration.robot.blocks import Frames
from calibration.robot.hand import HandModel
from calibration.verdict import Direction, Verdict

STAGE = "reading"
_FEWEST = 30  # samples
_TIMES = 15  # at which something may have changed
_CHANCE, _CLEAR = 5.7e-7, 1.1  # five standard deviations; times the square of them
_SURE = 5.0  # standard deviations
_FAR_OFF = 4.0  # tolerances of a body of markers the hand may be off throughout
_MOUNTED = 3.0  # tolerances a body of markers may be off its drawing
_KNOWN = 4.0  # standard deviations of the clock that readings may be late unsaid, long after the trials it is of
_LATE, _SLOW = 3e-3, 0.02  # [s]; [rad/s, m/s] below which backlash is not on one side
_NEAR, _UNCLEAR = 3.0, 0.25  # sigma from exchanged; a sigma that leaves sides open [-]
_GEAR = 10.0  # times what a gear explains: a difference of sides that no exchange makes, see `joint_readings`
_OTHERS = 0.06  # of what a gear explains: errors of a hand that follow the difference of a joint's sides
_WRONG = 3.0  # times what is explained beyond which the effect is not bounded


@dataclass(frozen=True)
class Change:
    """A possible change.

    Attributes:
        text: What it is called.
        columns: (n, 6, m) what a unit of it adds to the residuals, m > g where something else is fitted as well.
        limit: (g,) sizes that are explained otherwise.
        unit: In which a single one is written.
        factor: Of that unit.
        moves: Parameters that are as much off on one side of the change, one for each size.
        each: What a unit of the size moves them [-].
    """

    text: str
    columns: np.ndarray
    limit: np.ndarray
    unit: str = ""
    factor: float = 1e3
    moves: tuple[str, ...] = ()
    each: float = 1.0

    def moved(self, value: np.ndarray) -> Direction:
        """What a size (g,) may have moved."""
        return tuple((name, self.each * float(x)) for name, x in zip(self.moves, value, strict=True))

    def size(self, value: np.ndarray) -> str:
        """A size (g,) as it is written."""
        if len(value) == 1:
            return f"{self.factor * value[0]:+.2g} {self.unit}"
        return f"{1e3 * np.linalg.norm(value[:3]):.1f} mm and {1e3 * np.linalg.norm(value[3:]):.0f} mrad"


def changes(left: Unexplained, description: Description, ids: Sequence[str]) -> Iterator[Verdict]:
    """The change that explains the residuals of a calibration's trials best, if it is one; `ids` are their names."""
    for message, over, moved in _best(left, _possible(left, description, ids)):
        if over > _WRONG:
            yield Verdict(STAGE, "refused", f"{message}; correct it, or record again")
        else:
            yield Verdict(STAGE, "warning", f"{message}; intervals include it; correct it, or record again", (moved,))


def constants(left: Unexplained, description: Description, trial: str) -> Iterator[Verdict]:
    """The one thing that is otherwise in a trial than in the calibration, if anything is."""
    if left.rms > _FAR_OFF * description.tolerances.body_translation:
        message = f"{trial}: the hand is {1e3 * left.rms:.0f} mm (rms) from where the calibrated robot has it"
        yield Verdict(STAGE, "warning", f"{message}: labels, base markers, clocks, or another robot or session?")
    always = [("", np.ones(len(left.x.t)))]
    for message, *_ in _best(left, _otherwise(left, description, always)):
        yield Verdict(STAGE, "warning", f"{trial}: against the calibration, {message}; its errors are not the model's")


def _best(left: Unexplained, possible: Iterable[Change]) -> Iterator[tuple[str, float, Direction]]:
    """What explains the residuals best, how many times it exceeds what is explained otherwise, and what it moves."""
    if len(left.x.t) < _FEWEST:
        return
    best: float = 0.0
    found: tuple[str, float, Direction] = ("", 0.0, ())
    for change in possible:
        value, S, gain = left.fitted(change.columns, len(change.limit))
        square = float(value @ np.linalg.solve(S, value))
        over = float(np.abs(value / change.limit).max())
        if square > _CLEAR * chdtri(len(value), _CHANCE) and over > 1.0 and gain > best:
            text = f"{change.text} by {change.size(value)} (known to {100.0 / np.sqrt(square):.0f} % of it)"
            best, found = gain, (text, over, change.moved(value))
    if best > 0.0:
        yield found


def wrong_mounts(hand: HandModel, model: Model, description: Description) -> Iterator[Verdict]:
    """Marker bodies that are many tolerances from where they are drawn on their links."""
    frames, tol = hand.block(Frames).names, description.tolerances
    for body, names in ((description.base_body, frames[:6]), (description.hand_body, frames[6:])):
        found = {p.name: p.value - p.nominal for p in model.parameters}
        off = np.array([found.get(name, 0.0) for name in names])
        over = float(np.abs(off / np.repeat([tol.body_translation, tol.body_rotation], 3)).max())
        if over > _MOUNTED:
            message = (
                f"body {body.name}: its markers are {1e3 * np.linalg.norm(off[:3]):.0f} mm and "
                f"{np.degrees(np.linalg.norm(off[3:])):.1f} deg from their nominal place on {body.link}, {over:.0f} "
                "times the tolerance: correct the drawing or the placement in dataset.json"
            )
            pulled = _pulled(model, names, off, np.repeat([tol.body_translation, tol.body_rotation], 3))
            yield Verdict(STAGE, "refused" if over > 1.5 * _MOUNTED else "warning", message, (pulled,))


def _pulled(model: Model, names: Sequence[str], off: np.ndarray, tolerance: np.ndarray) -> Direction:
    """How far a prior off by `off` (6,) moves all parameters: S[:, names] off / tolerance^2."""
    every = [p.name for p in model.parameters]
    known = [k for k, name in enumerate(names) if name in every]
    columns = [every.index(names[k]) for k in known]
    shift = model.random_covariance[:, columns] @ (off / tolerance**2)[known]
    return tuple(zip(every, map(float, shift), strict=True))


def exchanged_sides(left: Unexplained, description: Description) -> Iterator[Verdict]:
    """Joints whose motor reading is where the link is: r = x J_j (motor - link) + J_j w(q_j), x = 1 as they are named.

    w are waves of one and two periods a turn, fitted as well: an eccentric encoder of the link adds them to its
    readings alone and moves no hand. The sigma of x includes what else follows the difference, over its size less
    waves. Joints nearer to x = 0 than to 1 are named where they are many sigma from 1 together.
    """
    joints, columns = left.hand.nominal.joints, left.hand.nominal.columns
    d = (left.x.q - left.x.link)[:, columns]
    known = np.flatnonzero(np.isfinite(d).all(axis=0))
    if not len(known):
        return
    q, J = left.x.q[:, columns][:, known], left.J[:, :, known]
    d = d[:, known] - np.median(d[:, known], axis=0)
    waves = _waves(q)
    play, lag = np.array([_play(left, description, int(j))[0] for j in known]), _less_waves(d, waves).std(axis=0)
    value, S, _ = left.fitted(np.concatenate([J * x[:, None] for x in (d, *waves)], axis=2), len(known))
    sigma = np.hypot(np.sqrt(np.diag(S)), _OTHERS * play / np.maximum(lag, 1e-9))
    near = (value < 0.5) & (np.abs(value) < _NEAR * sigma) & (lag < _GEAR * play)
    far = np.where(near, (1.0 - value) / sigma, 0.0)
    wrong = far > min(_NEAR, float(far.max()) - 1e-9)
    if np.linalg.norm(far) > _SURE:
        names = ", ".join(joints[known[k]] for k in np.flatnonzero(wrong))
        message = (
            f"motor and link readings of {names} are exchanged, or a link encoder is wrong: the motor readings place "
            f"the hand ({value[wrong].mean():.2f} of their difference moves it, +- {sigma[wrong].mean():.2f})"
        )
        unclear = ", ".join(joints[known[k]] for k in np.flatnonzero(~wrong & (sigma > _UNCLEAR)))
        message += f"; sides of {unclear} differ too little to be judged, check them too" if unclear else ""
        yield Verdict(STAGE, "refused", f"{message}; exchange the columns")


def _waves(q: np.ndarray) -> np.ndarray:
    """What an eccentric encoder adds at angles q (n, k), by unit size (4, n, k)."""
    return np.stack([f(n * q) for n in (1, 2) for f in (np.cos, np.sin)])


def _less_waves(d: np.ndarray, waves: np.ndarray) -> np.ndarray:
    """Differences d (n, k) without their means and waves (4, n, k)."""
    X = np.moveaxis(np.concatenate([np.ones_like(waves[:1]), waves]), (0, 1, 2), (2, 1, 0))
    return np.asarray(d - (X @ (np.linalg.pinv(X, rcond=1e-6) @ d.T[..., None]))[..., 0].T)


def _possible(left: Unexplained, description: Description, ids: Sequence[str]) -> Iterator[Change]:
    """Everything that may have changed."""
    hand, x, J = left.hand, left.x, left.J
    order = np.argsort(x.t)
    moments = x.t[order[np.linspace(0, len(order) - 1, _TIMES + 2).astype(int)[1:-1]]]
    ago = (x.t - x.t.mean()) / max(float(np.ptp(x.t)), 1.0)
    crossing = _crossing(left, description)
    for j, name in enumerate(hand.nominal.joints):
        play, unit = _play(left, description, j)
        q = x.q[:, hand.nominal.columns[j]]
        centred = (q - q.mean())[:, None, None]
        if (spread := float(centred.std())) > 10.0 * play:
            limit = np.array([play / spread])
            moves = (_zero(name),), spread
            scale = Change(
                f"readings of {name} are off in scale", J[:, :, j, None] * centred, limit, "%", 100.0, *moves
            )
            yield _beside([c for c in crossing if c.joint != j], ago > 0, scale)
        columns, limit = J[:, :, j, None] * ago[:, None, None], np.array([2.0 * play])
        yield _beside(
            crossing, ago > 0, Change(f"readings of {name} drift", columns, limit, unit, moves=(_zero(name),))
        )
    for moment in moments:
        later = x.t >= moment
        for change in _otherwise(left, description, [(_when(x, ids, moment), later.astype(float))]):
            yield _beside(crossing, later, change)


@dataclass(frozen=True)
class _Crossing:
    """Joint j whose link crosses its backlash: link less motor d (n,), J_j d (n, 6), what its datasheet explains."""

    joint: int
    d: np.ndarray
    column: np.ndarray
    play: float

    def on_same_sides(self, later: np.ndarray) -> bool:
        """Whether what d covers before some time, or after it, lies within the other: readings that slip shift it."""
        (a, b), (c, d) = (np.percentile(self.d[rows], (5.0, 95.0)) for rows in (~later, later))
        return bool(min(max(c - a, b - d), max(a - c, d - b)) < self.play)


def _crossing(left: Unexplained, description: Description) -> tuple[_Crossing, ...]:
    """Joints whose link encoder shows more backlash than their datasheet, less than what no gear has."""
    found = []
    for j, column in enumerate(left.hand.nominal.columns):
        d = left.x.link[:, column] - left.x.q[:, column]
        play, _ = _play(left, description, j)
        if np.isfinite(d).all() and 2.0 * play < np.ptp(np.percentile(d, (5.0, 95.0))) < 2.0 * _GEAR * play:
            found.append(_Crossing(j, d, left.J[:, :, j] * (d - d.mean())[:, None], play))
    return tuple(found)


def _beside(crossing: Sequence[_Crossing], later: np.ndarray, change: Change) -> Change:
    """A change, beside links that cross their backlash before and after some time (n,)."""
    others = [c.column[..., None] for c in crossing if c.on_same_sides(later)]
    return replace(change, columns=np.concatenate([change.columns, *others], axis=2))


def _otherwise(
    left: Unexplained, description: Description, steps: Sequence[tuple[str, np.ndarray]]
) -> Iterator[Change]:
    """What may be otherwise in the samples of each step (n,) of 0 and 1."""
    hand, x, J, tol = left.hand, left.x, left.J, description.tolerances
    mount = np.repeat([0.4 * tol.body_translation, 0.4 * tol.body_rotation], 3)
    in_base, frames = adjoint(inverse(x.T)), hand.block(Frames).names
    for when, step in steps:
        rows = step[:, None, None]
        for j, name in enumerate(hand.nominal.joints):
            play, unit = _play(left, description, j)
            columns, moves = J[:, :, j, None] * rows, (_zero(name),)
            yield Change(f"readings of {name} slipped{when}", columns, np.array([play]), unit, moves=moves)
        yield _late(left, when, step)
        yield Change(f"markers of the hand are elsewhere{when}", np.eye(6) * rows, mount, moves=frames[6:])
        yield Change(f"markers of the base are elsewhere{when}", in_base * rows, mount, moves=frames[:6])


def _late(left: Unexplained, when: str, step: np.ndarray) -> Change:
    """Readings that come late; a link behind backlash does so as well, by a constant angle against the motion."""
    v = left.x.v[:, None, left.hand.nominal.columns]
    late, behind = -(left.J * v).sum(axis=2, keepdims=True) * step[:, None, None], left.J * np.tanh(v / _SLOW)
    known = float(np.sqrt((left.x.late[step > 0.0] ** 2).mean()))
    columns, limit = np.concatenate([late, behind], axis=2), np.array([np.hypot(_LATE, _KNOWN * known)])
    return Change(f"readings are late{when}", columns, limit, "ms", moves=("clock.robot.offset",))


def _zero(joint: str) -> str:
    return f"encoder.{joint}.motor.offset"


def _play(left: Unexplained, description: Description, j: int) -> tuple[float, str]:
    """What joint j's gear explains of a reading [rad, m], and the unit it is written in."""
    prismatic = left.hand.nominal.is_prismatic(left.hand.nominal.joints[j])
    return 0.5 * description.tolerances.joint_play * (0.1 if prismatic else 1.0), "mm" if prismatic else "mrad"


def _when(x: Passed, ids: Sequence[str], moment: float) -> str:
    k = int(x.trial[np.argmin(np.abs(x.t - moment))])
    return f" from {moment - x.t[x.trial == k].min():.0f} s of {ids[k]} on"
