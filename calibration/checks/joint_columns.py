"""Columns of joints that are swapped or reversed, found by the hand's markers before anything is written.

    e_h = mean_i min(|d_i|, 0.5 m),   d_i = (p, L w) of (X A_i(h) Y)^-1 B_i        L = 0.2 m

A_i(h) is the nominal robot's T_base_hand at the readings under hypothesis h (as declared; one joint reversed; two
joints swapped), B_i the measured one; X and Y are two constant frames fitted to all of them (hand-eye), so that no
drawing is needed. A robot is a centimetre or two off its nominal model, a column that is another's by the motion
itself: where one hypothesis explains the hand better than the declaration by a factor, it is reported.
Joints that do not move, or turn about one line, are not distinguishable so and are not reported. A single wrong file
among right ones is compared with the frames fitted to the others.

Clocks are not known yet: the robot's is brought to the markers' by the hand's speed of rotation, for each hypothesis.
"""

import logging
from collections.abc import Iterator, Sequence

import numpy as np

from calibration.checks.column_hypotheses import MOST, Frames, Pairs, Reading, Shown, as_declared, distance, readings
from calibration.errors import InputError, NotEnoughData
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.cluster_shape import of_one_shape
from calibration.mocap.labels import with_right_labels
from calibration.mocap.postures import mean_postures
from calibration.numerics.alignment import hand_eye, registration_start
from calibration.numerics.lie import inverse
from calibration.recording.posture_means import PostureMeans
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.verdict import Verdict

_POSES, _FEWEST, _ENOUGH = 60, 6, 10  # compared, of all trials; of each at least; to judge by
_OFF, _ANOTHER = 0.012, 0.06  # [m] no suspicion; another robot than the nominal one
_CLEAR = 1.5  # so many times better is an explanation
_ODD = 3.0  # times the other files' distance: a file unlike them
_HALF = 0.5  # of that file's distance is left by an explanation, at most
_STRANGE = 0.15  # [m] a file for which there is none; postures far from the others' are 60 mm off on a loose robot
_log = logging.getLogger(__name__)


def check_columns(description: Description, chain: Chain, trials: Sequence[tuple[str, Trial | PostureMeans]]) -> None:
    """Refuse readings that explain the hand only with a joint reversed or two swapped, or not at all.

    Args:
        description: Of the dataset to be written.
        chain: The nominal chain.
        trials: Of one session, where markers stay as they are, each with the file it came from.

    Raises:
        InputError: It names the files, the joints and what to do.
    """
    shown = []
    for file, trial in trials:
        try:
            shown.append(_shown(description, file, trial))
        except NotEnoughData as error:
            _log.info("%s: joints not compared with the hand: %s", file, error)
    try:
        odd = _odd_one(chain, shown)
    except NotEnoughData as error:
        _log.info("files not compared with each other: %s", error)
        odd = None
    if odd is not None:
        raise InputError(*odd)
    meaning = _judge(chain, shown) if shown else None
    if meaning is not None:
        more = f" and {len(shown) - 1} more" if len(shown) > 1 else ""
        raise InputError(shown[0].file + more, meaning)


def wrong_columns(description: Description, chain: Chain, trials: Sequence[Trial | PostureMeans]) -> Iterator[Verdict]:
    """What `check_columns` finds in the recordings of a dataset: a reason, where a calibration of them is refused."""
    try:
        check_columns(description, chain, [(trial.id, trial) for trial in trials])
    except InputError as error:
        yield Verdict("reading", "refused", str(error))


def _shown(description: Description, file: str, trial: Trial | PostureMeans) -> Shown:
    none = np.zeros(0)
    if isinstance(trial, PostureMeans):
        postures = mean_postures(description, trial)
        postures = postures.rows(of_one_shape(postures.misfit))
        return Shown(file, postures.T_base_hand, none, postures.q, none, postures.components == 6)
    if len(trial.t_robot) < 2 or not len(trial.marker):
        raise NotEnoughData("readings or markers are missing")
    bodies = description.base_body, description.hand_body
    mended = with_right_labels(bodies, trial)
    base, hand = (poses_of(body, mended) for body in bodies)
    return Shown(file, inverse(base.T) @ hand.T, trial.t_mocap, trial.q_motor, trial.t_robot)


def _odd_one(chain: Chain, shown: Sequence[Shown]) -> tuple[str, str] | None:
    """The one file that the frames of all others do not fit, and the verdicts on it."""
    if len(shown) < 2 or not all(x.oriented for x in shown):
        return None
    most = max(_FEWEST, _POSES // len(shown))
    lags = [x.lag(chain, as_declared(chain)) for x in shown]
    pairs = [x.pairs(chain, as_declared(chain), most, lag) for x, lag in zip(shown, lags, strict=True)]
    rest, k, frames = min(_without_each(pairs), default=(np.inf, 0, None), key=lambda left: left[0])
    if frames is None or rest > _ANOTHER or len(pairs[k][0]) < _FEWEST:
        return None
    of_others = [lag for j, lag in enumerate(lags) if j != k and np.isfinite(lag)]
    clocks = (None, float(np.median(of_others)) if of_others else None)  # its own may be as wrong as its columns

    def left_by(reading: Reading) -> float:
        found = (shown[k].pairs(chain, reading, _POSES, lag) for lag in clocks)
        return min((float(distance(frames, A, B).mean()) for A, B in found if len(A) >= _FEWEST), default=MOST)

    off = left_by(as_declared(chain))
    if off < max(_OFF, _ODD * rest):
        return None
    far = f"the hand's markers are {1e3 * off:.0f} mm (mean) from where its readings put them, {1e3 * rest:.0f} mm in"
    far = f"{far} the other files, frames fitted to those"
    left, meaning = min((left_by(r), r.meaning) for r in readings(chain))
    if left < min(_HALF * off, _ANOTHER):
        return shown[k].file, f"{meaning}: {far}, {1e3 * left:.0f} mm otherwise; correct this file's columns"
    if off < _STRANGE:
        return None
    return shown[k].file, (
        f"{far}; no joint reversed and no two swapped explain it: other columns are swapped, or it is another session's"
    )


def _without_each(pairs: Sequence[Pairs]) -> Iterator[tuple[float, int, Frames]]:
    """For each file k the mean distance of the others, k, and the frames X, Y that they give, where they do."""
    for k in range(len(pairs)):
        others = [np.concatenate(x) for x in zip(*(p for j, p in enumerate(pairs) if j != k), strict=True)]
        try:
            frames = hand_eye(others[0], others[1])
        except NotEnoughData:
            continue
        yield float(distance(frames, others[0], others[1]).mean()), k, frames


def _judge(chain: Chain, shown: Sequence[Shown]) -> str | None:
    """The finding about the readings, if any."""
    d = _distances(chain, shown, as_declared(chain))
    if d is None or (off := float(d.mean())) < _OFF:
        return None
    found = [
        (float(d_h.mean()), r.meaning) for r in readings(chain) if (d_h := _distances(chain, shown, r)) is not None
    ]
    left, meaning = min(found, default=(off, ""))
    far = f"the hand's markers are {1e3 * off:.0f} mm (mean) from where the readings put them, frames fitted"
    if left < min(off / _CLEAR, _ANOTHER):
        return f"{meaning}: {far}, {1e3 * left:.0f} mm otherwise; correct the mapping file"
    if float(np.median(d)) > _ANOTHER:
        return (
            f"{far}; no joint reversed and no two swapped explain it: columns of several joints or of markers are "
            "swapped, readings are another session's, or this is another robot's URDF"
        )
    return None


def _distances(chain: Chain, shown: Sequence[Shown], reading: Reading) -> np.ndarray | None:
    """min(|d_i|, 0.5 m) (n,) of all trials; None where they do not identify the constant frames."""
    try:
        pairs = [x.pairs(chain, reading, max(_FEWEST, _POSES // len(shown))) for x in shown]
        A, B = (np.concatenate(x) for x in zip(*pairs, strict=True))
        if len(A) < _ENOUGH:
            raise NotEnoughData(f"{len(A)} samples show base and hand")
        if not all(x.oriented for x in shown):
            return np.minimum(registration_start(A, B, False).residual, MOST)
        return distance(hand_eye(A, B), A, B)
    except NotEnoughData as error:
        _log.info("joints not compared with the hand: %s", error)
        return None
