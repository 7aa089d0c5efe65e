"""The base on its suspension in use: the wrench it puts on the floor in, the way it moved out.

    T_lab_base(t) = T_lab_0 exp(x(t)) T_lab_0^-1 T_lab_base(start)        x(t) from the change of the wrench since rest

T_lab_0 is frame 0 (see suspension_rest), the base's own frame where its pose in the lab is not given. The wrench is
the action on the floor; its first second is the rest it changes from. A recording is low-passed at 10 Hz, forth and
back; sample by sample the wrench is taken as it comes, and the springs' modes are carried from one to the next.

Variances of x are what the suspension left of trials it had not seen, of each axis; of a base taken to stand still,
what the one of those trials moved that moved most. Both less the noise of motion capture.

Where the base's markers are in a trial, predicted: its first second and a wrench, nothing else.

T_lab_B(t) = T_lab_0 exp(x(t)) T_0_B,     x from the plate's wrench or from inverse dynamics along q_motor
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.errors import NotEnoughData, ShapeError
from calibration.mocap.cluster_pose import body_poses, poses_of
from calibration.numerics.lie import adjoint, from_vector, inverse, mean
from calibration.numerics.signals import CUTOFF, interpolate_columns
from calibration.numerics.wrench import in_frame
from calibration.recording.schema import Body, Description
from calibration.recording.trial import REST, Trial
from calibration.stages.stick_slip.kernel.lifted import borne
from calibration.stages.stick_slip.stream import SlipState
from calibration.stages.suspension.base_response import WrenchSources, forcing_of
from calibration.stages.suspension.floor_wrench import Load, floor_load
from calibration.stages.suspension.model import Source, Suspension
from calibration.stages.suspension.rest_frame import Rest, rest_at, upright

_STILL, _LAGS = np.zeros((3, 3)), np.zeros((2, 3))
_UPRIGHT = 1e-9  # [m/s2] gravity's components in two frames 0 that are one direction


@dataclass(frozen=True)
class LoadedBase:
    """A base on its suspension at a known pose.

    Attributes:
        suspension: Of the base.
        T_lab_0: (4, 4) frame 0.
        T_0_base: (4, 4) the base frame at the start.
        centre: (3,) the point the wrench is about [m, lab]; NaN where the laboratory has no plate.
        gravity: (3,) in frame 0 [m/s2].
    """

    suspension: Suspension
    T_lab_0: np.ndarray
    T_0_base: np.ndarray
    centre: np.ndarray
    gravity: np.ndarray

    def moved(self, t: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """How the base moved in the lab (n, 4, 4) at t (n,) [s] under the wrench (n, 6) in lab axes.

        Raises:
            NotEnoughData: Less than a second, or nothing says what point the wrench is about.
        """
        forcing = forcing_of(self.load(t, wrench), float(t[0]))
        x = self.suspension.displaced(forcing, "plate")
        return self.in_lab(interpolate_columns(t, forcing.t, x))

    def load(self, t: np.ndarray, wrench: np.ndarray, cutoff: float = CUTOFF) -> Load:
        """The wrench (n, 6) as the floor has it, without what is faster than `cutoff` [Hz].

        Raises:
            NotEnoughData: Less than a second, or nothing says what point the wrench is about.
        """
        self._need_centre()
        if wrench.shape != (len(t), 6):
            raise ShapeError("wrench", wrench.shape, (len(t), 6))
        w = in_frame(wrench[:, None], self.centre[None], self.T_lab_0)
        return floor_load(t, w, self.T_lab_0, self.centre, cutoff)

    def stepped(self, t: float, wrench: np.ndarray, before: "BaseState | None") -> "BaseState":
        """The base one sample on: its wrench (6,) at t [s]; without a state before, this sample is the first at rest.

        Raises:
            NotEnoughData: Nothing says what point the wrench is about.
        """
        state = self.sprung(t, wrench, before)
        if state.n > (0 if before is None else before.n):
            return state
        return state._replace(moved=self.in_lab((state.x * self.suspension.moves("plate"))[None]))

    def sprung(
        self,
        t: float,
        wrench: np.ndarray,
        before: "BaseState | None",
        standing: np.ndarray | None = None,
    ) -> "BaseState":
        """The same as the springs alone have it; `moved` is left as it was. `standing` as `bear` takes it."""
        if wrench.shape != (6,):
            raise ShapeError("wrench", wrench.shape, (6,))
        w = self.action @ wrench
        w = w if standing is None else borne(standing, w[None])[0]
        if before is None:
            none = np.zeros(len(self.suspension.modes.tau), dtype=complex)
            return BaseState(t, t, w, w, 1, none, none, np.zeros(6), np.eye(4)[None], _STILL)
        if t <= before.start + REST:
            n = before.n + 1
            return before._replace(t=t, wrench=w, rest=before.rest + (w - before.rest) / n, n=n)
        y, u, x = self.suspension.modes.advanced(before.y, before.u, w - before.rest, t - before.t)
        return BaseState(before.start, t, w, before.rest, before.n, u, y, x, before.moved, _STILL)

    @cached_property
    def action(self) -> np.ndarray:
        """From a wrench about the centre, lab axes, to one in frame 0 (6, 6)."""
        self._need_centre()
        return in_frame(np.eye(6)[:, None], self.centre[None], self.T_lab_0).T

    def covariance(self, T_base_hand: np.ndarray, moves: bool) -> np.ndarray:
        """Covariance (n, 6, 6) that the base adds to the hand's local twist, at T_base_hand (n, 4, 4)."""
        tried = dict(self.suspension.held_out).get("plate") or self.suspension.held_out[0][1]
        return self.carried(tried.variance(tried.moves) if moves else tried.still, T_base_hand)

    def carried(self, variance: np.ndarray, T_base_hand: np.ndarray) -> np.ndarray:
        """Covariance (n, 6, 6) of the hand's local twist by variances (6,) or (n, 6) of displacements in frame 0."""
        Ad = adjoint(inverse(self.T_0_base @ T_base_hand))
        return np.asarray(Ad * variance[..., None, :] @ np.swapaxes(Ad, 1, 2))

    def _need_centre(self) -> None:
        if not np.isfinite(self.centre).all():
            raise NotEnoughData("the laboratory has no plate: give a wrench about the base's origin, and no start pose")

    def in_lab(self, x: np.ndarray) -> np.ndarray:
        """Motions of the lab (n, 4, 4) by displacements x (n, 6) of frame 0."""
        return Rest(self.T_lab_0, self.T_0_lab).poses(x)

    @cached_property
    def T_0_lab(self) -> np.ndarray:
        """Inverse of T_lab_0."""
        return inverse(self.T_lab_0)


def loaded_base(suspension: Suspension, description: Description, T_lab_base: np.ndarray | None) -> LoadedBase:
    """The base at its pose in the laboratory; where that is not given, the lab is the base frame."""
    gravity = np.array(description.gravity)
    if T_lab_base is None:
        return LoadedBase(suspension, np.eye(4), np.eye(4), np.zeros(3), gravity)
    T_lab_0 = upright(T_lab_base, description)
    centre = np.array(description.plates[0].centre) if description.plates else np.full(3, np.nan)
    return LoadedBase(suspension, T_lab_0, inverse(T_lab_0) @ T_lab_base, centre, gravity @ T_lab_0[:3, :3])


class BaseState(NamedTuple):
    """State of the base after a sample.

    Attributes:
        start: Time of the first sample [s].
        t: The sample's time [s].
        wrench: (6,) its wrench [N, N.m, frame 0].
        rest: (6,) wrench at rest, the mean of the first second [N, N.m, frame 0].
        n: Samples in it.
        u: (k,) how the wrench drives the modes.
        y: (k,) where the modes are.
        x: (6,) displacement by the springs on all axes [m, rad, frame 0].
        moved: (1, 4, 4) how the base moved in the lab.
        moves: (3, 3) how a base that slips accelerates, linear and angular, and turns [m/s2, rad/s2, rad/s, lab axes].
        slip: State of a base that slips; None of one that does not.
        lags: (2, 3) z and tilt through one lag and two, of a base that slips.
    """

    start: float
    t: float
    wrench: np.ndarray
    rest: np.ndarray
    n: int
    u: np.ndarray
    y: np.ndarray
    x: np.ndarray
    moved: np.ndarray
    moves: np.ndarray
    slip: SlipState | None = None
    lags: np.ndarray = _LAGS


@dataclass(frozen=True)
class BaseInTrial:
    """The base in one trial as the suspension moves it; inverse dynamics runs once, whatever frame 0 is.

    Its wrench depends on frame 0 by the direction of gravity alone, which is the same in every frame set upright.

    Attributes:
        suspension: Of the base.
        wrenches: Instruments, and the nominal placement of the marker body.
        trial: The trial.
        T_lab_B: (4, 4) the marker body in the first second.
    """

    suspension: Suspension
    wrenches: WrenchSources
    trial: Trial
    T_lab_B: np.ndarray

    def rest(self, T_base_B: np.ndarray | None = None) -> Rest:
        """Frame 0, the marker body placed at T_base_B (4, 4); where not given, at its nominal place."""
        placed = self.wrenches.T_base_B if T_base_B is None else T_base_B
        return rest_at(self.wrenches.lab.description, self.T_lab_B, placed)

    def displacement(self, source: Source, rest: Rest) -> np.ndarray:
        """Displacement (n, 6) [m, rad, frame 0] at `t_mocap`; outside the wrench's recording it stays.

        Raises:
            NotEnoughData: The wrench was not recorded.
        """
        if source == "plate":
            return self._driven(self.wrenches.plate_load(self.trial, rest.T_lab_0), source)
        down, x = self._by_dynamics
        if np.allclose(self._down(rest), down, rtol=0.0, atol=_UPRIGHT):
            return x
        return self._driven(self.wrenches.dynamics_load(self.trial, rest.T_lab_0), source)

    @cached_property
    def _by_dynamics(self) -> tuple[np.ndarray, np.ndarray]:
        """Gravity in frame 0 (3,), and the displacement it goes with."""
        rest = self.rest()
        return self._down(rest), self._driven(self.wrenches.dynamics_load(self.trial, rest.T_lab_0), "dynamics")

    def _down(self, rest: Rest) -> np.ndarray:
        return np.array(self.wrenches.lab.description.gravity) @ rest.T_lab_0[:3, :3]

    def _driven(self, load: Load, source: Source) -> np.ndarray:
        forcing = forcing_of(load, float(self.trial.t_mocap[0]))
        return interpolate_columns(self.trial.t_mocap, forcing.t, self.suspension.displaced(forcing, source))


def base_at(body: Body | None, T_base_B: np.ndarray, markers: np.ndarray) -> np.ndarray:
    """T_lab_base (4, 4) with its marker body at T_base_B (6,) [m, rad], from markers (n, m, 3) [m, lab].

    Raises:
        NotEnoughData: The body has no three markers, or no sample shows three.
    """
    if body is None or len(body.markers) < 3:
        raise NotEnoughData("this estimate knows no three markers on the base: give T_lab_base_start")
    T = body_poses(np.array([m.xyz for m in body.markers]), np.asarray(markers, dtype=float)).T
    if not np.isfinite(T).all(axis=(1, 2)).any():
        raise NotEnoughData("no sample shows three markers of the base")
    return np.asarray(mean(T) @ inverse(from_vector(T_base_B)))


def measured_base(body: Body, trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """T_lab_B (n, 4, 4) of the base's marker body throughout a trial, and (4, 4) at rest, by its first second alone.

    Raises:
        NotEnoughData: The body is not seen in that second.
    """
    rows = trial.t_mocap <= trial.t_mocap[0] + REST
    first = replace(trial, t_mocap=trial.t_mocap[rows], marker_position=trial.marker_position[rows])
    at_rest = poses_of(body, first).T
    if not np.isfinite(at_rest).any():
        raise NotEnoughData(f"{trial.id}: body {body.name!r} is not seen in the first second of the trial")
    return poses_of(body, trial).T, mean(at_rest)
