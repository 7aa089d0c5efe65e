"""What drives the base in the floor's plane in one trial.

    w = (Fx, Fy, Mz) of inverse dynamics on a base that does not accelerate  -  M_ph d2/dt2 (z, rx, ry)
    vertical load (-Fz, My, -Mx) of the plate, or of inverse dynamics less M_h. d2/dt2 (z, rx, ry)

all about the base frame's origin, in its axes, a plate's in frame 0; p: x, y, yaw, h: z, rx, ry; M(q) the composite
inertia of the robot as weighed, with the trial's payload. Heave and tilt are the 6x6 compliance's under that source.
Forces in the plane count from their mean in the first second. Without joint readings the plate alone moves the base.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE, Signal
from calibration.recording.clock import Clock
from calibration.recording.trial import REST, Trial
from calibration.robot.laboratory import Laboratory
from calibration.robot.wrist_sensor import Push, hand_push
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.stick_slip.kernel.bases import COLUMNS, HEAVE, PLANE, PLATE, STEPS, TILTS, Bases, inertia_rows
from calibration.stages.stick_slip.kernel.heaving import Springs, accelerations, damped, heaving
from calibration.stages.stick_slip.kernel.lifted import on_wheels
from calibration.stages.stick_slip.wheels import WheelSet, wheel_set
from calibration.stages.suspension.base_response import Forcing, WrenchSources, forcing_of
from calibration.stages.suspension.floor_wrench import Load, composite_inertia, motion_load, moved, plate_load, vertical
from calibration.stages.suspension.lifting_response import predicted_lifting
from calibration.stages.suspension.modal_response import predicted
from calibration.stages.suspension.model import Source
from calibration.stages.suspension.weighing import leans

CUTOFF = 20.0  # [Hz]: peaks of 50 ms make wheels slip
STEP = 1.0 / (RATE * STEPS)  # [s]; the last of STEPS is at its sample
UNMOVED = 1e12  # [kg, kg.m2]: an inertia that no force moves


@dataclass(frozen=True)
class PlanarForcing:
    """What the kernel takes of one trial, n samples.

    Attributes:
        trial_id: The trial.
        source: `plate` or `dynamics`.
        t: (n,) [s, mocap clock], spacing 1 / RATE.
        drive: (STEPS n, 13), see `kernel.integration.advance`.
        inertia: (n, 15).
        heave: (n, 3) z, rx, ry by the compliance [m, rad].
        rest: (n,) True in the first second.
        linear: (n, 3) x, y, yaw by the compliance.
        pushed: Whether the wrist's sensor shows that the hand is pushed.
    """

    trial_id: str
    source: Source
    t: np.ndarray
    drive: np.ndarray
    inertia: np.ndarray
    heave: np.ndarray
    rest: np.ndarray
    linear: np.ndarray
    pushed: bool = False

    @property
    def force(self) -> np.ndarray:
        """(n, 3) change of Fx, Fy, Mz on the floor, by its source."""
        return planar_force(self.drive, self.source)


def planar_force(drive: np.ndarray, source: Source, steps: int = STEPS) -> np.ndarray:
    """Change of Fx, Fy, Mz (n, 3) on the floor by its source, of drives (steps n, 13)."""
    first = PLATE if source == "plate" else 0
    return np.asarray(drive[steps - 1 :: steps, first : first + 3])


@dataclass(frozen=True)
class Tilting:
    """The 6x6 compliance that heave and tilt follow, and where the plate is.

    Attributes:
        K: (6, 6) stiffness [N/m, N.m/rad].
        C: (6, 6) damping.
        off: (2,) how far the plate seems from its declared place under the base [m], see `standing.plate_place`.
        shares: (2,) of the load that drives and back casters bear, relative to front casters [-].
        over: (2,) the same as `off` of where inverse dynamics have the weight [m].
    """

    K: np.ndarray
    C: np.ndarray
    off: np.ndarray = field(default_factory=lambda: np.zeros(2))
    shares: np.ndarray = field(default_factory=lambda: np.ones(2))
    over: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def placed(self, load: Load) -> Load:
        """A load of inverse dynamics as the base's markers have it, the weight where the wheels bear it.

        Moments are less by `over` -Fz; a force across the floor acts `off` from the origin of the markers' frame.
        """
        x = load.signal.x.copy()
        x[:, 4], x[:, 3] = x[:, 4] + x[:, 2] * self.over[0], x[:, 3] - x[:, 2] * self.over[1]
        x[:, 5] += self.off[0] * x[:, 1] - self.off[1] * x[:, 0]
        return replace(load, signal=replace(load.signal, x=x))

    def leans(self, load: np.ndarray) -> np.ndarray:
        """(rx, ry) [rad] from the vertical under a load (-Fz, My, -Mx) at rest, by springs of the same length."""
        return leans(self.K, load)

    def standing(self, wheels: WheelSet, source: Source) -> np.ndarray:
        """Rows (m, 10) of wheels, see `WheelSet.standing`, as the source's wrench counts their places."""
        return wheels.standing(self.shares, self.off if source == "plate" else np.zeros(2))


@dataclass(frozen=True)
class Wrenches:
    """Wrenches of one trial, read once for every source.

    Attributes:
        trial_id: The trial.
        start: Its first time [s, mocap clock].
        plate: By the plate; None without one.
        dynamics: By inverse dynamics; None without joint readings.
        t: (k,) times of the inertia; empty without.
        M: (k, 6, 6) composite inertia.
        wheels: Of the robot.
        links: By inverse dynamics of link angles, where known, on a base that moves: they strike in their gaps.
        slips: A base of the most likely parameters, for heave and tilt while it slips; None: as if it stuck.
        slid: How far the base has slid (k, 3), on which the plate stands still, where that is known: predicted, or in
            a calibration trial as its markers show it. Then the plate shows heave and tilt, whatever is to move it.
        pushed: As of `PlanarForcing`.
        P: (k, n_joints, 6) of base and joints, see `composite_inertia`.
    """

    trial_id: str
    start: float
    plate: Load | None
    dynamics: Load | None
    t: np.ndarray
    M: np.ndarray
    wheels: WheelSet
    links: Load | None = None
    slips: Bases | None = None
    slid: Signal | None = None
    pushed: bool = False
    P: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 6)))

    @property
    def inverse_dynamics(self) -> Load | None:
        """By inverse dynamics of what is known best."""
        return self.links or self.dynamics


class Readings(NamedTuple):
    """Motor readings without gaps.

    Attributes:
        t: (n,) [s, mocap clock].
        q: (n, k) [rad, m].
        hand: What the wrist's sensor shows of the hand to load the floor.
    """

    t: np.ndarray
    q: np.ndarray
    hand: Push | None = None


def wrenches_of(sources: WrenchSources, trial: Trial, T_lab_0: np.ndarray, arm: DriveTrains | None = None) -> Wrenches:
    """What the instruments of a trial show of its wrench, by the robot with the payload of the trial."""
    start, plate, lab = float(trial.t_mocap[0]), None, sources.lab.of_trial(trial.id)
    if sources.plate is not None and len(trial.t_plate):
        plate = plate_load(trial, sources.plate, T_lab_0, CUTOFF)
    if sources.robot is None or not len(trial.t_robot):
        return Wrenches(trial.id, start, plate, None, np.zeros(0), np.zeros((0, 6, 6)), wheels_of(lab))
    t, q, wrench = readings_of(sources.robot, trial)
    hand = arm.of_trial(trial.id).hand(t, q, wrench) if arm else hand_push(lab.urdf, lab.description, t, q, wrench)
    return replace(wrenches_along(lab, Readings(t, q, hand), plate, T_lab_0), trial_id=trial.id, start=start)


def readings_of(robot: Clock, trial: Trial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) [s, mocap clock] of the whole readings of a trial, the motors' (n, k) and the wrist's (n, 6)."""
    known = np.isfinite(trial.q_motor).all(axis=1)
    return robot.to_mocap(trial.t_robot[known]), trial.q_motor[known], trial.wrist_wrench[known]


def wrenches_along(lab: Laboratory, readings: Readings, plate: Load | None, T_lab_0: np.ndarray) -> Wrenches:
    """The wrench of the plate, and that of readings."""
    t, q, hand = readings
    dynamics, (at, M, P) = motion_load(lab, t, q, T_lab_0, CUTOFF, hand), composite_inertia(lab, t, q, CUTOFF, hand)
    pushed = hand is not None and hand.outside
    return Wrenches("readings", float(t[0]), plate, dynamics, at, M, wheels_of(lab), pushed=pushed, P=P)


def wheels_of(lab: Laboratory) -> WheelSet:
    """The wheels of a laboratory's robot."""
    return wheel_set(lab.urdf, lab.description.wheels, float(np.linalg.norm(lab.description.gravity)))


def planar_forcing(wrenches: Wrenches, tilting: Tilting, source: Source, balanced: bool = True) -> PlanarForcing:
    """The forcing by the plate with inverse dynamics, or by inverse dynamics alone.

    `balanced`: whether what a plate misses of inverse dynamics tells how the base is shaken, see `kernel.heaving`.

    Raises:
        NotEnoughData: The wrench asked for was not recorded.
    """
    dynamics = None if wrenches.inverse_dynamics is None else tilting.placed(wrenches.inverse_dynamics)
    main = wrenches.plate if source == "plate" else dynamics
    if main is None:
        what = "force plate" if source == "plate" else "encoder readings"
        raise NotEnoughData(f"{wrenches.trial_id}: no {what} on a known clock")
    heave, linear = _swayed(wrenches, tilting, source, main)
    first, last = max(linear.x[0], heave.x[0]), min(linear.x[-1], heave.x[-1])
    if dynamics is not None:
        first, last = max(first, dynamics.signal.t[0]), min(last, dynamics.signal.t[-1])
    fine = first + np.arange(int((last - first) * RATE + 1e-6) * STEPS) * STEP
    t, rest = fine[STEPS - 1 :: STEPS], fine <= wrenches.start + REST
    tilt, load = heave(fine), CubicSpline(main.signal.t, main.signal.x)(fine)
    rows, drive = np.zeros((len(t), 15)), np.zeros((len(fine), COLUMNS))
    rows[:, [0, 3, 5]] = UNMOVED
    if dynamics is not None:
        M = moved(_resampled(wrenches.t, wrenches.M, t), tilting.off)
        rises = _rising(heave, dynamics, main, t, M)(fine) if balanced and main is not dynamics else heave(fine, 2)
        shift = np.einsum("nij,nj->ni", np.repeat(M, STEPS, axis=0)[:, :, HEAVE], rises)
        drive[:, :3] = (CubicSpline(dynamics.signal.t, dynamics.signal.x)(fine) - shift)[:, PLANE]
        drive[:, TILTS:], drive[:, :3] = rises[:, 1:], drive[:, :3] - drive[rest, :3].mean(axis=0)
        rows[:, :6] = inertia_rows(M)[:, :6]
        if main is dynamics:
            load, rows = load - np.where(np.isin(np.arange(6), HEAVE), shift, 0.0), inertia_rows(M)
    drive[:, 3:6] = vertical(load)
    if source == "plate":
        drive[:, 4:6] -= drive[:, 3:4] * tilting.off
        drive[:, PLATE:TILTS] = load[:, PLANE] - load[rest][:, PLANE].mean(axis=0)
    drive[:, 6:8] = (tilt - tilt[rest].mean(axis=0))[:, 1:] + tilting.leans(drive[rest, 3:6].mean(axis=0))
    own = slice(STEPS - 1, None, STEPS)
    return PlanarForcing(wrenches.trial_id, source, t, drive, rows, tilt[own], rest[own], linear(t), wrenches.pushed)


def _rising(heave: CubicSpline, dynamics: Load, plate: Load, t: np.ndarray, M: np.ndarray) -> CubicSpline:
    """Accelerations of z, rx, ry of a base on a plate, M (n, 6, 6) at t (n,), see `kernel.heaving`."""
    own, borne = (CubicSpline(load.signal.t, load.signal.x)(t) for load in (dynamics, plate))
    return CubicSpline(t, accelerations(t, heave(t, 2), own - borne, M))


def _compliant(wrenches: Wrenches, tilting: Tilting, source: Source, load: Load) -> tuple[np.ndarray, np.ndarray]:
    """Times (k,) [s, mocap clock] and displacements (k, 6) by the compliance of a base whose wheels may lift off.

    A plate's wrench is what the wheels bear; that of inverse dynamics less what the base's inertia takes.
    """
    standing = tilting.standing(wrenches.wheels, source)
    if source == "plate":
        forcing = forcing_of(on_wheels(load, standing, wrenches.slid), wrenches.start)
        return forcing.t, predicted(tilting.K, tilting.C, forcing)
    forcing = forcing_of(load, wrenches.start)
    return forcing.t, predicted_lifting(tilting.K, tilting.C, forcing, standing)


def _swayed(wrenches: Wrenches, tilting: Tilting, source: Source, load: Load) -> tuple[CubicSpline, CubicSpline]:
    """z, rx, ry and x, y, yaw by the compliance.

    Where inverse dynamics move the base, the first by the plate of a calibration trial, or of a base that slips.
    """
    grid, compliant = _compliant(wrenches, tilting, source, load)
    heave, linear = (CubicSpline(grid, compliant[:, axes]) for axes in (HEAVE, PLANE))
    if source == "dynamics" and wrenches.slid is not None and wrenches.plate is not None:
        grid, compliant = _compliant(wrenches, tilting, "plate", wrenches.plate)
        return CubicSpline(grid, compliant[:, HEAVE]), linear
    if source == "dynamics" and wrenches.slips is not None:
        return _heaving(wrenches, tilting, wrenches.slips, forcing_of(load, wrenches.start)), linear
    return heave, linear


def heave_apart(wrenches: Wrenches, tilting: Tilting, slips: Bases | None) -> np.ndarray | None:
    """Mean squares (2, 3) of z, rx, ry by dynamics less the plate's, and of what these reach; None without either."""
    load = wrenches.inverse_dynamics
    if load is None or wrenches.plate is None:
        return None
    found, _ = _swayed(replace(wrenches, slid=None, slips=slips), tilting, "dynamics", tilting.placed(load))
    t, compliant = _compliant(wrenches, tilting, "plate", wrenches.plate)
    inside = (t >= found.x[0]) & (t <= found.x[-1])
    h = compliant[inside][:, HEAVE]
    return np.stack([((found(t[inside]) - h) ** 2).mean(axis=0), np.maximum.accumulate(h**2).mean(axis=0)])


def _heaving(wrenches: Wrenches, tilting: Tilting, slips: Bases, forcing: Forcing) -> CubicSpline:
    """z, rx, ry of a base while it slips, see `kernel.heaving`."""
    h, order, t = np.ix_(HEAVE, HEAVE), [*PLANE, *HEAVE], forcing.t
    standing = tilting.standing(wrenches.wheels, "dynamics")
    M = moved(_resampled(wrenches.t, wrenches.M, t), tilting.off)
    K, C, leans = tilting.K[h], tilting.C[h], tilting.leans(vertical(forcing.rest[None])[0])
    springs = Springs(K, damped(K, C), K + forcing.tangent[h], forcing.rest[[*HEAVE]], standing, leans)
    w = CubicSpline(t, forcing.w[:, order])(t[0] + np.arange(STEPS * len(t)) * STEP)
    state, wheels, own = slips.state[0].copy(), slips.wheels[0].copy(), np.ascontiguousarray(M[:, order][:, :, order])
    found = heaving(state, wheels, slips.lanes[0], np.ascontiguousarray(w), own, inertia_rows(M), springs, STEP)
    return CubicSpline(t, found[::STEPS])


def _resampled(t: np.ndarray, M: np.ndarray, at: np.ndarray) -> np.ndarray:
    """M (n, 6, 6) at times (n,), linear."""
    return np.stack([np.interp(at, t, c) for c in M.reshape(len(M), 36).T], axis=1).reshape(len(at), 6, 6)
