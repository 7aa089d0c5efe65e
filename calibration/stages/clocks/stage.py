"""Stage `clocks`: each instrument's epoch on the motion-capture clock, from calibration trials.

Robot, first: angular velocity of the hand in the base, turned onto the tool's axes by the rotation that fits best,

    R w_mocap(t)  =  g w(q, dq)(t - lag) + b + sum a_jk J_j d(play_k(q_j) - q_j)/dt + sum c_j w_before_j x J_j

w from the nominal chain at the motor-side readings, J_j the axis of joint j. The play operators keep a gear's backlash,
which lags the link behind the motor by 4 gap / (pi amplitude omega), from passing as a clock error; the last ones
are the zeros of the readings, to first order.
Then from whole poses, where static postures allow: see `clock_refinement`.
Plate: its moments Mx, My, turned where they are mirrored (`plate_axes`), against those of the nominal masses, moved as
markers and encoders say: `inverse_dynamics`.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.time_delay import coarse_lag, fit_lag
from calibration.recording.clock import Clock, shared_clock
from calibration.recording.schema import Description, Tolerances
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.clocks.clock_fit import NOT_SHOWN, TrialLag, allowance, fit_clock
from calibration.stages.clocks.motions import Motion, plate_motions, robot_motions
from calibration.stages.clocks.plate_moments import carriers, plate_axes
from calibration.stages.clocks.pose_refinement import Provisional, provisional, refined
from calibration.verdict import Verdict

_LATE, _FAR = 2e-3, 5.0  # [s] and standard deviations by which a clock declared shared may be off unsaid
_WEAK = 10.0  # usual standard deviations of a trial's lag: beyond, its motion is too small to contradict a clock
_log = logging.getLogger(__name__)


def synchronise(lab: Laboratory, trials: Sequence[Trial]) -> tuple[tuple[Clock, ...], tuple[Verdict, ...]]:
    """Clocks of the instruments recorded in these trials, the robot's first.

    Raises:
        NotEnoughData: There are encoder readings, but their clock cannot be determined from the motion capture's.
    """
    with_robot, with_plate = ([t for t in trials if len(getattr(t, f"t_{name}"))] for name in ("robot", "plate"))
    robot, model, findings = None, None, _missing("robot", "no encoder readings")
    if with_robot:
        robot, model, findings = _robot_clock(lab, with_robot)
    plate, more = None, _missing("plate", "no force plate")
    if with_plate:
        plate, more = _plate_clock(lab, with_plate, robot, model)
    return tuple(c for c in (robot, plate) if c is not None), (*findings, *more)


def _missing(instrument: str, why: str) -> tuple[Verdict, ...]:
    lost = {"robot": "no hand pose to predict or calibrate", "plate": "no plate wrench"}[instrument]
    return (Verdict("clocks", "missing", f"{why}: no {instrument} clock, {lost}"),)


def _robot_clock(lab: Laboratory, trials: Sequence[Trial]) -> tuple[Clock, Provisional | None, tuple[Verdict, ...]]:
    """The robot's clock, and the provisional robot the plate's is determined with."""
    if "robot" not in lab.description.mocap_clock:
        return _estimated_robot_clock(lab, trials)
    findings: tuple[Verdict, ...] = (Verdict("clocks", "ok", "robot: on the motion capture's clock"),)
    try:
        found = _estimated_robot_clock(lab, trials)[0]
    except NotEnoughData:
        return shared_clock("robot"), None, findings
    late = float(found.to_mocap(np.array([found.epoch]))[0]) - found.epoch
    if abs(late) > max(_LATE, _FAR * found.sigma):
        message = (
            f"robot: declared on the motion capture's clock, but its stamps are {-1e3 * late:+.1f} ms late "
            f"(+- {1e3 * found.sigma:.1f}); take robot out of mocap_clock, or mend the stamps"
        )
        findings = (*findings, Verdict("clocks", "warning", message))
    return shared_clock("robot"), None, findings


def _estimated_robot_clock(
    lab: Laboratory, trials: Sequence[Trial]
) -> tuple[Clock, Provisional | None, tuple[Verdict, ...]]:
    chain, description = lab.chain, lab.description
    try:
        robot, verdicts = _clock("robot", robot_motions(description, chain, trials), 1, description.tolerances)
    except NotEnoughData as error:
        raise NotEnoughData(f"{error}; {_shown(description, trials)}") from error
    try:
        model = provisional(chain, description, trials, robot)
        robot, verdicts = concluded("robot", refined(model, description, trials, robot), description.tolerances)
    except NotEnoughData as error:
        warning = Verdict("clocks", "warning", f"robot clock from angular velocity alone: {error}")
        return robot, None, (*verdicts, warning)
    return robot, model, verdicts


def _shown(description: Description, trials: Sequence[Trial]) -> str:
    """What trials that identify no clock of the robot show, or do not."""
    if any(np.isfinite(MeasuredTrial.of(description, trial).T_base_hand).all(axis=(1, 2)).any() for trial in trials):
        return "readings and markers show no common rotation: jitter of the stamps, units, readings of another time?"
    return "base and hand are never seen at once by three markers each"


def _plate_clock(
    lab: Laboratory, trials: Sequence[Trial], robot: Clock | None, model: Provisional | None
) -> tuple[Clock | None, tuple[Verdict, ...]]:
    description = lab.description
    if "plate" in description.mocap_clock:
        return shared_clock("plate"), (Verdict("clocks", "ok", "plate: on the motion capture's clock"),)
    if robot is None:
        return None, _missing("plate", "the plate's clock is determined from encoder readings, and there are none")
    parts = carriers(lab.floating, description, trials)
    motions = plate_motions(parts, description, trials, robot, model)
    Q = plate_axes([m.pair for m in motions])
    try:
        return _clock("plate", [replace(m, pair=m.pair.turned(Q)) for m in motions], 2, description.tolerances)
    except NotEnoughData as error:
        return None, (Verdict("clocks", "missing", f"no plate clock: {error}"),)


def _clock(
    instrument: str, motions: Sequence[Motion], passes: int, known: Tolerances
) -> tuple[Clock, tuple[Verdict, ...]]:
    """The clock from lags of all motions; every pass after the first knows the drift within a trial."""
    drift, lags = 0.0, []
    coarse = side_by_side(lambda m: coarse_lag(m.pair.y, m.pair.x), motions)
    starts = {m.trial_id: lag for m, lag in zip(motions, coarse, strict=True)}
    for _ in range(passes):
        lags = _lags(motions, starts, drift)
        starts = {t.trial_id: t.lag.value for t in lags}
        drift = fit_clock(instrument, lags)[0].drift
    plain = {t.trial_id: t.lag for t in _lags([replace(m, pair=m.pair.plain) for m in motions], starts, drift)}
    return concluded(instrument, [replace(t, plain=plain.get(t.trial_id, NOT_SHOWN)) for t in lags], known)


def concluded(instrument: str, lags: list[TrialLag], known: Tolerances) -> tuple[Clock, tuple[Verdict, ...]]:
    """The clock of these lags, and the verdicts on it: a trial is named whose motion shows that its clock is another.

    Raises:
        NotEnoughData: No trial gave a lag.
    """
    late, common = allowance(instrument, lags, known)
    clock, outliers = fit_clock(instrument, lags, common)
    usual = _WEAK * float(np.median([t.lag.sigma for t in lags if t.trial_id not in outliers]))
    strong = [t for t in lags if t.lag.sigma < usual and t.contradicts(clock.offset, clock.drift)]
    named = [t.trial_id for t in strong if t.trial_id in outliers]
    clock = replace(clock, offset=clock.offset - late)
    message = (
        f"{instrument}: offset {clock.offset:.6f} s, drift {1e6 * clock.drift:.1f} ppm, "
        f"{1e3 * clock.sigma:.3f} ms at its middle, {len(lags) - len(outliers)} trials"
    )
    if len(named) < len(outliers):
        message += f"; {len(outliers) - len(named)} move too little to tell"
    found = [Verdict("clocks", "ok", message)]
    if named:
        message = f"{instrument}: left out, since their clock disagrees with that of the other trials"
        found.append(Verdict("clocks", "warning", f"{message}: {', '.join(named)}"))
    return clock, tuple(found)


def _lags(motions: Sequence[Motion], starts: Mapping[str, float], drift: float) -> list[TrialLag]:
    """Lags of the motions that have a start [s] and show the same on both clocks."""

    def found(motion: Motion) -> TrialLag | None:
        try:
            lag = fit_lag(motion.pair, starts[motion.trial_id], drift)
        except NotEnoughData as error:
            _log.info("%s: %s", motion.trial_id, error)
            return None
        middle = 0.5 * (motion.pair.y.t[0] + motion.pair.y.t[-1])
        return TrialLag(motion.trial_id, middle - lag.value, lag)

    known = [motion for motion in motions if motion.trial_id in starts]
    return [lag for lag in side_by_side(found, known) if lag is not None]
