"""The geometry fitted to link angles: readings corrected by the drive trains, the column's bending taken off.

    r = log6( (Q(n)^-1 T_measured)^-1 T_B_H(q_link, theta) )            Q  motion of what the column carries

Static postures of all calibration trials, and some a second of those in which the arm moves, in one problem of the
existing solver: base and hand frames, placements and zeros; joints' own random errors, as the evidence has them.
q_link is what a joint's link encoder reads less the errors found with its drive train, as uncertain as what is left
where the side of the mesh is certain; of other joints it is what the drive train predicts, with its interval. Such
variance widens a posture's covariance along the joint.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import NotEnoughData
from calibration.inference.parameters import Model
from calibration.mocap.postures import Postures, dwell_windows, passing_postures, static_postures
from calibration.numerics.lie import inverse
from calibration.numerics.side_by_side import side_by_side
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.chain import Chain
from calibration.robot.hand import HandModel
from calibration.robot.nominal_frames import nominal_frames
from calibration.stages.drive_trains.column_bending import ColumnBending, column_bending, leaning, moved
from calibration.stages.drive_trains.corrected_trial import (
    CorrectedTrial,
    by_loads,
    have_link_encoders,
    moments,
    seen_by_links,
)
from calibration.stages.drive_trains.drive_train import HARMONICS, DriveTrain
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.stage import AS_SEEN, Moved, loads_of_trial
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
class RefittedGeometry:
    """The geometry of row `full`, the column that bends, and the drive trains with the zeros that go with them.

    Attributes:
        model: Parameters of the geometry.
        bending: Of the column.
        trains: The drive trains; `dynamics.offset` are the new zeros.
        shown: Effects that the residuals show and the model leaves out, as messages.
    """

    model: Model
    bending: ColumnBending
    trains: DriveTrains
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
        lambda t: by_loads(trains, t, loads.get(t.id) or loads_of_trial(trains, t, robot, hand, moved.get(t.id))),
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
        have_link_encoders(trains)[chain.columns],
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
    return RefittedGeometry(model, bending, replace(trains, trains=joints).with_offset(offset), departed.shown)


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
    Q = moved(hand, bending, postures.q, moments(one, robot, t))
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
