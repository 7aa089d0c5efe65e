"""Where the base's markers are in a trial, predicted: its first second and a wrench, nothing else.

T_lab_B(t) = T_lab_0 exp(x(t)) T_0_B,     covariance of x: diag V(t), in frame 0
use_i = |K_i e_i + (N_i - m_i G) (-ry, rx)| / (mu_i N_i), the share of its friction that wheel i needs: 1, it slides
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import from_vector, inverse, to_vector
from calibration.numerics.signals import RATE, Signal, even, interpolate_columns, low_passed
from calibration.recording.clock import Clock
from calibration.recording.trial import Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.drive_trains.corrected_trial import shown_by_links
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.drive_trains.kernel.link_motion import RELAXATION
from calibration.stages.drive_trains.kernel.link_streams import Q, V
from calibration.stages.drive_trains.stage import AS_SEEN, Moved
from calibration.stages.drive_trains.torques import LinkLoads
from calibration.stages.stick_slip.forcing import (
    CUTOFF,
    STEP,
    STEPS,
    PlanarForcing,
    Readings,
    Wrenches,
    planar_forcing,
    readings_of,
    wrenches_of,
)
from calibration.stages.stick_slip.kernel.bases import HEAVE, LOAD, PLANE, Bases
from calibration.stages.stick_slip.kernel.integration import advance
from calibration.stages.stick_slip.kernel.together import Carried, walked
from calibration.stages.stick_slip.kernel.wheel_forces import deflect_at_rest
from calibration.stages.stick_slip.likelihood import bases_of
from calibration.stages.stick_slip.model import Direction, StickSlip
from calibration.stages.stick_slip.standing import Read
from calibration.stages.suspension.base_response import WrenchSources
from calibration.stages.suspension.floor_wrench import Load, elsewhere, motion_load, root_in_base
from calibration.stages.suspension.model import Source
from calibration.stages.suspension.rest_frame import Rest, rest_of

_YIELDS = 6e-3  # [s] the most that contacts take to relax on a base that yields as links strike


@dataclass(frozen=True)
class SlippingMotion:
    """The base at `t_mocap` of a trial, m wheels; outside the wrench's recording it stays.

    Attributes:
        x: (n, 6) displacement [m, rad, frame 0].
        variance: (n, 6) of it.
        moment: (n,) change of Mz on the floor [N.m].
        use: (n, m) of the friction of each wheel [-].
        wheels: Their names.
    """

    x: np.ndarray
    variance: np.ndarray
    moment: np.ndarray
    use: np.ndarray
    wheels: tuple[str, ...]

    @property
    def predictable(self) -> bool:
        """Whether yaw, which moves the hand most, is predicted to move by more than its standard deviation."""
        return bool(self.variance[:, 5].sum() <= (self.x[:, 5] ** 2).sum())


@dataclass(frozen=True)
class BasePrediction:
    """The base's marker body T_lab_B (n, 4, 4), and how it moved."""

    T_lab_B: np.ndarray
    motion: SlippingMotion


def slipping_base_poses(
    model: StickSlip, sources: WrenchSources, trial: Trial, source: Source, trains: DriveTrains | None = None
) -> BasePrediction:
    """The base in a trial; by inverse dynamics of the links behind the motors where drive trains are known.

    Raises:
        NotEnoughData: The wrench, or the base's markers of the first second, were not recorded.
        NoSuchElement: The model was not fitted from that source.
    """
    rest = rest_of(sources.lab.description, trial, sources.T_base_B)
    read = Read(
        MeasuredTrial.of(sources.lab.description, trial), rest, wrenches_of(sources, trial, rest.T_lab_0, trains)
    )
    forcing = driven(model, sources, read, source, trains)
    moment = forcing.force[:, 2:]
    found = (*model.displacement(forcing), moment, friction_use(model, forcing))
    x, variance, moment, use = (interpolate_columns(trial.t_mocap, forcing.t, columns) for columns in found)
    motion = SlippingMotion(x, variance, moment[:, 0], use, model.wheels.names)
    return BasePrediction(rest.poses(x), motion)


def driven(
    model: StickSlip, sources: WrenchSources, read: Read, source: Source, trains: DriveTrains | None
) -> PlanarForcing:
    """What drives the base in a trial, by its wrenches and motors alone: not as markers show that it slid.

    Raises:
        NotEnoughData: The wrench was not recorded.
        NoSuchElement: The model was not fitted from that source.
    """
    links, trial = None, read.trial
    if trains is not None and sources.robot is not None and len(trial.t_robot):
        links = links_of(sources.lab, trains, sources.robot, trial, read.rest.T_lab_0)
    return forced(model, replace(read.wrenches, links=None, slid=None), source, links)


class Links(NamedTuple):
    """The links behind motor readings.

    Attributes:
        lab: The robot with the payload in its hand.
        trains: Its drive trains with the same.
        readings: Of its motors.
        T_lab_0: (4, 4) frame 0.
        wrist: (n, 6) readings of the wrist's sensor; None without.
    """

    lab: Laboratory
    trains: DriveTrains
    readings: Readings
    T_lab_0: np.ndarray
    wrist: np.ndarray | None = None

    def loads(self, t: np.ndarray, T_lab_base: np.ndarray) -> LinkLoads:
        """What moves them on a base that moves as T_lab_base (m, 4, 4) at t (m,), NaN where not known."""
        at, q, _ = self.readings
        return self.trains.loads("", at, q, self.trains.base_motion(t, T_lab_base, at), self.wrist)

    def load(self, t: np.ndarray, T_lab_base: np.ndarray, links: np.ndarray | None = None) -> Load:
        """Their inverse dynamics on such a base, at likely positions where others, as of `swaying`, are not given.

        The wrist's sensor leans with the base, and the hand weighs downwards: the hand is that of a base upright.
        """
        at, in_plane, floor = self.readings.t, upright(T_lab_base, self.T_lab_0), None
        q = self.trains.swaying(self.loads(t, T_lab_base)) if links is None else links
        if self.wrist is not None:
            moving = self.trains.base_motion(t, self.T_lab_0 @ from_vector(in_plane), at)
            floor = self.trains.hand(at, q, self.wrist, moving)
        twist = planar_twist(t, in_plane[:, PLANE], at)
        return motion_load(self.lab, at, self.trains.angles(q), self.T_lab_0, CUTOFF, floor, twist)


def links_of(lab: Laboratory, trains: DriveTrains, robot: Clock, trial: Trial, T_lab_0: np.ndarray) -> Links:
    """The links in a whole trial with its payload, and what else loads the hand."""
    lab, trains = lab.of_trial(trial.id), trains.of_trial(trial.id)
    t, q, wrench = readings_of(robot, trial)
    return Links(lab, trains, Readings(t, q), T_lab_0, wrench)


class Arm(NamedTuple):
    """An arm on a base of calibration trials.

    Attributes:
        trains: Its drive trains.
        moved: How the base moved in trials in which that is not taken from its markers.
    """

    trains: DriveTrains
    moved: Moved = AS_SEEN


def moving_links(lab: Laboratory, arm: Arm, robot: Clock, trial: MeasuredTrial, rest: Rest) -> Load:
    """Inverse dynamics of links as their encoders show them; else on the base as it is predicted, or by its markers."""
    links, moved = links_of(lab, arm.trains, robot, trial, rest.T_lab_0), arm.moved.get(trial.id)
    T_lab_base = (trial.base.T if moved is None else moved.T_lab_B) @ inverse(rest.T_0_B)
    angles = links.trains.swaying(links.loads(trial.t_mocap, T_lab_base))
    read = trial.q_link[np.isfinite(trial.q_motor).all(axis=1)]
    return links.load(trial.t_mocap, T_lab_base, shown_by_links(links.trains, read, angles))


def upright(T_lab_base: np.ndarray, T_lab_0: np.ndarray) -> np.ndarray:
    """x, y, 0, 0, 0, yaw (m, 6) [m, rad, frame 0] of poses (m, 4, 4)."""
    x = to_vector(inverse(T_lab_0) @ T_lab_base)
    x[:, HEAVE] *= 0.0  # NaN where not known
    return x


def planar_twist(t: np.ndarray, seen: np.ndarray, at: np.ndarray) -> np.ndarray | None:
    """Twist (n, 6) [m/s, rad/s, base frame] in the floor's plane at times `at` (n,), of x, y, yaw (m, 3) at t (m,)."""
    try:
        plane = even(t, seen)
    except NotEnoughData:
        return None
    x = low_passed(plane, CUTOFF).x
    v, c, s = np.gradient(x, 1.0 / RATE, axis=0), np.cos(x[:, 2]), np.sin(x[:, 2])
    twist = np.zeros((len(v), 6))
    twist[:, 0], twist[:, 1], twist[:, 5] = c * v[:, 0] + s * v[:, 1], c * v[:, 1] - s * v[:, 0], v[:, 2]
    return interpolate_columns(at, plane.t, twist)


def forced(model: StickSlip, wrenches: Wrenches, source: Source, links: Links | None) -> PlanarForcing:
    """What drives the base; inverse dynamics are of the links, on a base that moves.

    By a plate that is the base of a first prediction, and moments are about where that has slid to. By inverse dynamics
    a base that slips is moved together with the links.

    Raises:
        NotEnoughData: The wrench was not recorded.
        NoSuchElement: The model was not fitted from that source.
    """
    found, links = model.direction(source), links if links is not None and links.trains.trains else None
    slips = found.slips
    if source == "dynamics" and slips.any():
        return _forced_together(model, found, wrenches, links)
    forcing = planar_forcing(wrenches, model.tilting, source, found.by_plate)
    if links is None and not slips.any():
        return forcing
    x, _ = model.displacement(forcing)
    if links is not None:
        wrenches = replace(wrenches, links=links.load(forcing.t, links.T_lab_0 @ from_vector(x)))
    if slips.any():
        far = np.where(slips, x[:, PLANE] - forcing.linear, 0.0)
        wrenches = replace(wrenches, slid=Signal(forcing.t, far, np.ones(len(far), dtype=bool)))
    return planar_forcing(wrenches, model.tilting, source, found.by_plate)


def _forced_together(model: StickSlip, found: Direction, wrenches: Wrenches, links: Links | None) -> PlanarForcing:
    """Inverse dynamics on a base that slips, and of links that are moved together with it."""
    bases = bases_of(model.wheels, found.logarithms[None], corrected=False)
    wrenches = replace(wrenches, slips=bases)
    forcing = planar_forcing(wrenches, model.tilting, "dynamics")
    if links is None:
        return forcing
    x, P = np.zeros((len(forcing.t), 6)), wrenches.P @ elsewhere(model.tilting.off)[:, PLANE]
    x[:, HEAVE] = forcing.heave
    loads = links.loads(forcing.t, links.T_lab_0 @ from_vector(x))
    shared = Signal(wrenches.t, P, np.ones(len(P), dtype=bool))
    slid, angles = moved_together(bases, forcing, shared, links.trains, loads)
    x[:, PLANE] = np.where(found.slips, slid, np.where(found.linear, forcing.linear, 0.0))
    load = links.load(forcing.t, links.T_lab_0 @ from_vector(x), angles)
    return planar_forcing(replace(wrenches, links=load), model.tilting, "dynamics")


def moved_together(
    bases: Bases, forcing: PlanarForcing, shared: Signal, trains: DriveTrains, loads: LinkLoads
) -> tuple[np.ndarray, np.ndarray]:
    """x, y, yaw (n, 3) [m, rad, frame 0] of the first of `bases` since the first second of a forcing, and its links.

    Args:
        bases: At rest.
        forcing: By inverse dynamics of the motors, or a plate.
        shared: P (s, k, 3) of the joints, see `Carried`.
        trains: Drive trains of the arm.
        loads: On a base that does not accelerate in the floor's plane.

    Returns:
        The positions, and links as of `swaying` at the times of the loads.

    Raises:
        NotEnoughData: They throw each other apart, as if links were heavier than the robot.
    """
    drives, states, samples = trains.prepared_for(loads)
    drives.values[:, RELAXATION] = np.minimum(drives.values[:, RELAXATION], _YIELDS)
    t = forcing.t[0] + (np.arange(len(forcing.drive)) - (STEPS - 1)) * STEP
    row = np.minimum(np.searchsorted(loads.t, t), len(loads.t) - 1)
    at_steps = interpolate_columns(t, loads.t, samples.reshape(len(samples), -1)).reshape(-1, *samples.shape[1:])
    read = (t > loads.t[0]) & (t < loads.t[-1])
    motor = CubicHermiteSpline(loads.t, samples[:, Q], samples[:, V])
    at_steps[read, Q], at_steps[read, V], at_steps[~read, V] = motor(t[read]), motor(t[read], 1), 0.0
    dual, own = root_in_base(trains.dynamics.model, trains.description).dualAction[list(PLANE)], drives.columns
    P = interpolate_columns(loads.t, shared.t, shared.x[:, own].reshape(len(shared.x), -1)).reshape(-1, len(own), 3)
    R = np.ascontiguousarray(loads.coupling[:, own] @ dual.T)
    links = Carried(states, np.ascontiguousarray(at_steps), row, loads.inertia, loads.stiffness, P, R, drives)
    x, delta = walked(bases, forcing.drive, forcing.inertia, links, STEP)
    if not np.isfinite(x).all():
        raise NotEnoughData(f"{forcing.trial_id}: base and arm throw each other apart: check the masses of links")
    delta[:, : len(trains.trains)] -= drives.shifts[:, 0]
    return x - x[forcing.rest].mean(axis=0), trains.behind(loads, interpolate_columns(loads.t, t, delta).T)


def friction_use(model: StickSlip, forcing: PlanarForcing) -> np.ndarray:
    """Share (n, m) of its friction that each wheel needs, by the most likely parameters; 0 where no axis slips."""
    found = model.direction(forcing.source)
    if not found.slips.any():
        return np.zeros((len(forcing.t), len(model.wheels.names)))
    rows, base = model.wheels.rows(found.parameters), bases_of(model.wheels, found.logarithms[None], found.corrected)
    e, load = np.zeros((len(forcing.t), *model.wheels.position.shape)), np.zeros((len(forcing.t), 3))
    deflect_at_rest(base.wheels[0].reshape(-1), forcing.drive[0], base.lanes[0])
    for k, drive in enumerate(forcing.drive.reshape(len(e), STEPS, -1)):
        advance(base.state[0], base.wheels[0], drive, forcing.inertia[k], STEP, base.lanes[0])
        e[k], load[k] = base.deflection(0), base.state[0, LOAD : LOAD + 3, 0]
    drive = forcing.drive[STEPS - 1 :: STEPS]
    leans = np.stack([-drive[:, 7], drive[:, 6]], axis=1)[:, None]
    N = np.maximum(rows[:, 6] + load @ rows[:, 7:10].T + rows[:, 15] * (leans * e).sum(axis=2), 0.0)
    force = rows[:, 2:4] * e + (N - model.wheels.weight)[..., None] * leans
    used, limit = np.linalg.norm(force, axis=2), rows[:, 5] * N
    return np.minimum(np.divide(used, limit, out=np.ones_like(used), where=limit > 0.0), 1.0)
