"""What the held-out error of the delivered row consists of: each cause switched off in turn.

    e = p_predicted - p_seen = e_base + e_joints + e_clock + e_rest + noise                [m, lab]
    e_base     predicted base less the measured one, at the hand
    e_joints   J (q_predicted - q_link), the mean difference of each joint, a zero, taken off
    e_clock    v tau, the delay tau of one trial by least squares along the hand's velocity v
    e_rest     what is left: geometry, and what no model holds

    share_i^2 = mean(e . e_i) / 3          sum_i share_i^2 = mean |e|^2 / 3

Errors of the link encoders and of the base's markers, which the prediction did not read, are in e_i but not in e, and
not in a share. Noise of the hand's markers is that of the datasheet. Beside the shares is the error with each modelled
effect switched off: what the effect is worth.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from calibration.prediction.predicted_trial import Delivered, PredictedTrial
from calibration.recording.trial import REST

BASE, JOINTS, CLOCK, GEOMETRY, NOISE = "base", "joints", "clocks", "geometry", "noise"
ARM = "joints and geometry"  # where link encoders do not separate the two
_WORTH = 0.02  # of the error, below which a cause is no next step [-]
_REMEDY = {
    BASE: "measure the base while the robot works",
    JOINTS: "read link-side encoders while the robot works",
    CLOCK: "synchronise robot and motion capture by a common trigger",
    GEOMETRY: "record more postures, chosen by the command design",
    ARM: "record link-side encoders in a validation trial: they separate joints from geometry",
}


@dataclass(frozen=True)
class Causes:
    """Errors of one moving trial by cause, n samples.

    Attributes:
        whole: (n, 3) [m, lab].
        base: (n, 3); zero where the base was not seen.
        joints: (n, k) error of each joint [rad, m]; NaN where it is not known.
        J: (n, 3, k).
        velocity: (n, 3) of the hand [m/s, lab].
        noise: (n,) variance per component of the hand's place as seen [m2].
        without: (m, n, 3) error with an effect switched off, by the names below.
        effects: (m,) their names.
    """

    whole: np.ndarray
    base: np.ndarray
    joints: np.ndarray
    J: np.ndarray
    velocity: np.ndarray
    noise: np.ndarray
    without: np.ndarray
    effects: tuple[str, ...]

    def rows(self, kept: np.ndarray) -> "Causes":
        """Some of the samples."""
        names = ("whole", "base", "joints", "J", "velocity", "noise")
        arrays = {name: getattr(self, name)[kept] for name in names}
        return replace(self, **arrays, without=self.without[:, kept])


@dataclass(frozen=True)
class Share:
    """A cause of the error: its size [mm per component], how much less the error is without it, and what to do."""

    cause: str
    size_mm: float
    gain_mm: float
    remedy: str = ""


@dataclass(frozen=True)
class Worth:
    """A modelled effect and the error with it switched off [mm per component]."""

    effect: str
    without_mm: float


@dataclass(frozen=True)
class Budget:
    """The error taken apart.

    Attributes:
        whole_mm: Root mean square per component.
        shares: The largest first.
        worth: Of the modelled effects, the most valuable first.
    """

    whole_mm: float
    shares: tuple[Share, ...]
    worth: tuple[Worth, ...]

    @property
    def next_steps(self) -> tuple[Share, ...]:
        """Causes that something can be done about, the largest gain first."""
        worth = [s for s in self.shares if s.remedy and s.gain_mm > _WORTH * self.whole_mm]
        return tuple(sorted(worth, key=lambda s: -s.gain_mm))

    @classmethod
    def against(cls, trials: Iterable[tuple[PredictedTrial, np.ndarray, np.ndarray, np.ndarray]]) -> "Budget | None":
        """Of trials against noiseless poses of hand and base's body (n, 4, 4) and joint positions (n, k)."""
        return budget([causes(p.delivered, p.t, *true) for p, *true in trials if p.delivered is not None])

    def entry(self) -> dict[str, object]:
        """As evaluation.json and score.json have it."""
        return asdict(self) | {"next_steps": [asdict(s) for s in self.next_steps], "sentence": self.sentence}

    @property
    def sentence(self) -> str:
        """In one sentence."""
        parts = ", ".join(f"{s.cause} {s.size_mm:.2f}" for s in self.shares if s.size_mm >= _WORTH * self.whole_mm)
        steps = "; ".join(f"{s.remedy} (-{s.gain_mm:.2f} mm)" for s in self.next_steps)
        return f"Of the {self.whole_mm:.2f} mm: {parts} (added in squares); next: {steps or 'nothing is worth it'}."


def causes(
    delivered: Delivered, t: np.ndarray, T_lab_hand: np.ndarray, T_lab_B: np.ndarray, q: np.ndarray,
    noise: np.ndarray | None = None,
) -> Causes:  # fmt: skip
    """Causes of a trial's error after its first second, `noise` (n,) as in `Causes`, none where not given.

    Against poses of the hand's and the base's body (n, 4, 4) and joint positions q (n, k).
    """
    T_lab_H = delivered.T_lab_B @ delivered.T_B_H
    seen = T_lab_hand[:, :3, 3]
    moved = ((delivered.T_lab_B - T_lab_B) @ delivered.T_B_H)[:, :3, 3]
    effects = tuple(name for name, _ in delivered.without)
    without = np.array([T[:, :3, 3] - seen for _, T in delivered.without]).reshape(-1, len(seen), 3)
    velocity = np.nan_to_num(np.gradient(T_lab_H[:, :3, 3], t, axis=0))  # beside a gap it is not known
    found = Causes(
        T_lab_H[:, :3, 3] - seen,
        np.where(np.isfinite(moved), moved, 0.0),
        delivered.q - q,
        delivered.J,
        velocity,
        np.zeros(len(seen)) if noise is None else noise,
        without,
        effects,
    )
    return found.rows(t > t[0] + REST)


def budget(trials: Sequence[Causes]) -> Budget | None:
    """The budget of some trials; None where nothing was compared."""
    trials = [one.rows(np.isfinite(one.whole).all(axis=1)) for one in trials]
    trials = [one for one in trials if len(one.whole)]
    if not trials:
        return None
    joints = _of_joints(trials)
    late = [_late(one.whole - one.base - e, one.velocity) for one, e in zip(trials, joints, strict=True)]
    whole = np.concatenate([one.whole for one in trials])
    parts = {BASE: [one.base for one in trials], JOINTS: joints, CLOCK: late}
    total = float((whole**2).mean())
    squares = {name: float((whole * np.concatenate(e)).mean()) for name, e in parts.items()}
    squares[NOISE] = float(np.concatenate([one.noise for one in trials]).mean())
    if not any(np.isfinite(one.joints).any() for one in trials):
        squares.pop(JOINTS)
    squares[GEOMETRY if JOINTS in squares else ARM] = total - sum(squares.values())
    shares = [Share(name, _mm(x), _mm(total) - _mm(total - x), _REMEDY.get(name, "")) for name, x in squares.items()]
    worth = sorted(_worth(trials), key=lambda w: -w.without_mm)
    return Budget(_mm(total), tuple(sorted(shares, key=lambda s: -s.size_mm)), tuple(worth))


def _of_joints(trials: Sequence[Causes]) -> list[np.ndarray]:
    """Displacements (n, 3) of the hand by each trial's joint errors, means over all trials taken off."""
    everything = np.concatenate([one.joints for one in trials])
    known = np.isfinite(everything)
    mean = np.where(known, everything, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return [np.einsum("nik,nk->ni", one.J, np.nan_to_num(one.joints - mean)) for one in trials]


def _late(e: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """The part (n, 3) of errors that one delay explains."""
    return np.asarray(velocity * (e * velocity).sum() / max(float((velocity**2).sum()), np.finfo(float).tiny))


def _worth(trials: Sequence[Causes]) -> Iterator[Worth]:
    for k, name in enumerate(trials[0].effects):
        yield Worth(name, _mm(float((np.concatenate([one.without[k] for one in trials]) ** 2).mean())))


def _mm(square: float) -> float:
    return 1e3 * float(np.sqrt(max(square, 0.0)))
