"""A robot that is pushed and left alone, its set-points still, only loses energy.

E = kinetic + gravity + bushings and torso + servos 1/2 kp (u - q)^2 + meshes 1/2 K dz^2 + contacts 1/2 kn r^2
"""

import mujoco
import numpy as np
import pytest
from mujoco import rollout

from scenarios import load
from tests.doubles.grounds import GROUNDS
from twin.campaign import laboratory
from twin.defects.gear import mesh_tendon, rotor_joint
from twin.motions import JOINTS, motion
from twin.simulation.setpoints import prepare

STEPS = 2000


def energy(lab, model, states, control):
    """(n,) [J], by positions and speeds alone."""
    data = mujoco.MjData(model)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    servo = model.actuator_biasprm[:, 1] != 0.0
    kp = model.actuator_gainprm[servo, 0]
    truth = {p.name: p.value for p in lab.twin.truth}
    mesh = {model.tendon(mesh_tendon(j)).id: 1.0 / truth[f"gear.{j}.compliance"] for j in JOINTS[1:]}
    contact = {model.geom(w.contact_geom).id: w.footing.stiffness for w in lab.robot.wheels if w.footing is not None}
    found = []
    for state in states:
        data.qpos[:], data.qvel[:] = np.split(state[1 : 1 + model.nq + model.nv], [model.nq])
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        play = {k: max(abs(data.ten_length[k]) - model.tendon_range[k, 1], 0.0) for k in mesh}
        springs = [0.5 * K * play[k] ** 2 for k, K in mesh.items()]
        springs += [0.5 * contact[g] * c.dist**2 for c in data.contact for g in c.geom if g in contact]
        found.append(data.energy.sum() + sum(springs) + 0.5 * kp @ (control - data.actuator_length)[servo] ** 2)
    return np.array(found)


@pytest.fixture(scope="module", params=sorted(GROUNDS))
def pushed(request):
    """Energy above rest (n,) [J] of a robot whose arm is set in motion once it stands, its base too if casters turn.

    And what springs may keep [J], held by the force at which a caster turns.
    """
    lab = laboratory(load("humanoids2024", GROUNDS[request.param]).quick().twin, 0)
    sweep = motion.sweep_path("arm_7_joint", 2.0)
    inputs = prepare(
        lab.twin, motion.swing("s", "calibration", "sweep", sweep, 2.0, lab.config.campaign), lab.T_lab_base
    )
    model, still = inputs.model, np.tile(inputs.control[0], (1, STEPS, 1))
    rest = rollout.rollout(model, mujoco.MjData(model), inputs.first[None], still)[0][0, -1]
    start = rest.copy()
    for k, joint in enumerate(JOINTS[1:]):
        for name in (joint, rotor_joint(joint)):
            start[1 + model.nq + model.joint(name).dofadr[0]] = (-1.0) ** k * 0.5
    if request.param == "turning":
        root = 1 + model.nq + model.joint("root").dofadr[0]
        start[[root, root + 1, root + 5]] = 0.1, 0.05, 0.3
    after = rollout.rollout(model, mujoco.MjData(model), start[None], still)[0][0]
    if request.param == "turning":
        turns = [model.joint(f"caster_{side}.turn_x").qposadr[0] for side in ("front_left", "back_right")]
        assert (np.abs((after[-1] - rest)[1 + np.array(turns)]) > 1e-3).all()
    E = energy(lab, model, np.vstack([rest, start, after[::2]]), inputs.control[0])
    springs = [(w.turning_force, w.bushing.k[:2]) for w in lab.robot.wheels if w.turning_force > 0.0]
    return E[1:] - E[0], sum(0.5 * f**2 * (1.0 / k).sum() for f, k in springs)


def test_energy_never_grows(pushed, claim, request):
    above, held = pushed
    grown = (above - np.minimum.accumulate(above)).max() / above[0]
    claim(f"physics/energy/{request.node.callspec.params['pushed']}", grown)
    assert above[0] > 0.5
    assert grown < 1e-3
    assert abs(above[-1]) < 0.02 * above[0] + held
