"""The wrist's force-torque sensor: what hangs on it, and what pushes the hand from outside.

    p = f + w - w_0        f = I A + V x* I V

w: reading, the hand's action on the sensor; f: wrench that moves what hangs on it, the nominal links beyond the sensor
and the declared payload, of weight W, along the readings; w_0: mean of f + w in the trial's first second, in which
nothing pushes. Zeros of encoders, tolerances of masses and a base that shakes left up to 0.39 W on twenty robots that
nothing pushed: the hand is pushed in trials in which p's force, averaged over 0.4 s, exceeds 0.75 W.

What hangs on the sensor of a pushed hand is no part of the robot that its joints and its base move: it acts on them by
w - w_0, as it is pushed and as links and base truly move it, otherwise than the motors do.

A hand that nothing pushes acts on the floor by

    h = w - [f + w]        [.]: below 1 Hz, of masses, zeros and drift; what is faster is how links and base move it

with f on a base that moves, where that is known: one that slides moves the hand slower than that, too.

The sensor shows what hangs there besides, too: linear in a mass and its first moment, see `drive_trains.hung_load`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.ndimage import uniform_filter1d

from calibration.errors import NotEnoughData
from calibration.numerics.signals import RATE, Signal, even, interpolate_columns, low_passed
from calibration.recording.schema import Description
from calibration.recording.trial import REST
from calibration.robot.chain import Chain
from calibration.robot.laboratory import Laboratory
from calibration.robot.rigid_tree import RigidTree, last_wrench

_CUTOFF = 20.0  # [Hz]
_AVERAGE = 0.4  # [s]
_SLOW = 1.0  # [Hz]
_SHARE = 0.75  # of the weight: less is no push [-]
STRIDE = 4  # samples from one to the next where a push is looked for
_MASSES = "mass", "moment", "inertia"  # of the bodies of a tree


class Push(NamedTuple):
    """What acts on the last body in the place of something that hangs on it.

    Attributes:
        wrench: w - w_0 (n, 6), or h, axes and origin of the tree's last body [N, N.m].
        hung: The robot of which only what it replaces has mass.
        outside: Whether something pushes from outside.
    """

    wrench: np.ndarray
    hung: RigidTree
    outside: bool = True

    def on(self, tree: RigidTree) -> RigidTree:
        """The robot without what this replaces."""
        return tree._replace(**{name: getattr(tree, name) - getattr(self.hung, name) for name in _MASSES})


def hung_bodies(model: pin.Model, data: pin.Data, sensor: int) -> Iterator[pin.Inertia]:
    """Inertia, in world axes, of all beyond a sensor's frame: rigid parts, and bodies behind further joints."""
    for k, frame in enumerate(model.frames):
        if k == sensor or not hangs(model, k, sensor):
            continue
        if frame.type == pin.FrameType.JOINT:
            yield data.oMi[frame.parentJoint].act(model.inertias[frame.parentJoint])
        elif frame.parentJoint == model.frames[sensor].parentJoint:
            yield data.oMf[k].act(frame.inertia)


def hangs(model: pin.Model, frame: int, sensor: int) -> bool:
    """Whether a frame is the sensor's or hangs on it."""
    while frame not in (0, sensor):
        frame = model.frames[frame].parentFrame
    return frame == sensor


@dataclass(frozen=True)
class WristSensor:
    """The sensor of a robot with the payload in its hand.

    Attributes:
        tree: The robot of which only what hangs on the sensor has mass.
        chain: To the sensor.
        link: Its frame.
        root: (4, 4) the base frame in the tree's root.
        body: (4, 4) the sensor's frame in the last body of the tree.
        at_rest: (1, 12) twist and proper acceleration of a root at rest.
    """

    tree: RigidTree
    chain: Chain
    link: str
    root: np.ndarray
    body: np.ndarray
    at_rest: np.ndarray

    def push(self, t: np.ndarray, read: "SmoothReadings") -> Push | None:
        """What a hand that is pushed does to the sensor at t (n,) [s], by its readings; None: nothing pushes it."""
        limit = _SHARE * float(self.tree.mass[-1] * np.linalg.norm(self.at_rest[0, 6:9]))
        few = read.thinned(STRIDE)
        p = self.moved(few) + few.wrench
        zero = p[few.t <= few.t[0] + REST].mean(axis=0)
        force = uniform_filter1d(p[:, :3] - zero[:3], int(_AVERAGE * RATE / STRIDE), axis=0)
        if np.linalg.norm(force, axis=1).max() <= limit:
            return None
        return Push(self._on_body(t, read.t, read.wrench - zero), self.tree)

    def hand(self, t: np.ndarray, read: "SmoothReadings", nominal: RigidTree, base: np.ndarray | None = None) -> Push:
        """h of a hand that nothing pushes, in the place of what nominally hangs there.

        `base` (n, 12) is twist and proper acceleration of the root at t; None: it is at rest.
        """
        off = self.moved(read, None if base is None else interpolate_columns(read.t, t, base)) + read.wrench
        slow = low_passed(Signal(read.t, off, np.ones(len(off), dtype=bool)), _SLOW).x
        return Push(self._on_body(t, read.t, read.wrench - slow), nominal, outside=False)

    def lacking(self, n: int) -> Push:
        """What hangs on the sensor where a robot has too much of it, as n samples have it."""
        return Push(np.zeros((n, 6)), self.tree, outside=False)

    def beyond(self, read: "SmoothReadings") -> tuple[np.ndarray, np.ndarray]:
        """-(w + f) (n, 6), and the regressor (n, 6, 4) of -w by mass and first moment, axes of the last body.

        Moments about the centre of what nominally hangs there: gears that sag turn its weight, which has none there.
        """
        Y = np.stack([self.alone(unit).moved(read) for unit in np.eye(4)], axis=2)
        about = np.eye(6)
        about[3:, :3] = -pin.skew(pin.SE3(self.body).actInv(self.tree.moment[-1] / self.tree.mass[-1]))
        return -(read.wrench + self.moved(read)) @ about.T, about @ Y

    def carrying(self, more: np.ndarray) -> "WristSensor":
        """The sensor with a further mass and its first moment (4,) on it."""
        tree = self.tree._replace(mass=self.tree.mass.copy(), moment=self.tree.moment.copy())
        tree.mass[-1] += more[0]
        tree.moment[-1] += more[1:]
        return replace(self, tree=tree)

    def alone(self, what: np.ndarray) -> "WristSensor":
        """The sensor with a mass and its first moment (4,) on it alone."""
        bare = {n: np.zeros_like(getattr(self.tree, n)) for n in _MASSES}
        return replace(self, tree=self.tree._replace(**bare)).carrying(what)

    def _on_body(self, t: np.ndarray, at: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """A wrench in the last body's axes, at other times."""
        return interpolate_columns(t, at, wrench @ pin.SE3(self.body).dualAction.T)

    def moved(self, at: "SmoothReadings", base: np.ndarray | None = None) -> np.ndarray:
        """f (n, 6) in the sensor's axes about its origin, on a root that moves (n, 12) or is at rest."""
        root = self.at_rest if base is None else base
        w = last_wrench(self.tree, at.q, at.v, at.a, root)
        T = self.root @ self.chain.poses(at.q[:, self.chain.columns], self.link)
        R, moment = T[:, :3, :3], w[:, 3:] - np.cross(T[:, :3, 3], w[:, :3])
        f = [(w[:, None, :3] @ R)[:, 0], (moment[:, None] @ R)[:, 0]]
        return np.concatenate(f, axis=1)


class SmoothReadings(NamedTuple):
    """Readings below 20 Hz, evenly sampled.

    Attributes:
        t: (n,) [s].
        q: (n, k) of the motors [rad, m].
        v: Their velocities.
        a: Their accelerations.
        wrench: (n, 6) of the sensor.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    wrench: np.ndarray

    def thinned(self, stride: int) -> "SmoothReadings":
        """One sample of so many."""
        return SmoothReadings(*(x[::stride] for x in self))


def smoothed(t: np.ndarray, q: np.ndarray, wrench: np.ndarray) -> SmoothReadings:
    """Of motors q (n, k) and the sensor (n, 6).

    Raises:
        NotEnoughData: Less than a second of samples.
    """
    found, k = low_passed(even(t, np.hstack([q, wrench])), _CUTOFF), q.shape[1]
    v = np.gradient(found.x[:, :k], 1.0 / RATE, axis=0)
    return SmoothReadings(found.t, found.x[:, :k], v, np.gradient(v, 1.0 / RATE, axis=0), found.x[:, k:])


@lru_cache(maxsize=8)
def wrist_sensor(urdf: str, description: Description) -> WristSensor | None:
    """The sensor of a robot with its payload; None where no frame of the last body is declared for one."""
    link, lab = description.wrist_link, Laboratory(urdf, description)
    if link is None:
        return None
    reduced, whole = lab.floating, pin.buildModelFromXML(urdf)
    frame, data, sensor = reduced.frames[reduced.getFrameId(link)], whole.createData(), whole.getFrameId(link)
    if frame.parentJoint != reduced.njoints - 1:
        return None
    pin.framesForwardKinematics(whole, data, pin.neutral(whole))
    hung = pin.Inertia.Zero()
    for part in hung_bodies(whole, data, sensor):
        hung += part
    payload = description.payload
    if payload is not None and hangs(whole, whole.getFrameId(payload.link), sensor):
        box = pin.Inertia(payload.mass, np.array(payload.com), np.zeros((3, 3)))
        hung += data.oMf[whole.getFrameId(payload.link)].act(box)
    hung = frame.placement.act(data.oMf[sensor].actInv(hung))
    tree = lab.tree._replace(**{n: np.zeros_like(getattr(lab.tree, n)) for n in _MASSES})
    tree.mass[-1], tree.moment[-1], tree.inertia[-1] = hung.mass, hung.mass * hung.lever, hung.matrix()[3:, 3:]
    base = reduced.frames[reduced.getFrameId(description.base_frame)].placement
    gravity = base.rotation @ np.array(description.gravity)
    at_rest = np.concatenate([np.zeros(6), -gravity, np.zeros(3)])[None]
    return WristSensor(tree, lab.chain, link, base.homogeneous, frame.placement.homogeneous, at_rest)


def hand_push(urdf: str, description: Description, t: np.ndarray, q: np.ndarray, wrench: np.ndarray) -> Push | None:
    """`WristSensor.push` of a robot with its payload; None without readings or a sensor, or where nothing pushes."""
    sensor = wrist_sensor(urdf, description) if np.isfinite(wrench).any() else None
    try:
        return None if sensor is None else sensor.push(t, smoothed(t, q, wrench))
    except NotEnoughData:
        return None
