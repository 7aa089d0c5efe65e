"""What moves the links in a trial: motor positions, velocities, accelerations, torques and inertias of all joints.

    tau = M(q) a + C(q, v) v + g(q)        nominal inverse dynamics with the trial's payload       [N.m, N]
    tau + R(q, v, a) dphi                  of other masses and first moments (m, m c) by body [kg, kg.m], a tilt of the
                                           base about x and y [rad], and bending of the first joint's column [rad/(N.m)]

at angles q_m - offset. The base is level and at rest, or moves as its markers show: its proper acceleration a_0
(gravity included) is that of the tree's root. A tilt u turns a_0 by -u x a_0; a column that bends turns all it
carries by its compliance times the moment of what it carries. 5 mrad are a fifth of a newton metre at the shoulder.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg import block_diag
from scipy.ndimage import uniform_filter1d

from calibration.errors import NotEnoughData
from calibration.mocap.cluster_pose import poses_of
from calibration.numerics.lie import from_vector, inverse, mean, to_vector
from calibration.numerics.signals import RATE, Signal, even, low_passed
from calibration.recording.clock import Clock
from calibration.recording.schema import Description
from calibration.recording.trial import Trial
from calibration.robot.floating_base import floating_model

CUTOFF = 20.0  # [Hz] of motor accelerations; starts and stops last a tenth of a second
_SLOW, _FAST = 5.0, 12.0  # [Hz] of the base's, from markers: at all times, and where it is jolted
_JOLT = 0.15  # [s] over which the energy of a jolt is compared with the noise
_ROOT = 6  # velocities of the floating base
_TILTS = 3  # columns of tilt and bending
_TILT, _BENDING = 5e-3, 1e-4  # [rad], [rad/(N.m)] their prior standard deviations


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
        inertia: M_jj [kg.m2, kg].
        regressor: (n, k, p) R of the parameters dphi; p = 0 where not asked for.
        moment: (n, 2) about x and y of the first joint's frame, that its column bears [N.m].
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


@dataclass(frozen=True)
class Dynamics:
    """The nominal robot that turns motions into torques.

    Attributes:
        model: Floating model with a payload, gravity in its root's acceleration.
        joints: Names of the k measured joints.
        offset: (k,) zeros of the motor readings [rad, m].
        gravity: (3,) in the base [m/s2].
    """

    model: pin.Model
    joints: tuple[str, ...]
    offset: np.ndarray
    gravity: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """(k,) velocity index of each measured joint."""
        return np.array([self.model.joints[self.model.getJointId(name)].idx_v for name in self.joints])

    def loads(
        self, trial_id: str, t: np.ndarray, q: np.ndarray, base: np.ndarray | None = None, regressors: bool = False
    ) -> LinkLoads:
        """Loads at motor readings q (n, k) taken at t (n,) [s], without NaN; `base` (n, 6) as `base_acceleration`."""
        smooth, v, a = derivatives(t, q, CUTOFF)
        return LinkLoads(trial_id, t, q, smooth - self.offset, v, a, *self.evaluated(smooth, v, a, base, regressors))

    def evaluated(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: np.ndarray | None, regressors: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Torques and inertias (n, k), regressors (n, k, p), moments (n, 2) at readings and derivatives (n, k)."""
        data, columns = self.model.createData(), self.columns
        wanted = regressor_columns(self.model) if regressors else np.zeros(0, dtype=int)
        p = len(inertials(self)) if regressors else 0
        torque, inertia = np.empty(q.shape), np.empty(q.shape)
        R, moment = np.empty((*q.shape, p)), np.empty((len(q), 2))
        for i in range(len(q)):
            proper = None if base is None else base[i]
            torque[i], inertia[i], R[i], moment[i] = self.at(data, columns, wanted, q[i], v[i], a[i], proper)
        return torque, inertia, R, moment

    def at(
        self, data: pin.Data, columns: np.ndarray, wanted: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray,
        base: np.ndarray | None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """The same (k,), (k,), (k, p), (2,) of one sample; `columns` and `wanted` as of `evaluated`, `data` scratch."""
        model = self.model
        at, rate, push = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)
        at[_ROOT] = 1.0
        at[columns + 1], rate[columns], push[columns] = q - self.offset, v, a
        if base is None:
            push[:3] = -self.gravity
        else:
            push[:_ROOT] = base
        torque = pin.rnea(model, data, at, rate, push)[columns]
        load = data.f[2].angular[:2]
        H = pin.crba(model, data, at)
        inertia = H.diagonal()[columns]
        if not len(wanted):
            return torque, inertia, np.zeros((len(q), 0)), load
        R = np.empty((len(q), len(wanted) + _TILTS))
        R[:, :-_TILTS] = pin.computeJointTorqueRegressor(model, data, at, rate, push)[columns[:, None], wanted]
        x, y, z = push[:3]
        turned = np.array([[0.0, -z], [z, 0.0], [-y, x]])  # a_0 x e of both axes
        tilt = H[:3, columns].T @ turned
        R[:, -_TILTS:-1], R[:, -1] = tilt, -tilt @ load
        return torque, inertia, R, load


def dynamics(urdf: str, description: Description, offset: np.ndarray) -> Dynamics:
    """The nominal robot of a dataset with its declared payload and the zeros (k,) of its motor readings."""
    model = floating_model(urdf, description)
    model.gravity = pin.Motion.Zero()
    return Dynamics(model, description.joint_names, offset, np.array(description.gravity))


def regressor_columns(model: pin.Model) -> np.ndarray:
    """Columns of mass and first moments of every body beyond the root in a joint-torque regressor."""
    bodies = np.arange(1, model.njoints - 1)
    return (10 * bodies[:, None] + np.arange(4)).ravel()


def inertials(robot: Dynamics) -> tuple[tuple[str, str], ...]:
    """(joint that carries the body, `m`, `mx`, `my` or `mz`) of each parameter dphi; then tilts and bending."""
    bodies = tuple((name, what) for name in list(robot.model.names)[2:] for what in ("m", "mx", "my", "mz"))
    return (*bodies, ("base", "tilt_x"), ("base", "tilt_y"), (robot.model.names[2], "bending"))


def inertial_tolerances(robot: Dynamics, mass: float, centre: float) -> np.ndarray:
    """Covariance (p, p) of dphi: masses to a share `mass` [-], centres of mass to `centre` [m]."""
    blocks = []
    for body in robot.model.inertias[2:]:
        J = np.append(1.0, body.lever)[:, None]
        C = (mass * body.mass) ** 2 * (J @ J.T)
        C[1:, 1:] += (centre * body.mass) ** 2 * np.eye(3)
        blocks.append(C)
    return np.asarray(block_diag(*blocks, np.diag([_TILT**2, _TILT**2, _BENDING**2])))


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


def base_acceleration(description: Description, trial: Trial, robot: Clock, T_base_B: np.ndarray) -> np.ndarray | None:
    """Proper acceleration (n, 6) of the base at the trial's robot times, linear [m/s2] and angular [rad/s2], its axes.

    From the base's markers, T_base_B (4, 4) the pose of their body; None where they are not seen.
    """
    try:
        T = poses_of(description.base_body, trial).T @ inverse(T_base_B)
    except NotEnoughData:
        return None
    seen = np.isfinite(T).all(axis=(1, 2))
    if seen.sum() < RATE or description.marker_frame != "lab":
        return None
    middle = mean(T[seen])
    seen_at = even(trial.t_mocap, to_vector(inverse(middle) @ T))
    moved = low_passed(seen_at, _SLOW)
    a = _accelerations(seen_at)
    R = (middle @ from_vector(moved.x))[:, :3, :3]
    turned = np.swapaxes(from_vector(moved.x)[:, :3, :3], 1, 2)
    proper = (turned @ a[:, :3, None])[..., 0] - np.swapaxes(R, 1, 2) @ np.array(description.gravity)
    columns = np.concatenate([proper, a[:, 3:]], axis=1).T
    return np.stack([np.interp(robot.to_mocap(trial.t_robot), moved.t, c) for c in columns], axis=1)


def _accelerations(x: Signal) -> np.ndarray:
    """Second derivatives (n, c) below `_SLOW`, and below `_FAST` where what is between them exceeds its noise.

    Noise is what is usual there; the share kept is Wiener's, 1 - noise / energy.
    """
    slow, fast = (
        np.gradient(np.gradient(low_passed(x, cutoff).x, 1.0 / RATE, axis=0), 1.0 / RATE, axis=0)
        for cutoff in (_SLOW, _FAST)
    )
    width = int(_JOLT * RATE)
    energy = uniform_filter1d((fast - slow) ** 2, width, axis=0)
    noise = 2.0 * np.median(energy, axis=0)
    return np.asarray(slow + np.clip(1.0 - noise / np.maximum(energy, np.finfo(float).tiny), 0.0, 1.0) * (fast - slow))
