"""The load at which the first wheel of a resting base slips, or caster turns, along x, along y and about z.

    N_i = m_i g - k_z,i ((A_i x_g)_z + m_i g / Kc_i)            each wheel's own weight and its share of the base's, at
                                                                the deflection x_g where they balance its weight
    f_i = k_t,i (A_i K^-1 e)_t                                  its share of a unit load along e, in the floor's plane
    w   = min_i min(mu_i N_i / |f_i|, T_i / max |f_i|_xy)       T_i the force at which a caster turns

from a rest without horizontal forces in the wheels. A wheel presses its own contact in before the base rests on it.
Beyond that load the base slips wheel by wheel, and leaves a set.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from twin.defects.wheels.stiffness import HELD, lever, spatial_stiffness, springs
from twin.defects.wheels.wheel import Wheel
from twin.simulation.base_joint import ROOT
from twin.simulation.build import Twin


def normal_forces(twin: Twin, wheels: Sequence[Wheel]) -> np.ndarray:
    """(n,) [N] under the base at rest, the arm at its zero posture."""
    model, data = twin.model, mujoco.MjData(twin.model)
    mujoco.mj_forward(model, data)
    base, g = model.body(ROOT).id, float(np.linalg.norm(model.opt.gravity))
    own = np.array([model.body_subtreemass[model.body(w.body_name).id] for w in wheels])
    hubs = np.array([data.subtree_com[model.body(w.body_name).id] for w in wheels])
    mass = model.body_subtreemass[base] - own.sum()
    x, y, h = (model.body_subtreemass[base] * data.subtree_com[base] - own @ hubs) / mass - data.xpos[base]
    K, _ = spatial_stiffness(wheels)
    K[[3, 4], [3, 4]] -= mass * g * h
    A = np.array([lever(w)[2] for w in wheels])
    k = np.array([springs(w)[0][2] for w in wheels])
    sunk = own * g / np.array([w.footing.stiffness if w.footing else np.inf for w in wheels])
    weight = mass * g * np.array([0.0, 0.0, -1.0, -y, x, 0.0])
    return own * g - k * (A @ np.linalg.solve(K, weight - A.T @ (k * sunk)) + sunk)


def slip_loads(twin: Twin, wheels: Sequence[Wheel]) -> np.ndarray:
    """Loads (3,) along x, along y [N] and about z [N.m] at which the first wheel slips or turns.

    Infinite without bushings: a rigid body's wheels share a load in many ways, none slips before the others.
    """
    K, _ = spatial_stiffness(wheels)
    N = normal_forces(twin, wheels)
    mu = np.array([w.footing.friction if w.footing else np.inf for w in wheels])
    turns = np.array([w.turning_force or np.inf for w in wheels])
    found = []
    for unit in np.linalg.inv(K)[:, HELD].T:
        shares = np.array([(springs(w)[0] * (lever(w) @ unit))[:2] for w in wheels])
        with np.errstate(divide="ignore"):  # a rigid body's wheels have no share
            limits = mu * N / np.linalg.norm(shares, axis=1), turns / np.abs(shares).max(axis=1)
        found.append(np.min(limits))
    return np.array(found)
