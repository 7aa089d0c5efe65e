"""What moves the links in a trial: motor positions, velocities, accelerations, torques and inertias of all joints.

    tau = M(q) a + C(q, v) v + g(q) - J' p        nominal inverse dynamics with the trial's payload       [N.m, N]
                                           p what a pushed hand does to the wrist's sensor; what hangs on it is no
                                           part of the robot then, see `robot.wrist_sensor`
    tau + R(q, v, a) dphi                  of other masses and first moments (m, m c) by body [kg, kg.m], a tilt of the
                                           base about x and y [rad], and bending of the first joint's column [rad/(N.m)]

at angles q_m - offset and the joint placements found. The base is level and at rest, or moves as its markers or a
prediction show: how it turns and its proper acceleration a_0 (gravity included) are those of the tree's root. A tilt u
turns a_0 by -u x a_0; a column that bends turns all it carries by -c (M - M_0), M the moment of what it carries. 5 mrad
are a fifth of a newton metre at the shoulder.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.linalg import block_diag
from scipy.ndimage import uniform_filter1d

from calibration.errors import NotEnoughData
from calibration.numerics.lie import from_vector, inverse, mean, to_vector
from calibration.numerics.signals import RATE, Signal, even, interpolate_columns, low_passed
from calibration.recording.schema import Description
from calibration.robot.laboratory import floating_model
from calibration.robot.rigid_tree import RigidTree, tree_of
from calibration.robot.tree_dynamics import dynamics_along
from calibration.robot.wrist_sensor import Push
from calibration.stages.drive_trains.hung_load import HungLoad, inertial_tolerance

CUTOFF = 20.0  # [Hz] of motor accelerations; starts and stops last a tenth of a second
_BANDS = 5.0, 12.0, 20.0  # [Hz] of the base's: at all times, and where a jolt exceeds the noise
_BY_PLATE = 10.0, 20.0  # the same of a base that a plate's wrench moves
_JOLT = 0.15  # [s] over which the energy of a jolt is compared with the noise
_MOST, _LEAST = 6, 0.005  # modes, and the least torque [N.m rms] one is worth: fewer make a load too large or small
_THINNED = 10  # samples between those the modes are of
_TILT, _BENDING, _BENT = 2e-4, 1e-4, 0.05  # [rad], [rad/(N.m)], and of a known column [-]: their standard deviations


@dataclass(frozen=True)
class LinkLoads:
    """What moves the links in a trial, all (n, k) unless stated otherwise.

    Attributes:
        trial_id: The trial.
        t: (n,) [s, robot clock].
        q: Motor readings [rad, m].
        angle: q without the zeros of the readings.
        v: Motor velocities.
        a: Motor accelerations.
        torque: tau [N.m, N].
        inertia: (n, k + 2, k + 2) M, of the column's leans, too [kg.m2, kg.m, kg]; of a pushed hand, without that.
        regressor: (n, k, p) R of the parameters dphi;
        moment: (n, 2) about x and y of the first joint's frame, that its column bears [N.m].
        stiffness: (n, k + 2, k + 2) G, how tau grows with the joints' positions [N.m/rad, N].
        coupling: (n, k + 2, 6) wrench on the tree's root by unit acceleration of each joint and lean.
        friction: (k,) s of each joint, see `friction_shown`; empty: all 1.
        heavier: Whether the payload is heavier than the campaign's, and its load new to a joint.
    """

    trial_id: str
    t: np.ndarray
    q: np.ndarray
    angle: np.ndarray
    v: np.ndarray
    a: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    regressor: np.ndarray
    moment: np.ndarray
    stiffness: np.ndarray
    coupling: np.ndarray
    friction: np.ndarray = field(default_factory=lambda: np.ones(0))
    heavier: bool = False

    def behind(self, delta: np.ndarray) -> "LinkLoads":
        """Loads of links that are delta (n, k) [rad] behind their motors; its own acceleration is still its motor's.

        tau_i - sum_j G_ij delta_j - sum_(j != i) M_ij d2 delta_j / dt2
        """
        a, k = derivatives(self.t, delta, CUTOFF)[2], delta.shape[1]
        M, G = self.inertia[:, :k, :k], self.stiffness[:, :k, :k]
        moved = (M @ a[..., None])[..., 0] - np.einsum("nii,ni->ni", M, a)
        return replace(self, torque=self.torque - (G @ delta[..., None])[..., 0] - moved)


class Column(NamedTuple):
    """How the column that carries the arm leans under a moment M (n, 2) [N.m] about x and y: by -c (M - M_0) [rad].

    Attributes:
        compliance: (2,) c [rad/(N.m)].
        mean: (2,) M_0, at which joint placements have the column as it stands [N.m].
    """

    compliance: np.ndarray
    mean: np.ndarray

    def leans(self, moment: np.ndarray) -> np.ndarray:
        """(n, 2) [rad] under moments (n, 2) [N.m]."""
        return np.asarray(self.compliance * (self.mean - moment))


STIFF = Column(np.zeros(2), np.zeros(2))
UNWEIGHED = np.zeros((0, 0))


LoadsUnder = Callable[[Push | None, np.ndarray | None], LinkLoads]
"""Loads by what pushes the hand, and by about how far (n, k) links are behind their motors."""


@dataclass(frozen=True)
class Dynamics:
    """The nominal robot that turns motions into torques.

    Attributes:
        model: Floating model with a payload, gravity in its root's acceleration.
        joints: Names of the k measured joints.
        offset: (k,) zeros of the motor readings [rad, m].
        gravity: (3,) in the base [m/s2].
        column: That carries the arm.
    """

    model: pin.Model
    joints: tuple[str, ...]
    offset: np.ndarray
    gravity: np.ndarray
    column: Column = STIFF

    @cached_property
    def tree(self) -> RigidTree:
        """The model made ready for its dynamics."""
        return tree_of(self.model, self.joints)

    def loads(
        self,
        trial_id: str,
        t: np.ndarray,
        q: np.ndarray,
        base: np.ndarray | None = None,
        push: Push | None = None,
        delta: np.ndarray | None = None,
    ) -> LinkLoads:
        """Loads at motor readings q (n, k) taken at t (n,) [s], without NaN.

        `base` (n, 12) as `base_motion` has it, `push` on the hand, `delta` (n, k) as of `evaluated`.
        """
        smooth, v, a = derivatives(t, q, CUTOFF)
        found = self.evaluated(smooth, v, a, base, push, delta)
        return LinkLoads(trial_id, t, q, smooth - self.offset, v, a, *found)

    def evaluated(  # noqa: PLR0913
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: np.ndarray | None, push: Push | None = None,
        delta: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """Torques, inertias, regressors, moments, stiffnesses and couplings, see `LinkLoads`, at readings (n, k).

        Where links are about delta (n, k) behind their motors, torques are tau(q - delta) + G delta: those that, less G
        times what links are behind, are right there, a push in the axes of the hand included.
        """
        delta = np.zeros(q.shape) if delta is None else delta
        root, tree = self.root(base), self.tree
        if push is not None:
            root, tree = np.concatenate([np.broadcast_to(root, (len(q), 12)), push.wrench], axis=1), push.on(tree)
        found = dynamics_along(tree, q - delta - self.offset, v, a, root, True)
        k = q.shape[1]
        torque = found.torque + (found.stiffness[:, :k, :k] @ delta[..., None])[..., 0]
        a_0, pull = root[:, None, 6:9], found.coupling[:, :k]  # a_0 x e of both axes
        tilt = np.stack(
            [
                pull[..., 1] * a_0[..., 2] - pull[..., 2] * a_0[..., 1],
                pull[..., 2] * a_0[..., 0] - pull[..., 0] * a_0[..., 2],
            ],
            axis=2,
        )
        bending = -(tilt @ found.moment[..., None])
        torque += (tilt @ self.column.leans(found.moment)[..., None])[..., 0]
        R = np.concatenate([found.regressor, tilt, bending], axis=2)
        return torque, found.inertia, R, found.moment, found.stiffness, found.coupling

    def root(self, base: np.ndarray | None) -> np.ndarray:
        """The base (n, 12) as of `loads`; level and at rest (1, 12) where it is not known."""
        return np.concatenate([np.zeros(6), -self.gravity, np.zeros(3)])[None] if base is None else base


def dynamics(
    urdf: str, description: Description, offset: np.ndarray, hung: HungLoad | None = None, column: Column = STIFF
) -> Dynamics:
    """The robot of a dataset with its declared payload, what else hangs there, and the zeros (k,) of its readings."""
    model = floating_model(urdf, description)
    model.gravity = pin.Motion.Zero()
    if hung is not None:
        hung.on(model, description.payload_of())
    return Dynamics(model, description.joint_names, offset, np.array(description.gravity), column)


def inertials(robot: Dynamics) -> tuple[tuple[str, str], ...]:
    """(joint that carries the body, `m`, `mx`, `my` or `mz`) of each parameter dphi; then tilts and bending."""
    bodies = tuple((name, what) for name in list(robot.model.names)[2:] for what in ("m", "mx", "my", "mz"))
    return (*bodies, ("base", "tilt_x"), ("base", "tilt_y"), (robot.model.names[2], "bending"))


def inertial_tolerances(
    robot: Dynamics, mass: float, centre: float, hung: HungLoad | None = None, weighed: np.ndarray = UNWEIGHED
) -> np.ndarray:
    """Covariance (p, p) of dphi.

    Args:
        robot: With the masses that are likely.
        mass: Share to which the datasheet has them [-].
        centre: To which it has centres of mass [m].
        hung: On the wrist's sensor.
        weighed: (4 b, 4 b) of the masses' shares and the centres' shifts of b bodies, the root's first, by a plate; the
            last one's is as far as the sensor knows it.
    """
    bodies = [np.append(body.mass, body.mass * body.lever) for body in robot.model.inertias[2:]]
    last = bodies[-1] if hung is None else bodies[-1] - hung.nominal - hung.added(hung.payload)
    tolerances = [inertial_tolerance(body, mass, centre) for body in (*bodies[:-1], last)]
    if hung is not None:
        tolerances[-1] = tolerances[-1] + hung.uncertain
    C, others = block_diag(*tolerances), slice(0, 4 * len(bodies) - 4)
    if len(weighed):
        J = block_diag(*(np.column_stack([body, body[0] * np.eye(4)[:, 1:]]) for body in bodies[:-1]))
        C[others, others] = J @ weighed[4:-4, 4:-4] @ J.T
    bends = _BENT * float(robot.column.compliance.max()) or _BENDING
    return np.asarray(block_diag(C, np.diag([_TILT**2, _TILT**2, bends**2])))


def derivatives(t: np.ndarray, q: np.ndarray, cutoff: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, its velocity and acceleration (n, k) below `cutoff` [Hz] at t (n,), zero-phase.

    Raises:
        NotEnoughData: Less than a second of samples.
    """
    smooth = low_passed(even(t, q), cutoff)
    v = np.gradient(smooth.x, 1.0 / RATE, axis=0)
    found = smooth.x, v, np.gradient(v, 1.0 / RATE, axis=0)

    n, k = len(t), q.shape[1]
    out = np.array([[np.interp(t, smooth.t, c) for c in x.T] for x in found]).reshape(3, k, n)
    return out[0].T.copy(), out[1].T.copy(), out[2].T.copy()


def base_motion(
    gravity: np.ndarray, t: np.ndarray, T_lab_root: np.ndarray, at: np.ndarray, by_plate: bool = False
) -> np.ndarray | None:
    """Twist and proper acceleration (n, 12) of the tree's root at times `at` (n,), linear first, its axes.

    Seen from where the root's origin is at rest: how fast it is [m/s] moves no joint, how fast it turns [rad/s] does.

    Args:
        gravity: (3,) in the lab [m/s2].
        t: (m,) [s, the clock of `at`].
        T_lab_root: (m, 4, 4) its poses, measured or predicted, NaN where not known; of less than a second of them the
            tilt alone, and None where there are none.
        at: Times.
        by_plate: Whether a plate's wrench predicts the poses: it says faster than markers or inverse dynamics how they
            accelerate.
    """
    seen = np.isfinite(T_lab_root).all(axis=(1, 2))
    if not seen.any():
        return None
    middle = mean(T_lab_root[seen])
    try:
        seen_at = even(t, to_vector(inverse(middle) @ T_lab_root))
    except NotEnoughData:
        return np.tile(np.concatenate([np.zeros(6), -gravity @ middle[:3, :3], np.zeros(3)]), (len(at), 1))
    bands = _BY_PLATE if by_plate else _BANDS
    moved = from_vector(low_passed(seen_at, bands[0]).x)[:, :3, :3]
    a = _accelerations(seen_at, bands)
    linear = a[:, :3] - (gravity @ middle[:3, :3])
    turns = np.gradient(low_passed(seen_at, bands[-1]).x[:, 3:], 1.0 / RATE, axis=0)
    columns = np.concatenate([0.0 * turns, turns, (linear[:, None] @ moved)[:, 0], a[:, 3:]], axis=1)
    return interpolate_columns(at, seen_at.t, columns)


def _accelerations(x: Signal, bands: Sequence[float]) -> np.ndarray:
    """Second derivatives (n, c) below the first of `bands` [Hz], and from each to the next where they exceed its noise.

    Noise is what is usual in a band; the share kept is Wiener's, 1 - noise / energy.
    """
    found, *faster = (
        np.gradient(np.gradient(low_passed(x, cutoff).x, 1.0 / RATE, axis=0), 1.0 / RATE, axis=0) for cutoff in bands
    )
    for band in np.diff([found, *faster], axis=0):
        energy = uniform_filter1d(band**2, int(_JOLT * RATE), axis=0)
        noise = 2.0 * np.median(energy, axis=0)
        found = found + np.clip(1.0 - noise / np.maximum(energy, np.finfo(float).tiny), 0.0, 1.0) * band
    return np.asarray(found)


def load_modes(loads: Sequence[LinkLoads], column: int, root: np.ndarray) -> np.ndarray:
    """Directions (p, z) of the inertial parameters that move a joint's torque most; root (p, p) of their covariance."""
    R = np.concatenate([of_trial.regressor[::_THINNED, column] for of_trial in loads]) @ root
    _, size, V = np.linalg.svd(R, full_matrices=False)
    z = min(_MOST, int((size / np.sqrt(len(R)) > _LEAST).sum()))
    return np.asarray(root @ V[:z].T)
