"""The base of row `full` in use: it sticks and slips under a plate's wrench, or that of the arm's own inertia.

    T_lab_base(t) = T_lab_0 exp(x(t)) T_lab_0^-1 T_lab_base(start)        covariance of x: diag V(t), in frame 0

x, y, yaw by the stick-slip model, z and tilt by the compliance, as in the evaluation's row. Sample by sample the
wrench is taken as it comes, and heave and tilt h accelerate as two equal lags in a row show it,

    a = d2 h / dt2 / (1 + tau s)^2 = (h - 2 f1 + f2) / tau^2,     tau df1/dt = h - f1,     tau df2/dt = f1 - f2

tau = 1 / (2 pi 20 Hz), the cutoff of a recording's wrench: 16 ms late.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from calibration.numerics.compiled import njit
from calibration.numerics.lie import from_vectors
from calibration.numerics.signals import interpolate_columns
from calibration.prediction.base_pose import BaseState, LoadedBase
from calibration.recording.trial import REST
from calibration.robot.kinematics import shift
from calibration.robot.laboratory import Laboratory
from calibration.robot.rigid_tree import RigidTree, scratch
from calibration.robot.tree_dynamics import TreeDynamics, room, sample
from calibration.stages.drive_trains.drive_trains import DriveTrains
from calibration.stages.stick_slip.forcing import CUTOFF, Readings, wrenches_along
from calibration.stages.stick_slip.kernel.bases import (
    ACCELERATION,
    COLUMNS,
    HEAVE,
    PLANE,
    STEPS,
    UPPER,
    VELOCITY,
    Bases,
)
from calibration.stages.stick_slip.kernel.lifted import bear
from calibration.stages.stick_slip.model import StickSlip
from calibration.stages.stick_slip.poses import Links, forced
from calibration.stages.stick_slip.stream import (
    UNDRIVEN,
    Fitted,
    Sample,
    SlipState,
    SlipStream,
    mean_of,
    slip_stream,
    step_members,
)
from calibration.stages.suspension.floor_wrench import root_in_base
from calibration.stages.suspension.modal_response import advance_modes
from calibration.stages.suspension.model import Source

_UPPER = tuple((PLANE[i], PLANE[j]) for i, j in UPPER)
_UNMOVED = np.zeros((3, 0))
_LAG = 1.0 / (2.0 * np.pi * CUTOFF)  # [s] tau
_STILL = np.zeros((2, 3))  # velocities in the plane, accelerations of heave and tilt


class Place(NamedTuple):
    """A base where it is: from the plate's wrench to what wheels and springs bear, and from there to the lab.

    Attributes:
        action: (6, 6) of wrenches in the lab on those in frame 0.
        standing: (m, 10) as `bear` takes it.
        a: (6, k), b: (k, 6) and tau: (k,) of `Modes`.
        T_lab_0: (4, 4) frame 0.
        T_0_lab: (4, 4) its inverse.
        gravity: (3,) in frame 0 [m/s2].
    """

    action: np.ndarray
    standing: np.ndarray
    a: np.ndarray
    b: np.ndarray
    tau: np.ndarray
    T_lab_0: np.ndarray
    T_0_lab: np.ndarray
    gravity: np.ndarray


class Earlier(NamedTuple):
    """What a sample carries on of `BaseState`, and of `SlipState`, `row` its `before`."""

    wrench: np.ndarray
    y: np.ndarray
    u: np.ndarray
    x: np.ndarray
    lags: np.ndarray
    rest: np.ndarray
    row: np.ndarray
    found: np.ndarray
    band: np.ndarray


@dataclass(frozen=True)
class SlippingBase:
    """A base that sticks and slips, wherever it stands.

    Attributes:
        model: Fitted from `source`.
        lab: The robot, nominal or as weighed, with the payload in its hand.
        source: What moves it: a plate's wrench, or inverse dynamics of the readings.
        trains: Drive trains of the arm, with the same payload, where they are known.
    """

    model: StickSlip
    lab: Laboratory
    source: Source
    trains: DriveTrains | None = None

    def moved(
        self,
        at: LoadedBase,
        t: np.ndarray,
        q_motor: np.ndarray,
        wrench: np.ndarray | None,
        wrist: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """How the base moved in the lab (n, 4, 4) and variances (n, 6) of its displacement in frame 0.

        Without a plate's wrench inverse dynamics move it, and what the wrist's sensor shows of the hand.

        Raises:
            NotEnoughData: Less than a second, or nothing says what point the wrench is about.
        """
        load = None if wrench is None else at.load(t, wrench, CUTOFF)
        hand = None if self.trains is None or wrist is None else self.trains.hand(t, q_motor, wrist)
        readings = Readings(t, q_motor, hand)
        wrenches, links = wrenches_along(self.lab, readings, load, at.T_lab_0), None
        if self.trains is not None:
            links = Links(self.lab, self.trains, readings, at.T_lab_0, wrist)
        forcing = forced(self.model, wrenches, self.source, links)
        x, variance = (interpolate_columns(t, forcing.t, found) for found in self.model.displacement(forcing))
        return at.in_lab(x), variance

    def stepped(
        self, at: LoadedBase, t: float, wrench: np.ndarray, moving: np.ndarray | None, before: BaseState | None
    ) -> BaseState:
        """The base one sample on; without the arm's motion (3, k) it has no inertia, and the plate alone moves it.

        `moving` are motor readings, velocities and accelerations [rad, m, s].
        """
        if before is None or before.slip is None or t <= before.start + REST:
            state = at.sprung(t, wrench, before, self.model.standing)
            driving = None if moving is None else self._driven(at.gravity, moving)
            slip, swayed = None if before is None else before.slip, np.stack([state.x[2:5], np.zeros(3)])
            return state._replace(slip=self._stream.stepped(Sample(t, at.action @ wrench, swayed, driving), slip))
        slip, modes, stream = before.slip, at.suspension.modes, self._stream
        place = Place(at.action, self.model.standing, modes.a, modes.b, modes.tau, at.T_lab_0, at.T_0_lab, at.gravity)
        earlier = Earlier(
            before.rest, before.y, before.u, before.x, before.lags, slip.rest, slip.before, slip.found, slip.band
        )
        motion = _UNMOVED if moving is None else moving
        tree, actions, work, room = self._robot
        w, (y, u), x, lags, moved, a, row, state, wheels, learnt, found = carried(
            wrench, motion, t - before.t, earlier, slip.bases, place, stream.fitted, tree, *actions, work, room
        )
        bases = Bases(state, wheels, slip.bases.lanes, learnt)
        slid = found[1] * stream.fitted.moves
        slip = SlipState(slip.start, t, slip.rest, slip.n, slip.noise, row, bases, found, slip.band, slid)
        return BaseState(before.start, t, w, before.rest, before.n, u, y, x, moved, a, slip, lags)

    def variance(self, state: BaseState) -> np.ndarray:
        """(6,) of the displacement in frame 0 [m2, rad2]."""
        found, own = np.empty(6), self._stream.direction
        found[list(PLANE)] = np.zeros(3) if state.slip is None else state.slip.variance(own)
        found[list(HEAVE)] = own.heave.variance(np.zeros(3) if state.slip is None else state.slip.found[4])
        return found

    def _driven(self, gravity: np.ndarray, moving: np.ndarray) -> np.ndarray:
        """What the arm does to the base in the floor's plane (9,), see `Sample`; gravity (3,) in frame 0."""
        tree, actions, work, found = self._robot
        return np.asarray(driven(tree, actions, gravity, _STILL, moving, work, found))

    @cached_property
    def _robot(self) -> tuple[RigidTree, tuple[np.ndarray, np.ndarray], np.ndarray, TreeDynamics]:
        """The tree, how T_0_root acts on wrenches and back on twists (6, 6), scratch of the dynamics."""
        T, tree = root_in_base(self.lab.floating, self.lab.description), self.lab.tree
        T.translation += np.append(self.model.tilting.off, 0.0)  # where wheels have it
        actions = np.array(T.dualAction, order="C"), np.array(T.inverse().action, order="C")
        return tree, actions, scratch(tree), room(1, len(tree.column))

    @cached_property
    def _stream(self) -> SlipStream:
        return slip_stream(self.model)


@njit(cache=True, error_model="numpy")
def driven(
    tree: RigidTree,
    actions: tuple[np.ndarray, np.ndarray],
    gravity: np.ndarray,
    base: np.ndarray,
    moving: np.ndarray,
    work: np.ndarray,
    found: TreeDynamics,
) -> np.ndarray:
    """`SlippingBase._driven` at readings, velocities and accelerations (3, k).

    `base` (2, 3): velocities of x, y, yaw and accelerations of z, rx, ry, in its axes.
    """
    (dual, back), root, out = actions, np.zeros((1, 12)), np.zeros(9)
    for i in range(6):
        for c in range(3):
            root[0, i] += back[i, PLANE[c]] * base[0, c]
            root[0, 6 + i] += back[i, HEAVE[c]] * base[1, c] - back[i, c] * gravity[c]
    sample(tree, moving[0:1], moving[1:2], moving[2:3], root, work, found)
    for i in range(3):
        for r in range(6):
            out[i] -= dual[PLANE[i], r] * found.root[0, r]
    for k in range(6):
        i, j = _UPPER[k]
        for r in range(6):
            for c in range(6):
                out[3 + k] += dual[i, r] * found.composite[0, r, c] * back[c, j]
    return out


@njit(cache=True, error_model="numpy")
def lagged(h: np.ndarray, before: np.ndarray, lags: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """f1, f2 (2, 3) after dt [s] in which h (3,) changed evenly from `before`, and a (3,)."""
    e, after, a = np.exp(-dt / _LAG), np.empty((2, 3)), np.empty(3)
    b = 1.0 - _LAG * (1.0 - e) / dt
    for i in range(3):
        after[0, i] = e * lags[0, i] + (1.0 - e - b) * before[i] + b * h[i]
        after[1, i] = e * lags[1, i] + (1.0 - e - b) * lags[0, i] + b * after[0, i]
        a[i] = (h[i] - 2.0 * after[0, i] + after[1, i]) / _LAG**2
    return after, a


@njit(cache=True, error_model="numpy")
def accelerating(planar: np.ndarray, heaving: np.ndarray, T_lab_base: np.ndarray, turns: float) -> np.ndarray:
    """(3, 3) as of `BaseState`: a base accelerates by (3,) in the plane, (3,) in heave and tilt, and turns [rad/s]."""
    own, a = np.zeros(6), np.zeros((3, 3))
    for k in range(3):
        own[HEAVE[k]], own[PLANE[k]] = heaving[k], planar[k]
    for i in range(3):
        a[2, i] = T_lab_base[i, 2] * turns
        for c in range(3):
            a[0, i] += T_lab_base[i, c] * own[c]
            a[1, i] += T_lab_base[i, c] * own[3 + c]
    return a


@njit(cache=True, error_model="numpy")
def carried(  # noqa: PLR0913  compiled: arrays alone
    wrench: np.ndarray,
    moving: np.ndarray,
    dt: float,
    before: Earlier,
    bases: Bases,
    place: Place,
    fitted: Fitted,
    tree: RigidTree,
    dual: np.ndarray,
    back: np.ndarray,
    work: np.ndarray,
    room: TreeDynamics,
) -> tuple:
    """`SlippingBase.stepped` after the first second: fields of the states.

    Returns:
        wrench, y and u, x, lags, moved, moves of `BaseState`; row, arrays of bases, found of `SlipState`.
    """
    w, x, own, change, turn = np.zeros((1, 6)), np.empty(6), np.empty((1, 6)), np.empty(6), np.zeros((1, 4, 4))
    row, found, driving = np.empty(COLUMNS), np.empty((5, 3)), UNDRIVEN.copy()
    for i in range(6):
        for c in range(6):
            w[0, i] += place.action[i, c] * wrench[c]
    sprung, slid, base, swayed = w.copy(), np.empty((1, 3)), np.empty((2, 3)), np.empty((2, 3))
    for k in range(3):
        slid[0, k] = fitted.moves[k] * (before.found[1, k] - before.x[PLANE[k]])
    bear(place.standing, sprung, slid)
    for i in range(6):
        change[i] = sprung[0, i] - before.wrench[i]
    modes = advance_modes((place.a, place.b, place.tau), before.y, before.u, change, dt, x)
    lags, heaving = lagged(x[2:5], before.x[2:5], before.lags, dt)
    swayed[0], swayed[1] = x[2:5], heaving
    if moving.shape[1]:
        base[0], base[1] = mean_of(bases.state, VELOCITY, fitted.members), heaving
        driving = driven(tree, (dual, back), place.gravity, base, moving, work, room)
    after = Bases(bases.state.copy(), bases.wheels.copy(), bases.lanes, bases.learnt.copy())
    readings = w[0], swayed, driving, before.rest, before.row, before.found
    step_members(after, readings, fitted, before.band, dt / STEPS, row, found)
    for i in range(6):
        own[0, i] = x[i]
    for k in range(3):
        if not fitted.linear[k]:
            own[0, PLANE[k]] = found[1, k] * fitted.moves[k]
    from_vectors(own, turn)
    moved, scratch = place.T_lab_0.copy().reshape(1, 4, 4), np.empty((3, 4))
    shift(moved[0], turn[0], scratch)
    v, a = mean_of(after.state, VELOCITY, fitted.members), mean_of(after.state, ACCELERATION, fitted.members)
    a = accelerating(a, heaving, moved[0], v[2])
    shift(moved[0], place.T_0_lab, scratch)
    return sprung[0], modes, x, lags, moved, a, row, after.state, after.wheels, after.learnt, found
