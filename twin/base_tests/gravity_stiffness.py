"""What weight and preload add to the stiffness of a base on its wheels, beside the springs' K.

    dF = theta x W,    dM = sum_i [ p_i x (theta x b_i) + (rho_i theta x e_z - t) x b_i ] - (theta x c) x W
    K_gravity (t, theta) = -(dF, dM) + sum_i [ A_i' k_i A_i at p_i + b_i / k_z,i - A_i' k_i A_i at p_i ] (t, theta)

b_i what wheel i carries of the base, along e_z, W = sum_i b_i, c the centre of mass of what is carried, about the base
frame's origin, for a displacement t and a rotation theta of the base. Forces of bushings turn with the base; those of
the floor act where the wheel stands, and a braked wheel of radius rho that tilts with the base rolls on by rho theta.
The base sags under its weight by b / k_z: the floor is as much nearer to its origin (last sum; A, k of `stiffness`).
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from twin.base_tests.slip_load import normal_forces
from twin.defects.wheels.stiffness import HELD, lever, springs, tilts
from twin.defects.wheels.wheel import Wheel
from twin.simulation.base_joint import ROOT
from twin.simulation.build import Twin

_UP = np.array([0.0, 0.0, 1.0])


def gravity_stiffness(twin: Twin, wheels: Sequence[Wheel]) -> np.ndarray:
    """K_gravity (6, 6) [N/m, N, N.m/rad] about the base frame's origin, in its axes; the arm at its zero posture."""
    b, centre = _carried(twin, wheels)
    levers = np.array([lever(w) for w in wheels])
    rho = np.array([w.centre[2] - w.contact[2] if w.footing is not None and tilts(w) else 0.0 for w in wheels])
    K = _sagged(wheels, levers, b)
    for j, (t, theta) in enumerate(zip(np.eye(6)[:, :3], np.eye(6)[:, 3:], strict=True)):
        turned = np.cross(theta, _UP)
        moment = np.einsum("i,iba,b->a", b, levers[:, :3, 3:], turned) + np.cross(rho @ b * turned - b.sum() * t, _UP)
        K[:3, j] -= b.sum() * turned
        K[3:, j] -= moment - np.cross(np.cross(theta, centre), b.sum() * _UP)
    if any(w.bushing is None for w in wheels):
        K[HELD, :] = K[:, HELD] = 0.0
    return K


def _sagged(wheels: Sequence[Wheel], levers: np.ndarray, b: np.ndarray) -> np.ndarray:
    """What the springs' (6, 6) gain by the floor's coming nearer."""
    K = np.zeros((6, 6))
    for wheel, A, load in zip(wheels, levers, b, strict=True):
        k, nearer = springs(wheel)[0], A.copy()
        nearer[[0, 1], [4, 3]] += np.array([1.0, -1.0]) * load / k[2]
        K += nearer.T @ np.diag(k) @ nearer - A.T @ np.diag(k) @ A
    return K


def _carried(twin: Twin, wheels: Sequence[Wheel]) -> tuple[np.ndarray, np.ndarray]:
    """What each wheel carries of the base (n,) [N], and the centre of mass of that (3,) from the base's origin [m]."""
    model, data = twin.model, mujoco.MjData(twin.model)
    mujoco.mj_forward(model, data)
    base, bodies = model.body(ROOT).id, [model.body(w.body_name).id for w in wheels]
    own = model.body_subtreemass[bodies] * [w.footing is not None for w in wheels]  # an anchored base carries them
    whole = model.body_subtreemass[base]
    centre = (whole * data.subtree_com[base] - own @ data.subtree_com[bodies]) / (whole - own.sum())
    return normal_forces(twin, wheels) - own * float(np.linalg.norm(model.opt.gravity)), centre - data.xpos[base]
