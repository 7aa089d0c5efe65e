"""Stage `drive_trains`: the drive train of every joint that has a link encoder, from the calibration trials.

Data: motor minus link reading of all calibration trials. Inputs: motor encoders, the base's markers, the geometry's
zeros, the nominal robot with each trial's payload. Choices are made by trials left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from calibration.checks.joint_readings import wrong_links
from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import from_vector, inverse
from calibration.numerics.side_by_side import side_by_side
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.hand import HandModel
from calibration.stages.drive_trains.column_bending import column_bending
from calibration.stages.drive_trains.drive_train import DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.fit.identification import identify
from calibration.stages.drive_trains.fit.joint_data import COARSE, ON_BASE, RELAXATION, WINDOW, joint_data
from calibration.stages.drive_trains.fit.steady_contact import Slip, slipped_encoder
from calibration.stages.drive_trains.hung_load import DEPARTS, HungLoad, hung_load
from calibration.stages.drive_trains.torques import (
    UNWEIGHED,
    Column,
    LinkLoads,
    dynamics,
    load_modes,
)
from calibration.stages.joints.samples import link_zeros
from calibration.verdict import Verdict


class MovedBase(NamedTuple):
    """How the base moved in a trial.

    Attributes:
        T_lab_B: (n, 4, 4) its marker body at the mocap times.
        by_plate: Whether a plate's wrench predicted it, see `base_motion`.
    """

    T_lab_B: np.ndarray
    by_plate: bool


Moved = Mapping[str, MovedBase]
"""By the trial's id."""
AS_SEEN: Moved = {}
STAGE = "drive_trains"
DEFLECTION = 1e-2  # [rad] of a drive at its largest torque, prior
_SHORTEST = 1.5  # [s] of a trial
_TAIL = 0.02  # share of the readings beyond either end of what links do behind their motors: false ones


def fit_drive_trains(  # noqa: PLR0913
    urdf: str,
    description: Description,
    trials: Sequence[Trial],
    robot: Clock,
    hand: HandModel,
    moved: Moved = AS_SEEN,
    mass_covariance: np.ndarray = UNWEIGHED,
) -> tuple[DriveTrains, tuple[Verdict, ...], dict[str, LinkLoads]]:
    """The drive trains, the verdicts on them and the loads in the trials used; of joints without link encoders, none.

    Args:
        urdf: The robot with the joint placements of that geometry.
        description: Of the dataset.
        trials: Calibration trials.
        robot: The robot's clock.
        hand: The calibrated geometry: zeros of the readings, and where the base's markers are.
        moved: How the base moved in trials in which that is not taken from its markers.
        mass_covariance: As of `DriveTrains`.
    """
    offset = motor_zeros(hand)
    ends = _ends(trials, len(offset))
    weighed = hung_load(urdf, description, offset, [_by_links(trial, ends.mean(axis=0)) for trial in trials])
    hung, unlikely = (None, (_unlikely(weighed),)) if weighed and weighed.departs > DEPARTS else (weighed, ())
    bare = DriveTrains(dynamics(urdf, description, offset, hung), (), urdf, description, hung, mass_covariance)
    bare = _on_column(bare, trials, robot, hand, moved)
    try:
        zero = link_zeros(trials, robot)
    except NotEnoughData as error:
        return bare, (*unlikely, Verdict(STAGE, "missing", str(error))), {}
    refused = tuple(wrong_links(bare.joints, trials, zero))
    if refused:
        return bare, tuple(Verdict(STAGE, v.verdict, v.message) for v in refused), {}
    used = [trial for trial in trials if is_long(trial)]
    loads = side_by_side(lambda trial: loads_of_trial(bare, trial, robot, hand, moved.get(trial.id)), used)
    differences = [(trial.q_motor - trial.q_link)[_complete(trial)] for trial in used]
    behind = [of.behind(_behind(of.t, d, ends)) for of, d in zip(loads, differences, strict=True)]
    tried = _identified(bare, behind, differences, hand)
    trains = tuple(train for train in tried.values() if isinstance(train, DriveTrain))
    slips = tuple(_slipped(joint, slip) for joint, slip in tried.items() if isinstance(slip, Slip))
    found = replace(bare, trains=trains)
    return found, (*unlikely, *slips, *_verdicts(found, hand)), {one.trial_id: one for one in loads}


def _on_column(
    trains: DriveTrains, trials: Sequence[Trial], robot: Clock, hand: HandModel, moved: Moved
) -> DriveTrains:
    """The same on the column that postures show to bend; the geometry has it as it leans under their mean moment."""
    still = [trial for trial in trials if len(trial.dwell_start) and is_long(trial)]
    loads = side_by_side(lambda trial: loads_of_trial(trains, trial, robot, hand, moved.get(trial.id)), still)
    bending = column_bending(trains.description, still, loads, robot, hand)
    return trains.built(trains.urdf, Column(bending.compliance, bending.mean))


def loads_of_trial(
    trains: DriveTrains, trial: Trial, robot: Clock, hand: HandModel, moved: MovedBase | None = None
) -> LinkLoads:
    """Loads in a trial with its payload on a base that moved so; where not given, as its markers are seen.

    Without them, or where they are not in the lab, the base is level and at rest.
    """
    rows, base, description = _complete(trial), None, trains.description
    t = trial.t_robot[rows]
    if moved is None:
        with suppress(NotEnoughData):
            moved = MovedBase(MeasuredTrial.of(description, trial).base.T, by_plate=False)
    if moved is not None and description.marker_frame == "lab":
        T_lab_base = moved.T_lab_B @ inverse(from_vector(hand.base))
        base = trains.base_motion(trial.t_mocap, T_lab_base, robot.to_mocap(t), moved.by_plate)
    own, q = trains.of_trial(trial.id), trial.q_motor[rows]
    return own.loads(trial.id, t, q, base, trial.wrist_wrench[rows])


def relaxation(hand: HandModel, joint: str) -> float:
    """How long the contact of a joint relaxes [s]: the first revolute joint turns the base as its link strikes."""
    first = next(name for name in hand.chain.joints if not hand.chain.is_prismatic(name))
    return ON_BASE if joint == first else RELAXATION


def motor_zeros(hand: HandModel) -> np.ndarray:
    """(k,) of the measured joints' readings [rad, m]; 0 of joints that are not on the way to the hand."""
    offset = np.zeros(len(hand.chain.measured))
    offset[hand.chain.columns] = hand.offset
    return offset


def _ends(trials: Sequence[Trial], k: int) -> np.ndarray:
    """Motor less link reading (2, k) at either end of what links do behind their motors; NaN without an encoder."""
    found = np.concatenate([np.zeros((0, k)), *(trial.q_motor - trial.q_link for trial in trials)])
    seen, ends = np.isfinite(found).any(axis=0), np.full((2, k), np.nan)
    if seen.any():
        ends[:, seen] = np.nanquantile(found[:, seen], [_TAIL, 1.0 - _TAIL], axis=0)
    return ends


def _behind(t: np.ndarray, difference: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """How far links are behind their motors (n, k) [rad] at t (n,), by motor less link readings; 0 without an encoder.

    A false reading moves it no farther from the middle than twice as far as either of `ends` (2, k); a hole in the
    readings is bridged.
    """
    width = ends[1] - ends[0]
    delta = np.clip(difference - ends.mean(axis=0), -width, width)
    for column in delta.T:
        rows = np.isfinite(column)
        column[:] = np.interp(t, t[rows], column[rows]) if rows.any() else 0.0
    return delta


def _by_links(trial: Trial, middle: np.ndarray) -> Trial:
    """The trial with what link encoders read, on the motors' zeros, in the place of motor readings."""
    read = trial.q_link + middle
    return replace(trial, q_motor=np.where(np.isfinite(read), read, trial.q_motor))


def _complete(trial: Trial) -> np.ndarray:
    return np.flatnonzero(np.isfinite(trial.q_motor).all(axis=1))


def is_long(trial: Trial) -> bool:
    """Whether a trial has readings enough to derive velocities and accelerations from."""
    rows = _complete(trial)
    return len(rows) > 3 and bool(trial.t_robot[rows[-1]] - trial.t_robot[rows[0]] > _SHORTEST)


def _identified(
    bare: DriveTrains, loads: Sequence[LinkLoads], differences: Sequence[np.ndarray], hand: HandModel
) -> dict[str, DriveTrain | Slip]:
    tolerances = bare.description.tolerances
    C = bare.inertial_tolerances
    root = np.linalg.cholesky(C + 1e-12 * np.eye(len(C)))

    def found(joint: str) -> DriveTrain | Slip | None:
        j = bare.joints.index(joint)
        has = [k for k, y in enumerate(differences) if np.isfinite(y[:, j]).any()]
        if not has or hand.chain.is_prismatic(joint):
            return None
        own, seen = [loads[k] for k in has], [differences[k] for k in has]
        modes = load_modes(own, j, root)
        relaxes = relaxation(hand, joint)
        data, coarse = (joint_data(own, seen, j, modes, window, relaxes) for window in (WINDOW, COARSE))
        offset = float(bare.dynamics.offset[j])
        train, fit = identify(joint, data, coarse, modes, tolerances.joint_play, DEFLECTION, offset)
        return slipped_encoder(fit) or train

    joints = hand.chain.joints
    return {joint: x for joint, x in zip(joints, side_by_side(found, joints), strict=True) if x is not None}


def _unlikely(weighed: HungLoad) -> Verdict:
    message = (
        f"the wrist's sensor carries {weighed.links[0]:+.3f} kg beside nominal links and declared payload, more than "
        "their tolerances let expect: not used; declare what is in the hand, or check the sensor's units and gain"
    )
    return Verdict(STAGE, "warning", message)


def _slipped(joint: str, slip: Slip) -> Verdict:
    message = (
        f"link encoder of {joint} slips by {1e3 * slip.size:.1f} mrad before {slip.t:.1f} s of {slip.trial_id}; it is "
        "not used: fasten it and record again, or leave out the trials on one side"
    )
    return Verdict(STAGE, "warning", message)


def _verdicts(found: DriveTrains, hand: HandModel) -> Iterator[Verdict]:
    if found.trains:
        summary = "; ".join(
            f"{t.joint} {t.form.replace('_', ' ')}, backlash {1e3 * t.gap:.2f} mrad, error {1e3 * t.residual:.2f}"
            for t in found.trains
        )
        yield Verdict(STAGE, "ok", f"{summary} mrad rms in trials left out, where the side of the mesh is certain")
    without = [
        j for j in hand.chain.joints if j not in [t.joint for t in found.trains] and not hand.chain.is_prismatic(j)
    ]
    if without:
        yield Verdict(STAGE, "missing", f"no link encoder to see the drive train by: {', '.join(without)}")
    yield from unidentified(found.trains)


def unidentified(trains: Sequence[DriveTrain]) -> Iterator[Verdict]:
    """A warning for each joint some of whose parameters are not identifiable, with the motions that would show them."""
    for train in trains:
        open_ = [q for q in train.parameters if q.status != "estimated" and ".motor." not in q.name]
        if open_:
            names = ", ".join(q.name for q in open_)
            motions = "; ".join(sorted({q.remedy for q in open_}))
            yield Verdict(STAGE, "warning", f"not identifiable: {names}; {motions}")
