"""How stiff a gear's mesh may be at a time step.

    kappa = h^2 K / m,   delta = h D / m,    1 / m = J M(q)^-1 J'       J the mesh's row: link minus motor

m is what rotor and link turn against each other with, the mass that the soft limit adds included, at its least over the
postures of the arm; of meshes that share joints, a differential's, 1 / m is the sum over all. In contact a step is
dv = -h (K p + D v) / m, dp = h v: unstable beyond kappa + 2 delta = 4. Within the backlash the link bounces, and enters
by the part of a step it happens to have: half of an oscillation in contact must last two steps, kappa <= 2, or bounces
gain speed over these parts' mean: from kappa = 2.3 on at delta = 0.02, from 2.7 on at 0.2. Between two flanks a link
with less damping can meet one part again and again, and gain within the limit too: 3 times at kappa = 1.5. The spring
of a mesh that slips (`gear_friction`) adds to K in contact alone.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from twin.defects.gear import Gear, mesh_tendon, rotor_joint
from twin.errors import TwinError

_BOUNCES, _STABLE = 2.0, 4.0
_POSTURES = 64
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19)


class GearTooStiff(TwinError):
    """A mesh that a time step cannot integrate: link and rotor would gain energy from it.

    Attributes:
        joint: The joint.
        most: Stiffness [N.m/rad], or damping where none would do [N.m.s/rad], that can be used.
    """

    def __init__(self, joint: str, what: str, value: float, most: float, unit: str) -> None:
        self.joint, self.most = joint, most
        super().__init__(
            f"mesh {what} {value:g} {unit} of {joint!r} is more than its rotor and link bear at this time step: "
            f"the mesh would ring; use at most {_floor(most):g} {unit} or a shorter step"
        )


def check_meshes(model: mujoco.MjModel, arm: Mapping[str, Gear]) -> None:
    """Check the meshes of every joint of the arm, coupled or not.

    Raises:
        Rings: One is too stiff, or too strongly damped.
    """
    h, mass = model.opt.timestep, least_masses(model, tuple(arm))
    for (name, joint), m in zip(arm.items(), mass, strict=True):
        i = model.tendon(mesh_tendon(name)).id
        K, D = -model.tendon_solref_lim[i] / _scale(model, i)
        room = _STABLE * m / h**2 - model.tendon_stiffness[i]
        most = min(_BOUNCES * m / h**2, room - 2.0 * D / h)
        if most <= 0.0:
            share = 0.5 * h * (room - K) / D
            raise GearTooStiff(name, "damping", joint.damping, max(0.0, share) * joint.damping, "N.m.s/rad")
        if most < K:
            raise GearTooStiff(name, "stiffness", joint.stiffness, most / K * joint.stiffness, "N.m/rad")


def least_masses(model: mujoco.MjModel, names: tuple[str, ...]) -> np.ndarray:
    """m (n,) [kg.m2] of the meshes of joints, at its least over postures spread evenly over the joints' ranges."""
    data, tendons = mujoco.MjData(model), [model.tendon(mesh_tendon(name)).id for name in names]
    J = np.array([_row(model, i) for i in tendons])
    together = np.abs(J) @ np.abs(J).T > 0.0
    low, high = np.array([model.joint(name).range for name in names]).T
    solved, least = np.empty_like(J), np.full(len(names), np.inf)
    for share in halton(_POSTURES, len(names)):
        for name, q in zip(names, low + share * (high - low), strict=True):
            data.joint(name).qpos = data.joint(rotor_joint(name)).qpos = q
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_solveM(model, data, solved, J)
        least = np.minimum(least, 1.0 / (np.abs(J @ solved.T) * together).sum(axis=1))
    impedance = model.tendon_solimp_lim[tendons, 0]
    return np.asarray(least + impedance / _scale(model, tendons))


def halton(n: int, d: int) -> np.ndarray:
    """First n points (n, d) of Halton's sequence: the digits of 0, 1, 2, ... in the first d primes, mirrored."""
    found = np.zeros((n, d))
    for column, prime in zip(found.T, _PRIMES[:d], strict=True):
        k, share = np.arange(n), 1.0 / prime
        while k.any():
            column += k % prime * share
            k, share = k // prime, share / prime
    return found


def _scale(model: mujoco.MjModel, tendon: int | list[int]) -> np.ndarray:
    """Of a limit's reference parameters over its stiffness and damping [1/(kg.m2)]."""
    return np.asarray((1.0 - model.tendon_solimp_lim[tendon, 0]) * model.tendon_invweight0[tendon])


def _row(model: mujoco.MjModel, tendon: int) -> np.ndarray:
    """J (nv,) of a fixed tendon."""
    row, first = np.zeros(model.nv), model.tendon_adr[tendon]
    wraps = slice(first, first + model.tendon_num[tendon])
    row[model.jnt_dofadr[model.wrap_objid[wraps]]] = model.wrap_prm[wraps]
    return row


def _floor(value: float) -> float:
    """Two digits, rounded down."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1.0) if value > 0.0 else 1.0
    return float(np.floor(value / unit) * unit)
