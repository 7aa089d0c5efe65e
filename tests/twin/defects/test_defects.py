import json
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mjcf
from scenarios import load
from twin.campaign import sample
from twin.defects import Gear, LinkMass, Placement
from twin.defects.inertia import Payload
from twin.defects.wheels.contact import ContactTooStiff
from twin.errors import UnknownElement
from twin.instruments import Encoder
from twin.motions import JOINTS
from twin.simulation import build

TOOL = "gripper_grasping_frame"


def test_a_perturbed_twin_has_pinocchios_kinematics(lab, body_poses):
    rng = np.random.default_rng(2)
    placements = [d for d in lab.robot.defects if isinstance(d, Placement)]
    assert [d.joint_name for d in placements] == list(JOINTS)
    model = pin.buildModelFromXML(mjcf.urdf())
    for d in placements:
        i = model.getJointId(d.joint_name)
        model.jointPlacements[i] = model.jointPlacements[i] * pin.exp6(np.array(d.xi))
    data, worst = model.createData(), 0.0
    for values in rng.uniform(0.0, 0.3, size=(50, len(JOINTS))):
        q = pin.neutral(model)
        for joint, value in zip(JOINTS, values, strict=True):
            q[model.joints[model.getJointId(joint)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        T = body_poses(lab.twin.model, dict(zip(JOINTS, values, strict=True)), "base_footprint", TOOL)
        worst = max(worst, np.abs(T - data.oMf[model.getFrameId(TOOL)].homogeneous).max())
    assert worst < 1e-12


def test_a_build_leaves_the_nominal_specification_alone(lab):
    spec = mjcf.spec()
    before = spec.to_xml()
    build(spec, lab.robot.defects)
    assert spec.to_xml() == before


def test_every_defect_can_be_read_back_from_the_compiled_model(lab):
    model, truth = lab.twin.model, {p.name: p.value for p in lab.twin.truth}
    for joint in JOINTS[1:]:
        i = model.tendon(f"{joint}.mesh").id
        assert np.ptp(model.tendon_range[i]) == pytest.approx(truth[f"backlash.{joint}.gap"], rel=1e-12)
        scale = 0.98 * model.tendon_invweight0[i]
        assert scale / -model.tendon_solref_lim[i, 0] == pytest.approx(truth[f"gear.{joint}.compliance"], rel=1e-12)
        assert model.joint(joint).frictionloss[0] == truth[f"friction.{joint}.coulomb"]
    for wheel in lab.robot.wheels:
        k = [model.joint(f"{wheel.name}.{a}").stiffness.ravel()[0] for a in "xyz"]
        assert k == [truth[f"suspension.{wheel.name}.k{a}"] for a in "xyz"]
        assert model.geom(wheel.contact_geom).friction[0] == truth[f"contact.{wheel.name}.mu"]


def test_masses_and_payload_are_as_declared(lab, nominal):
    model = build(mjcf.spec(), lab.robot.defects, visual=True).model
    for d in lab.robot.defects:
        if isinstance(d, LinkMass):
            assert model.body(d.link).mass[0] == pytest.approx(nominal.body(d.link).mass[0] * d.scale, rel=1e-12)
            assert d.scale != 1.0
    payload = next(d for d in lab.robot.defects if isinstance(d, Payload))
    assert model.body("payload").mass[0] == payload.mass == 0.437


def test_bodies_made_one_weigh_and_move_like_those_they_are_made_of(lab):
    fused, apart = lab.twin.model, build(mjcf.spec(), lab.robot.defects, lab.twin.links, visual=True).model
    assert fused.nbody < 0.7 * apart.nbody
    ends = []
    for model in (fused, apart):
        data = mujoco.MjData(model)
        data.joint("arm_2_joint").qvel = 1.0
        mujoco.mj_step(model, data, 300)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(*ends, atol=1e-9)
    assert fused.body_subtreemass[0] == pytest.approx(apart.body_subtreemass[0], rel=1e-12)


def test_a_robot_has_one_make_of_arm_and_the_same_scatter(nominal):
    makes = [{"arm_5_link": 1.5, "arm_3_link": 1.2}, {"arm_1_link": 0.8}]
    plain = load("humanoids2024").quick().twin
    config = load("humanoids2024", [f"twin.widths.makes={json.dumps(makes)}"]).quick().twin
    found = []
    for seed in range(8):
        usual, made = (
            {d.link: d.scale for d in sample(c, seed).defects if isinstance(d, LinkMass)} for c in (plain, config)
        )
        ratio = {link: made[link] / usual[link] for link in usual}
        found.append({link: r for link, r in ratio.items() if r != pytest.approx(1.0)})
    assert all(any(f == pytest.approx(make) for make in makes) for f in found)
    assert {len(f) for f in found} == {1, 2}


def test_contacts_that_would_chatter_are_refused(lab):
    wheel = next(w for w in lab.robot.wheels if w.name == "caster_front_left")
    bad = replace(wheel, footing=replace(wheel.footing, damping=1000.0))
    with pytest.raises(ContactTooStiff, match=r"caster_front_left.*at most 2\d\d N.s/m"):
        build(mjcf.spec(), [bad])


def test_an_unknown_joint_is_named_with_the_known_ones():
    with pytest.raises(UnknownElement, match="no joint named 'elbow'.*arm_1_joint"):
        build(mjcf.spec(), [Placement("elbow", np.zeros(6))])
    with pytest.raises(UnknownElement, match="no joint named 'elbow'"):
        build(mjcf.spec(), [Gear("elbow", *np.ones(9))])


def test_encoder_readings_are_the_stated_formula():
    encoder = Encoder("arm_1_joint", "link", 3e-3, (1e-3, 2e-3, 3e-4, 4e-4), 1e-9)
    q = 0.7
    wave = 1e-3 * np.cos(q) + 2e-3 * np.sin(q) + 3e-4 * np.cos(2 * q) + 4e-4 * np.sin(2 * q)
    assert encoder.read(np.array([q]))[0] == pytest.approx(q + 3e-3 + wave, abs=1e-9)
    coarse = Encoder("arm_1_joint", "link", 0.0, (0.0,) * 4, 1e-2)
    np.testing.assert_allclose(coarse.read(np.array([0.0149, 0.0151])), [0.01, 0.02])
