"""Load and release test of a base, as a workshop would do it: small known wrenches, read the deflection.

    load:     S = [x_j] [w_j]^-1,  K_total = S^-1                 x_j half the change between w_j and -w_j, at rest
    gravity:  K_total = K + g K',  so that loads at two gravities separate K and K_gravity = g K'
    release:  K_total int(phi x) = C (x_0 + int(dphi/dt x)),     phi = (1 - s)^2 (1 + 2 s - 15 s^2),  s = t / T

about base_footprint's origin at rest, in its axes, linear then angular. The last line weighs M x'' + C x' + K x = 0
with a slow phi: phi(0) = 1, phi'(0) = phi(1) = phi'(1) = 0, so that masses come in by 36 / (omega T)^2 only, 0.3 % at
4 Hz; its integral is zero, so that the nanometres friction leaves do not count. Positions are taken where the
integrator evaluates the springs, at the start of each step. Loads are followed under a damping towards the lab, which
is gone where nothing moves; the release is without it. The upper body is fixed.
"""

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout
from scipy.spatial.transform import Rotation

from twin.defects.wheels.stiffness import HELD
from twin.errors import TwinError
from twin.simulation.base_joint import ROOT, base_poses, place_base
from twin.simulation.build import Twin
from twin.transforms import transform

FORCE, MOMENT = 2.0, 0.5  # [N], [N.m]
_WRENCHES = np.diag([FORCE] * 3 + [MOMENT] * 3)
_OIL = 15.0  # [1/s] rate at which the damping of the test takes motion out, below the slowest mode's frequency
_SETTLE, _LOAD, _RELEASE = 2.0, 0.9, 5.0  # [s]
_HEAVIER = 1.5  # share of gravity at which the load test is repeated; less might let a wheel slip
_INERTIA, _DAMPING = 1e5, 1e7  # of joints that are fixed [kg.m2, N.m.s/rad]
_RIGID = np.array([2e-8] * 3 + [1e-6] * 3)  # compliance that counts as none [m/N, rad/(N.m)]
_RELEASES, _LATE = 4, 200  # releases until rest, at most; samples in which rest is judged
_UNEVEN = 0.01  # share by which a deflection may differ from its opposite, or from what it was a little earlier
_LATER = 0.1  # [s]
_AT_REST = 1e-3  # share of a deflection that may be left after a release


class LoadTestFailed(TwinError):
    """A base that does not come to rest, slips, or does not move, under a test load."""


class Stiffness(NamedTuple):
    """What a load test finds.

    Attributes:
        K: (6, 6) stiffness of the suspension [N/m, N, N.m/rad]; infinite on the diagonal where nothing is compliant.
        K_gravity: (6, 6) what weight and preload add to it.
    """

    K: np.ndarray
    K_gravity: np.ndarray


@dataclass(frozen=True)
class Bench:
    """A robot on the test bench, its upper body fixed.

    Attributes:
        model: In oil: the base is damped towards the lab.
        bare: Without that damping.
        hold: Forces (nv,) that carry the upper body.
        rest: State at rest.
    """

    model: mujoco.MjModel
    bare: mujoco.MjModel
    hold: np.ndarray
    rest: np.ndarray

    def run(self, model: mujoco.MjModel, state: np.ndarray, wrench: np.ndarray, duration: float) -> np.ndarray:
        """States (n, ns) after each step under a constant wrench (6,) on the base, its axes at rest, at its origin."""
        force, base = np.zeros((model.nbody, 6)), model.body(ROOT)
        pull, turn = wrench.reshape(2, 3) - [np.zeros(3), np.cross(base.ipos, wrench[:3])]  # at the centre of mass
        (T_lab_rest,) = base_poses(model, self.rest[None, 1 : 1 + model.nq])
        force[base.id] = np.concatenate([T_lab_rest[:3, :3] @ pull, T_lab_rest[:3, :3] @ turn])
        control = np.concatenate([np.zeros(model.nu), self.hold, force.ravel()])
        kinds = (
            mujoco.mjtState.mjSTATE_CTRL,
            mujoco.mjtState.mjSTATE_QFRC_APPLIED,
            mujoco.mjtState.mjSTATE_XFRC_APPLIED,
        )
        n, spec = round(duration / model.opt.timestep), sum(int(k) for k in kinds)
        controls = np.broadcast_to(control, (1, n, len(control)))
        found, _ = rollout.rollout(model, mujoco.MjData(model), state[None], controls, control_spec=spec)
        return np.asarray(found[0])

    def displacement(self, states: np.ndarray) -> np.ndarray:
        """(n, 6) from rest, in the base's axes at rest."""
        T_rest, T = (base_poses(self.model, s[:, 1 : 1 + self.model.nq]) for s in (self.rest[None], states))
        T_rest_base = np.linalg.solve(T_rest, T)
        return np.hstack([T_rest_base[:, :3, 3], Rotation.from_matrix(T_rest_base[:, :3, :3]).as_rotvec()])


def load_test(twin: Twin) -> Stiffness:
    """Small-signal stiffness of the base, by +-2 N and +-0.5 N.m along each axis; the arm at its zero posture.

    Raises:
        Restless: The base does not come to rest.
    """
    S, heavier = compliance(bench(twin)), compliance(bench(twin, _HEAVIER))
    rigid = np.diag(S) < _RIGID
    K_total, K_heavier = (_inverted(s, rigid) for s in (S, heavier))
    K_gravity = (K_heavier - K_total) / (_HEAVIER - 1.0)
    K = K_total - K_gravity
    K[rigid, rigid] = np.inf
    return Stiffness(K, K_gravity)


def release_test(twin: Twin) -> np.ndarray:
    """Small-signal damping C (6, 6) of the base for slow motion [N.s/m, N.s, N.m.s/rad].

    Raises:
        Restless: The base does not come back to rest.
    """
    b = bench(twin)
    S = compliance(b)
    rigid = np.diag(S) < _RIGID
    loads = _WRENCHES[~rigid]
    released = [_weighed(b, b.run(b.model, b.rest, w, _LOAD)[-1], w) for w in loads]
    springs, dampers = (np.array(rows)[:, ~rigid].T for rows in zip(*released, strict=True))
    give = np.ix_(~rigid, ~rigid)
    C = np.zeros((6, 6))
    C[give] = _inverted(S, rigid)[give] @ springs @ np.linalg.inv(dampers)
    C[rigid, rigid] = np.inf
    return C


def _weighed(b: Bench, loaded: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What springs and dampers weigh in a release: integral of phi x (6,), and x_0 + integral of dphi/dt x (6,).

    Raises:
        Restless: The base does not come to rest.
    """
    states = loaded[None]
    for _ in range(_RELEASES):
        states = np.concatenate([states, b.run(b.bare, states[-1], np.zeros(6), _RELEASE)])
        x = b.displacement(states[:-1])
        left = np.abs(x[-_LATE:] @ wrench).max() / abs(x[0] @ wrench)
        if left < _AT_REST:
            s, step = np.linspace(0.0, 1.0, len(x), endpoint=False), b.model.opt.timestep
            phi, slope = (1.0 - s) ** 2 * (1.0 + 2.0 * s - 15.0 * s**2), -s * (1.0 - s) * (36.0 - 60.0 * s)
            return step * phi @ x, x[0] + slope @ x / len(x)
    raise LoadTestFailed(f"released from {wrench[:3]} N, {wrench[3:]} N.m the base keeps {left:.1%} of its deflection")


def compliance(b: Bench) -> np.ndarray:
    """(6, 6) displacement by wrench, K_total^-1.

    Raises:
        Restless: A wheel slips under a load.
    """
    late = round(_LATER / b.model.opt.timestep)
    loaded = [[b.run(b.model, b.rest, s * w, _LOAD)[[-1 - late, -1]] for w in _WRENCHES] for s in (1.0, -1.0)]
    before, (up, down) = ([b.displacement(np.array(states)[:, k]) for states in loaded] for k in (0, 1))
    S = np.linalg.solve(_WRENCHES, (up - down) / 2.0).T
    for j in HELD:
        w, whole = _WRENCHES[j], (up - down)[j, j]
        uneven, moves = abs((up + down)[j, j] / whole), abs(1.0 - (before[0] - before[1])[j, j] / whole)
        if S[j, j] > _RIGID[j] and max(uneven, moves) > _UNEVEN:
            how = f"opposite loads differ by {uneven:.1%}, {moves:.1%} are of the last {_LATER:g} s"
            raise LoadTestFailed(f"a wheel slips or lifts under {w[:3]} N, {w[3:]} N.m: {how}")
    return np.asarray(S)


def bench(twin: Twin, gravity: float = 1.0) -> Bench:
    """A twin at rest on the plate under a share of gravity, upper body fixed.

    Raises:
        Restless: It does not come to rest.
    """
    T = transform(twin.model.body("plate").pos, np.array([1.0, 0.0, 0.0, 0.0]))
    model, data = place_base(twin.model.__copy__(), T)
    model.opt.gravity *= gravity
    upper = _upper_joints(model)
    mujoco.mj_forward(model, data)
    hold, M = np.zeros(model.nv), np.empty((model.nv, model.nv))
    hold[upper] = (data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator)[upper]
    mujoco.mj_fullM(model, data, M)
    model.dof_armature[upper], model.dof_damping[upper], model.dof_frictionloss[upper] = _INERTIA, _DAMPING, 0.0
    model.tendon_limited[:] = 0
    bare = model.__copy__()
    model.dof_damping[:6] += 2.0 * _OIL * np.diag(M)[:6]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    _check_guides(model)
    states = Bench(model, bare, hold, start).run(model, start, np.zeros(6), _SETTLE)
    if not np.isfinite(states[-1]).all():
        raise LoadTestFailed("the base does not come to rest on the bench: its state is not a number any more")
    return Bench(model, bare, hold, states[-1])


def _check_guides(model: mujoco.MjModel) -> None:
    """A spring beside Coulomb's friction does not move under a small load: the test would not measure the spring."""
    sprung = model.jnt_stiffness[model.dof_jntid] > 0.0
    for d in np.flatnonzero(sprung & (model.dof_frictionloss > 0.0)):
        name, rubs = model.joint(model.dof_jntid[d]).name, model.dof_frictionloss[d]
        raise LoadTestFailed(
            f"the guide {name!r} rubs with {rubs:.3g} N, a test load does not move it: test with guide_friction 0"
        )


def _upper_joints(model: mujoco.MjModel) -> np.ndarray:
    """Degrees of freedom above the base: their body carries nothing that stands on the floor."""
    standing = {model.body(ROOT).id}
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    for body in model.geom_bodyid[touching]:
        while body:
            standing.add(int(body))
            body = model.body_parentid[body]
    return np.array([d for d in range(model.nv) if int(model.dof_bodyid[d]) not in standing], dtype=int)


def _inverted(S: np.ndarray, rigid: np.ndarray) -> np.ndarray:
    """Stiffness of the axes that give; zero elsewhere."""
    K = np.zeros((6, 6))
    free = np.ix_(~rigid, ~rigid)
    K[free] = np.linalg.inv(S[free])
    return K
