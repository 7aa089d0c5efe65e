"""The geometry fitted to link angles: readings corrected by the drive trains, the column's bending taken off.

    r = log6( (Q(n)^-1 T_measured)^-1 T_B_H(q_link, theta) )            Q  motion of what the column carries

Static postures of all calibration trials, and some a second of those in which the arm moves, in one problem of the
existing solver: base and hand frames, placements and zeros; joints' own random errors, as the evidence has them.
q_link is what a joint's link encoder reads less the errors found with its drive train, as uncertain as what is left
where the side of the mesh is certain; of other joints it is what the drive train predicts, with its interval. Such
variance widens a posture's covariance along the joint. How far predictions of drive trains are off at rest:

    s_j = max(rms e, q_95(|e|) / 1.96),     e = q_predicted - q_link over dwells       of joint j [rad]

Links stop elsewhere in their gaps in few dwells: 1.96 rms hold too few. 95 % of other dwells are below the quantile.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.mocap.postures import Postures, dwell_windows, passing_postures, readings_at, static_postures
from calibration.numerics.lie import inverse
from calibration.numerics.robust_covariance import covering_sigma
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import interpolate_columns
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.drive_trains.column_bending import ColumnBending, bent, column_bending, leaning, moved
from calibration.stages.drive_trains.drive_train import HARMONICS, DriveTrain, harmonic_terms
from calibration.stages.drive_trains.drive_trains import DriveTrains, LinkAngles
from calibration.stages.drive_trains.stage import AS_SEEN, Moved, MovedBase, loads_of_trial
from calibration.stages.drive_trains.torques import LinkLoads
from calibration.stages.geometry.departures import TakenForKnown, shown_by, with_departures, with_gears
from calibration.stages.geometry.hand_residual import NoiseModel
from calibration.stages.geometry.model_of_fit import hand_of, model_of
from calibration.stages.geometry.parameters import geometry_parameters, hand_model, reading_floor, reading_sigma
from calibration.stages.geometry.stage import fit_robustly

NOTHING: Mapping[str, LinkLoads] = {}
_SPACING = 0.5  # [s] between postures of a motion
_READING = 0.05  # of the datasheet's backlash: random error of a corrected reading to begin with
_HAND = np.array([2e-4, 4e-4])  # random errors of the hand's position [m] and rotation [rad] to begin with
_MOVES = 0.05  # [rad, m] of any joint: a trial in which the arm moves


@dataclass(frozen=True)
class CorrectedTrial:
    """A trial with its readings corrected.

    Attributes:
        trial: The recording; `q_motor` are link angles, NaN where a reading was.
        loads: That corrected them.
        angles: The link angles with their intervals, at the loads' times.
    """

    trial: Trial
    loads: LinkLoads
    angles: LinkAngles


@dataclass(frozen=True)
class RefittedGeometry:
    """The geometry of row `full`, the column that bends, and the drive trains with the zeros that go with them.

    Attributes:
        model: Parameters of the geometry.
        bending: Of the column.
        trains: The drive trains; `dynamics.offset` are the new zeros.
        at_rest: (m,) s_j of each train's angle in dwells, by link encoders [rad]; 0 where not known.
        shown: Effects that the residuals show and the model leaves out, as messages.
    """

    model: Model
    bending: ColumnBending
    trains: DriveTrains
    at_rest: np.ndarray
    shown: tuple[str, ...] = ()

    def hand(self, chain: Chain) -> HandModel:
        """The robot with this geometry."""
        return hand_of(self.model, chain, nominal_frames(chain, self.trains.description))


def refit_geometry(
    chain: Chain,
    trials: Sequence[Trial],
    robot: Clock,
    hand: HandModel,
    trains: DriveTrains,
    loads: Mapping[str, LinkLoads] = NOTHING,
    moved: Moved = AS_SEEN,
) -> RefittedGeometry:
    """The geometry on link angles of the calibration trials.

    Args:
        chain: The arm.
        trials: Calibration trials.
        robot: The robot's clock.
        hand: Geometry that the drive trains were fitted with.
        trains: The drive trains.
        loads: By the same geometry, of trials whose loads are known.
        moved: As of `fit_drive_trains`.

    Raises:
        NotEnoughData: The trials show no posture and no motion.
    """
    description = trains.description
    corrected = side_by_side(
        lambda t: _by_loads(trains, t, loads.get(t.id) or loads_of_trial(trains, t, robot, hand, moved.get(t.id))),
        trials,
    )
    bending = column_bending(description, trials, [c.loads for c in corrected], robot, hand)
    seen = [seen_by_links(trains, one) for one in corrected]
    parts = list(_postures(description, seen, robot, hand, bending))
    if not parts:
        raise NotEnoughData("no calibration trial has a posture or a motion of the arm to fit the geometry to")
    postures = parts[0]
    for part in parts[1:]:
        postures = postures.joined(part)
    parameters = geometry_parameters(chain, description)
    driven = np.isin(chain.joints, [train.joint for train in trains.trains])
    floor, play = reading_floor(chain, description), reading_sigma(chain, description) * np.where(driven, _READING, 1.0)
    errors = NoiseModel(np.maximum(play, floor), floor, _HAND[: postures.components // 3])
    robot_hand = hand_model(chain, nominal_frames(chain, description))
    found = fit_robustly(robot_hand, parameters, postures, errors)
    used = postures.rows(found.kept)
    known = TakenForKnown(
        _sigma(trains, chain, "gear.{}.compliance"),
        0.5 * _sigma(trains, chain, "backlash.{}.gap"),
        _known(bending.sigma),
        leaning(bending, chain, description),
        _have_link_encoders(trains)[chain.columns],
    )
    geared = with_gears(robot_hand, parameters, found.fit, used, known)
    departed = with_departures(robot_hand, parameters, geared, used)
    tests = shown_by(robot_hand, parameters, found.fit, used)
    model = model_of("full", chain, parameters, departed.fit)
    model = replace(model, random=found.fit.covariance, absorption=departed.absorbed, tests=tests)
    fitted = hand_of(model, chain, nominal_frames(chain, description))
    offset = np.array(trains.dynamics.offset)
    offset[chain.columns] = fitted.offset
    joints = tuple(referred(train, model, trains) for train in trains.trains)
    trains = replace(trains, trains=joints).with_offset(offset)
    resting = [trial for trial in trials if len(trial.dwell_start)]
    static = side_by_side(lambda t: corrected_trial(trains, t, robot, fitted, moved.get(t.id)), resting)
    return RefittedGeometry(model, bending, trains, rest_errors(trains, static, robot), departed.shown)


def _known(sigma: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(sigma), sigma, 0.0)


def _sigma(trains: DriveTrains, chain: Chain, name: str) -> np.ndarray:
    """(k,) standard deviations of what has that name, {} each joint of the chain; 0 where there is none."""
    sigma = {q.name: q.sigma for q in trains.parameters}
    return _known(np.array([sigma.get(name.format(joint), 0.0) for joint in chain.joints]))


def referred(train: DriveTrain, geometry: Model, trains: DriveTrains) -> DriveTrain:
    """The drive train with its link encoder's offset beside the geometry's zero of the motor, and as uncertain.

    So is the phase of its eccentricity: e(theta + d) = (cos1 + d sin1) cos + (sin1 - d cos1) sin + the same of 2 theta
    """
    own, name = {p.name: p for p in geometry.parameters}, f"encoder.{train.joint}.link."
    motor = own.get(f"encoder.{train.joint}.motor.offset")
    if motor is None:
        return train
    moved = motor.value - float(trains.dynamics.offset[trains.joints.index(train.joint)])
    slope = np.append(1.0, train.link[[2, 1, 4, 3]] * (1.0, 1.0, 2.0, 2.0))
    names = [name + what for what in ("offset", *HARMONICS)]
    off = dict(zip(names, motor.sigma * slope, strict=True))
    parameters = tuple(replace(q, sigma=float(np.hypot(q.sigma, off.get(q.name, 0.0)))) for q in train.parameters)
    parameters = tuple(replace(q, value=q.value + moved) if q.name == names[0] else q for q in parameters)
    return replace(train, link=train.link + np.array([moved, 0.0, 0.0, 0.0, 0.0]), parameters=parameters)


def corrected_trial(
    trains: DriveTrains, trial: Trial, robot: Clock, hand: HandModel, moved: MovedBase | None = None
) -> CorrectedTrial:
    """A trial with link angles in place of its motor readings; the base as of `loads_of_trial`."""
    return _by_loads(trains, trial, loads_of_trial(trains, trial, robot, hand, moved))


def _by_loads(trains: DriveTrains, trial: Trial, loads: LinkLoads) -> CorrectedTrial:
    angles = trains.of_loads(loads)
    q = np.full(trial.q_motor.shape, np.nan)
    q[np.isfinite(trial.q_motor).all(axis=1)] = angles.q
    return CorrectedTrial(MeasuredTrial.of(trains.description, trial).with_readings(q), loads, angles)


def by_link_encoders(trains: DriveTrains, corrected: CorrectedTrial) -> CorrectedTrial:
    """The trial with link angles read by the link encoders where they have one and were identified.

    q = q_link + offset - offset_l - e_l(theta)            offset the zero of the motor's readings
    """
    rows, q = np.isfinite(corrected.trial.q_link), corrected.trial.q_motor.copy()
    known = np.isfinite(q).all(axis=1)
    for train in (train for train in trains.trains if np.isfinite(train.link).all()):
        j = trains.joints.index(train.joint)
        read = known & rows[:, j]
        angle = corrected.trial.q_link[read, j] - train.link[0]
        q[read, j] = angle + trains.dynamics.offset[j] - harmonic_terms(angle) @ train.link[1:]
    return replace(corrected, trial=replace(corrected.trial, q_motor=q))


def seen_by_links(trains: DriveTrains, corrected: CorrectedTrial) -> CorrectedTrial:
    """The trial by its link encoders, as uncertain as what is left where the side of the mesh is certain."""
    one = by_link_encoders(trains, corrected)
    least = trains.by_joint(np.array([train.residual**2 for train in trains.trains]))
    rows = np.isfinite(one.trial.q_motor).all(axis=1)
    read = _have_link_encoders(trains) & np.isfinite(one.trial.q_link[rows])
    return replace(one, angles=one.angles._replace(variance=np.where(read, least, one.angles.variance)))


def _have_link_encoders(trains: DriveTrains) -> np.ndarray:
    """Of which joints (n_joints,) the link encoders' errors were identified."""
    return trains.by_joint(np.array([float(np.isfinite(train.link).all()) for train in trains.trains])) > 0.0


def rest_errors(trains: DriveTrains, corrected: Sequence[CorrectedTrial], robot: Clock) -> np.ndarray:
    """(m,) s_j of each drive train's angle less its link encoder's [rad]; 0 without one."""
    found = [np.zeros((0, len(trains.trains)))]
    columns = [trains.joints.index(train.joint) for train in trains.trains]
    for one in (one for one in corrected if len(one.trial.dwell_start)):
        t, q = one.trial.t_robot, one.trial.q_motor - by_link_encoders(trains, one).trial.q_motor
        for start, stop in robot.from_mocap(dwell_windows(one.trial)):
            dwell = q[(t >= start) & (t <= stop)][:, columns]
            dwell = dwell[np.isfinite(dwell).all(axis=1)]
            found.append(dwell[:1] if len(dwell) == 0 else dwell.mean(axis=0, keepdims=True))
    return covering_sigma(np.concatenate(found))


def hand_poses(hand: HandModel, bending: ColumnBending, corrected: CorrectedTrial, robot: Clock) -> np.ndarray:
    """T_B_H (n, 4, 4) at the trial's mocap times, NaN where it has no readings."""
    trial = corrected.trial
    q = readings_at(trial, robot, trial.t_mocap, trial.q_motor)
    moment = _at(corrected, robot, trial.t_mocap)
    known = np.isfinite(q).all(axis=1)
    T = np.full((len(q), 4, 4), np.nan)
    T[known] = bent(hand, bending, q[known], moment[known])
    return T


def _at(corrected: CorrectedTrial, robot: Clock, t: np.ndarray) -> np.ndarray:
    """Moments (n, 2) of the column at mocap times (n,)."""
    return interpolate_columns(robot.from_mocap(t), corrected.loads.t, corrected.loads.moment)


def _postures(
    description: Description,
    corrected: Sequence[CorrectedTrial],
    robot: Clock,
    hand: HandModel,
    bending: ColumnBending,
) -> Iterator[Postures]:
    """Static postures, then those passed."""
    for k, one in enumerate(corrected):
        if len(one.trial.dwell_start):
            found = static_postures(description, [one.trial], robot, hand.chain.poses)
            yield _widened(one, found, robot, hand, bending)
        elif np.ptp(one.loads.q, axis=0).max() > _MOVES:
            found = passing_postures(description, [one.trial], robot, _SPACING)
            yield _widened(one, replace(found, motion=np.full(len(found), k)), robot, hand, bending)


def _widened(
    one: CorrectedTrial, postures: Postures, robot: Clock, hand: HandModel, bending: ColumnBending
) -> Postures:
    """Postures with bending taken off and covariances widened by what joints' angles are uncertain by."""
    t = _times(one, postures)
    s = robot.from_mocap(t)
    k = np.clip(np.searchsorted(one.loads.t, s), 0, len(one.loads.t) - 1)
    variance = one.angles.variance[k]
    Q = moved(hand, bending, postures.q, _at(one, robot, t))
    J = hand.joint_jacobians(postures.q)
    along = J * variance[:, None, hand.chain.columns]
    wide = along @ np.swapaxes(J, 1, 2)
    n = postures.components
    return replace(
        postures, T_base_hand=inverse(Q) @ postures.T_base_hand, covariance=postures.covariance + wide[:, :n, :n]
    )


def _times(one: CorrectedTrial, postures: Postures) -> np.ndarray:
    """Mocap times (n,) of postures, by their labels."""
    if len(one.trial.dwell_start):
        middle = dwell_windows(one.trial).mean(axis=1)
        return np.array([middle[int(str(name).rsplit(" ", 1)[1])] for name in postures.label])
    after = [float(str(name).rsplit(" at ", 1)[1].split(" ")[0]) for name in postures.label]
    return one.trial.t_mocap[0] + np.array(after)
