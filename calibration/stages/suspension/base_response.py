"""What the base did on its wheels in one trial, and the wrench that made it.

    (K + G) x + C dx/dt + M d2x/dt2 = w

x displacement of the base frame, w change of the wrench since the first second, both in frame 0, low-passed alike.
With the plate's wrench M = 0: it is the wrench on the floor. Inverse dynamics takes the base at rest, so the base's
inertia M and the shift of its weight are on the left. G is no spring's: forces that are there at rest, f_i at p_i, turn
with the base (wheels are suspended in its axes), and its weight f moves with its centre of mass c,

    G x = sum_i [theta x f_i ; p_i x (theta x f_i)] - [0 ; (t + theta x c) x f]            second term: dynamics only

On a mobile manipulator of 73 kg the first is 745 N/rad between force and tilt, the second takes W c_z = 270 N.m/rad off
roll and pitch.

Trials as responses, by the plate's wrench and by that of inverse dynamics.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from calibration.errors import NotEnoughData
from calibration.mocap.measured_trial import MeasuredTrial
from calibration.numerics.lie import adjoint, from_vector, skew
from calibration.numerics.side_by_side import side_by_side
from calibration.numerics.signals import CUTOFF, RATE, even, low_passed
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import REST, Trial
from calibration.robot.laboratory import Laboratory
from calibration.stages.suspension.floor_wrench import Load, motion_load, plate_load
from calibration.stages.suspension.rest_frame import Rest, rest_of

_INDEPENDENT = 2.0 * CUTOFF * REST  # samples of low-passed noise in the first second
_RESTLESS = (_INDEPENDENT + 1.0) / (_INDEPENDENT - 1.0)  # of x minus its mean over that second, over variance in it
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Forcing:
    """What drives the base in one trial.

    Attributes:
        t: (n,) [s, mocap clock], spacing 1 / RATE.
        w: (n, 6) change of the wrench since the first second [N, N.m, frame 0].
        rest: (6,) wrench in the first second.
        inertia: M (6, 6).
        tangent: G (6, 6).
        T_0_plate: (4, 4) centre of the first plate and axes of its readings; frame 0 for dynamics.
    """

    t: np.ndarray
    w: np.ndarray
    rest: np.ndarray
    inertia: np.ndarray
    tangent: np.ndarray
    T_0_plate: np.ndarray

    def turned(self, angle: float) -> "Forcing":
        """With the wrench turned by an angle [rad] about the vertical through the centre of the plate."""
        to_plate, R = adjoint(self.T_0_plate).T, from_vector(np.array([0.0, 0.0, 0.0, 0.0, 0.0, angle]))[:3, :3]
        M = np.linalg.solve(to_plate, np.kron(np.eye(2), R) @ to_plate)
        return replace(self, w=self.w @ M.T, rest=M @ self.rest, tangent=tangent_of(M @ self.rest))


@dataclass(frozen=True)
class BaseResponse:
    """Forcing and displacement of one trial.

    Attributes:
        trial_id: The trial.
        forcing: On the same grid.
        x: (n, 6) displacement [m, rad, frame 0].
        valid: (n,) False inside holes of the recording.
        noise: (6,) mean square that the noise of motion capture adds to x, its reference included.
    """

    trial_id: str
    forcing: Forcing
    x: np.ndarray
    valid: np.ndarray
    noise: np.ndarray


def forcing_of(load: Load, start: float) -> Forcing:
    """Change of a load since the first second of the trial, which began at `start` [s, mocap clock].

    Raises:
        NotEnoughData: The load was not recorded then.
    """
    t, w = load.signal.t, load.signal.x
    early = t <= start + REST
    if early.sum() < 0.5 * REST * RATE:
        raise NotEnoughData(f"the wrench of the first second is missing: it begins {t[0] - start:.2f} s into the trial")
    rest = w[early].mean(axis=0)
    return Forcing(t, w - rest, rest, load.inertia, _tangent(rest, load), load.T_0_plate)


def base_response_of(description: Description, trial: Trial, rest: Rest, load: Load) -> BaseResponse:
    """Displacement by the base markers, and the forcing on its grid.

    Raises:
        NotEnoughData: Markers or wrench are missing.
    """
    forcing = forcing_of(load, float(trial.t_mocap[0]))
    found = low_passed(even(trial.t_mocap, rest.displacement(MeasuredTrial.of(description, trial).base.T)), CUTOFF)
    keep = (found.t >= forcing.t[0]) & (found.t <= forcing.t[-1])
    if keep.sum() < 2.0 * RATE:
        raise NotEnoughData(f"{trial.id}: base markers and wrench overlap for less than two seconds")
    t, x = found.t[keep], found.x[keep]
    early = t <= trial.t_mocap[0] + REST
    w = CubicSpline(forcing.t, forcing.w)(t)
    on_grid = replace(forcing, t=t, w=w)
    return BaseResponse(
        trial.id, on_grid, x - x[early].mean(axis=0), found.valid[keep], x[early].var(axis=0) * _RESTLESS
    )


def tangent_of(rest: np.ndarray) -> np.ndarray:
    """G (6, 6) from the plate's wrench at rest: its weight W and centre of pressure, moments (-W y, W x)."""
    G = np.zeros((6, 6))
    G[:3, 3:] = -skew(rest[:3] * [0.0, 0.0, 1.0])
    G[5, 3:5] = rest[4], -rest[3]
    return G


def _tangent(rest: np.ndarray, load: Load) -> np.ndarray:
    """G (6, 6) of a load; that of dynamics moves with its centre of mass."""
    G = tangent_of(rest)
    if load.weight > 0.0:
        f = np.array([0.0, 0.0, -load.weight])
        G[3:, :3] += skew(f)
        G[3:, 3:] -= skew(f) @ skew(load.centre_of_mass)
    return G


@dataclass(frozen=True)
class WrenchSources:
    """The instruments that show the wrench on the floor.

    Attributes:
        lab: The robot, nominal or as weighed, and its setup.
        robot: Clock of the encoders, None where there are none.
        plate: Clock of the force plate, None where there is none.
        T_base_B: (4, 4) the base's marker body on the base.
    """

    lab: Laboratory
    robot: Clock | None
    plate: Clock | None
    T_base_B: np.ndarray

    def plate_load(self, trial: Trial, T_lab_0: np.ndarray) -> Load:
        """The wrench the plate measured.

        Raises:
            NotEnoughData: There is no plate, or its clock is not known.
        """
        if self.plate is None or len(trial.t_plate) == 0:
            raise NotEnoughData(f"{trial.id}: no force plate on a known clock")
        return plate_load(trial, self.plate, T_lab_0)

    def dynamics_load(self, trial: Trial, T_lab_0: np.ndarray) -> Load:
        """The wrench by inverse dynamics, with the payload of the trial.

        Raises:
            NotEnoughData: There are no encoder readings on a known clock.
        """
        if self.robot is None or len(trial.t_robot) == 0:
            raise NotEnoughData(f"{trial.id}: no encoder readings on a known clock")
        lab = self.lab.of_trial(trial.id)
        return motion_load(lab, self.robot.to_mocap(trial.t_robot), trial.q_motor, T_lab_0, CUTOFF)


@dataclass(frozen=True)
class BaseResponses:
    """Responses of the usable trials; either is empty where there is no such instrument, else in the same order."""

    plate: tuple[BaseResponse, ...]
    dynamics: tuple[BaseResponse, ...]

    def without(self, names: Iterable[str]) -> "BaseResponses":
        """Without some trials."""
        left_out = set(names)
        return replace(
            self,
            plate=tuple(s for s in self.plate if s.trial_id not in left_out),
            dynamics=tuple(s for s in self.dynamics if s.trial_id not in left_out),
        )

    @property
    def forcings(self) -> tuple[list[Forcing], list[Forcing]]:
        """Of the plate and of the dynamics."""
        return [s.forcing for s in self.plate], [s.forcing for s in self.dynamics]


def laboratory(
    urdf: str, description: Description, robot: Clock | None, plate: Clock | None, T_base_B: np.ndarray | None = None
) -> WrenchSources:
    """Sources of the wrench in a dataset; the marker body at its nominal place, unless T_base_B says otherwise."""
    lab = Laboratory(urdf, description)
    return WrenchSources(lab, robot, plate, lab.T_base_B if T_base_B is None else T_base_B)


def read_responses(wrenches: WrenchSources, trials: Sequence[Trial]) -> BaseResponses:
    """Responses of the trials that show the base and its wrench, by every instrument the campaign has."""
    sources: dict[str, Callable[[Trial, np.ndarray], Load]] = {}
    if wrenches.robot is not None and any(len(t.t_robot) for t in trials):
        sources["dynamics"] = wrenches.dynamics_load
    if wrenches.plate is not None and any(len(t.t_plate) for t in trials):
        sources["plate"] = wrenches.plate_load
    description = wrenches.lab.description

    def found(trial: Trial) -> list[BaseResponse] | None:
        try:
            rest = rest_of(description, trial, wrenches.T_base_B)
            loads = [load(trial, rest.T_lab_0) for load in sources.values()]
            return [base_response_of(description, trial, rest, load) for load in loads]
        except NotEnoughData as error:
            _log.info("%s: %s", trial.id, error)
            return None

    rows = [row for row in side_by_side(found, trials) if row is not None]
    columns = {name: tuple(row[k] for row in rows) for k, name in enumerate(sources)}
    return BaseResponses(columns.get("plate", ()), columns.get("dynamics", ()))


def without_reference(e: np.ndarray, together: float) -> np.ndarray:
    """Errors e (n, c) of x in one trial, whitened of their reference's noise, which all of them share.

        e - (1 - (1 + n / (together m))^-1/2) mean e

    In units of sqrt(together) standard deviations of a sample, m samples of the reference being independent.
    """
    n = len(e)
    return e - (1.0 - (1.0 + n / (together * _INDEPENDENT)) ** -0.5) * e.sum(axis=0) / max(n, 1)
