"""The base on its wheels alone, driven by a wrench that a force plate has measured.

    floor's reaction = -w(t)

The plate measures the weight and inertia of the whole robot. So what is driven has neither: gravity is off, the upper
body is gone, and of the base a few kilograms are left for the integrator; its modes then lie above 50 Hz, and what
remains below is the wheels' springs, dampers and friction. w acts on the base frame's origin as it moves: less than
1 N.m of moment while the base moves by less than a millimetre. A wrench that friction cannot hold moves the base
without end: no force stops it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout
from scipy.spatial.transform import Rotation

import mjcf
from twin.defects.defect import Defect
from twin.defects.wheels.base import Base, ground, wheels_of
from twin.errors import Diverged
from twin.simulation.base_joint import ROOT, base_poses, place_base
from twin.simulation.build import Twin, build
from twin.transforms import states_with_their_sensors, transform

SETTLE = 2.0  # [s] under the first wrench, before it
_RISE = 0.5  # [s] in which that is put on
_MASS, _INERTIA = 2.0, 0.05  # of what is left of the base [kg, kg.m2]
_PLACE = (0.9, 0.45, 0.0)  # on the plate [m, lab]


def massless_base(base: Base, timestep: float = 0.001) -> Twin:
    """Base and wheels without weight; no value of `base` may be uncertain."""
    return massless_base_on(ground(base, wheels_of(base)), timestep)


def massless_base_on(floor: Sequence[Defect], timestep: float = 0.001) -> Twin:
    """The base without weight on wheels of their own."""
    spec = mjcf.spec()
    for element in (*spec.actuators, *spec.keys):
        spec.delete(element)
    spec.delete(spec.body("torso_fixed_link"))
    chassis = spec.body("base_link")
    chassis.mass, chassis.fullinertia = _MASS, np.full(6, np.nan)
    chassis.ipos = -np.asarray(chassis.pos)  # the base frame's origin: MuJoCo pulls at the centre of mass
    chassis.iquat, chassis.inertia = np.array([1.0, 0.0, 0.0, 0.0]), np.full(3, _INERTIA)
    spec.option.gravity = np.zeros(3)
    return build(spec, floor, timestep=timestep)


@dataclass(frozen=True)
class WrenchHistory:
    """A wrench on the base.

    Attributes:
        t: (n,) [s].
        w: (n, 6) action on the floor, about and in the base frame at rest [N, N.m].
    """

    t: np.ndarray
    w: np.ndarray


def replay(twin: Twin, pull: WrenchHistory) -> np.ndarray:
    """Displacement (n, 6) [m, rad] of the base frame since pull.t[0], in the base frame of then.

    Args:
        twin: A `carriage`.
        pull: The wrench; its first value acts for `SETTLE` before.

    Raises:
        Diverged: A state is not finite.
    """
    model, data = place_base(twin.model, transform(np.array(_PLACE), np.array([1.0, 0.0, 0.0, 0.0])))
    t = np.arange(-SETTLE, pull.t[-1] - pull.t[0], model.opt.timestep)
    w = np.stack([np.interp(t, pull.t - pull.t[0], column) for column in pull.w.T], axis=1)
    w *= np.clip((t + SETTLE) / _RISE, 0.0, 1.0)[:, None]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    first = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, first, kind)
    pulled = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)
    states, _ = rollout.rollout(model, data, first[None], _forces(model, w)[None], control_spec=pulled)
    states = states_with_their_sensors(first, states[0])
    bad = np.argwhere(~np.isfinite(states))
    if len(bad):
        raise Diverged("replay", float(t[bad[0][0]]), ROOT)
    T = base_poses(model, states[:, 1 : 1 + model.nq])
    moved = np.linalg.solve(T[np.searchsorted(t, 0.0)], T)
    x = np.hstack([moved[:, :3, 3], Rotation.from_matrix(moved[:, :3, :3]).as_rotvec()])
    return np.stack([np.interp(pull.t - pull.t[0], t, column) for column in x.T], axis=1)


def _forces(model: mujoco.MjModel, w: np.ndarray) -> np.ndarray:
    """Forces (n, 6 nbody) on all bodies; MuJoCo pulls at centres of mass."""
    force, base = np.zeros((len(w), model.nbody, 6)), model.body(ROOT)
    force[:, base.id] = w
    force[:, base.id, 3:] -= np.cross(base.ipos, w[:, :3])
    return force.reshape(len(w), -1)
