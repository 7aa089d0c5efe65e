"""Each departure is off by default, named in the truth, and read back from what it does."""

from dataclasses import replace
from xml.etree import ElementTree as xml

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mjcf
from twin import motions
from twin.campaign import laboratory, measure
from twin.config import Departures
from twin.defects import Cable, Flexibility, LinkMass, Placement, ThermalDrift
from twin.errors import UnknownElement
from twin.instruments import LooseMarker
from twin.motions.swings import FORWARD, JOINTS, in_step
from twin.simulation import build, simulate

XI = (3e-4, -2e-4, 1e-4, 5e-4, 4e-4, -3e-4)
EVERY = Departures(
    bending={"arm_4_link": Flexibility("arm_4_link", 2e4, 20.0)},
    warming={"arm_3_joint": ThermalDrift("arm_3_joint", XI, 600.0)},
    floor_tilt=(4e-3, -3e-3),
    cables={"arm_5_joint": Cable("arm_5_joint", 0.3, 0.2)},
    loosened={"gripper2": LooseMarker("gripper2", 2e-3, 5.0)},
)
PENDULUM = """<mujoco><option gravity="0 0 -9.81" timestep="0.001" integrator="implicitfast"/><worldbody>
<body name="link"><joint name="elbow" axis="0 0 1"/><inertial pos="0.3 0.2 0" mass="2" diaginertia=".1 .1 .1"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def departed(config):
    return laboratory(replace(config, departures=EVERY), 0)


def still(config, duration=1.0):
    return motions.swing("still", "calibration", "swing", in_step(0.2, FORWARD, (0.0,) * 8), duration, config.campaign)


def settled(*given, load=0.0, gravity=True):
    """Angles of a pendulum once it hangs still."""
    spec = mujoco.MjSpec.from_string(PENDULUM)
    spec.joint("elbow").damping = np.array([2.0, 0.0, 0.0])
    for defect in given:
        defect.apply(spec)
    spec.option.gravity = [0.0, 0.0, -9.81 if gravity else 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qfrc_applied[model.joint("elbow").dofadr[0]] = load
    mujoco.mj_step(model, data, nstep=20000)
    assert np.abs(data.qvel).max() < 1e-6
    return {model.joint(j).name: data.qpos[model.joint(j).qposadr[0]] for j in range(model.njnt)}


def test_no_departure_is_made_unless_it_is_named(lab):
    names = {p.name.split(".")[0] for p in lab.twin.truth}
    assert not names & {"warming", "floor", "cable", "loosened"}
    assert not any(p.name.startswith("flexibility.arm") for p in lab.twin.truth)
    assert lab.robot.loose == ()
    np.testing.assert_array_equal(lab.twin.model.opt.gravity, [0.0, 0.0, -9.81])


def test_departures_are_in_the_truth_by_name(departed):
    truth = {p.name: p.value for p in (*departed.twin.truth, *departed.robot.loose[0].parameters())}
    expected = {
        "flexibility.arm_4_link.krx": 2e4,
        "flexibility.arm_4_link.cry": 20.0,
        "warming.arm_3_joint.x": 3e-4,
        "warming.arm_3_joint.rz": -3e-4,
        "warming.arm_3_joint.time_constant": 600.0,
        "floor.tilt.rx": 4e-3,
        "floor.tilt.ry": -3e-3,
        "cable.arm_5_joint.stiffness": 0.3,
        "cable.arm_5_joint.rest": 0.2,
        "loosened.gripper2.sag": 2e-3,
        "loosened.gripper2.since": 5.0,
    }
    assert {name: truth[name] for name in expected} == expected


def test_a_link_bends_by_its_load_over_its_stiffness():
    angles = settled(Flexibility("link", 2e4, 200.0), load=0.0)
    mg = 2.0 * 9.81
    assert angles["link.rx"] * 2e4 == pytest.approx(-mg * 0.2, rel=5e-3)
    assert angles["link.ry"] * 2e4 == pytest.approx(mg * 0.3, rel=5e-3)


def test_a_cable_pulls_towards_its_rest():
    cable = Cable("elbow", 3.0, 0.2)
    rest = settled(cable, gravity=False)["elbow"]
    pulled = settled(cable, load=0.6, gravity=False)["elbow"]
    assert rest == pytest.approx(0.2, abs=1e-4)
    assert 0.6 / (pulled - rest) == pytest.approx(3.0, rel=1e-3)


def test_a_placement_drifts_exponentially_to_its_twist(departed, config, body_poses):
    motion = still(config)

    def placed(time):
        return body_poses(departed.twin_in(motion, time).model, {}, "arm_2_link", "arm_3_link")

    cold = placed(0.0)
    for time, share in ((600.0, 1.0 - np.exp(-1.0)), (1e5, 1.0)):
        xi = pin.log6(pin.SE3(np.linalg.solve(cold, placed(time)))).vector
        np.testing.assert_allclose(xi, share * np.array(XI), atol=1e-9)


def test_a_tilted_floor_shows_in_the_plates_horizontal_force(config):
    lab = laboratory(replace(config, departures=Departures(floor_tilt=(4e-3, -3e-3))), 0)
    force = simulate(lab.twin, still(config), lab.T_lab_base).wrench[:, :3].mean(axis=0)
    # level z in lab axes is (-sin ry, sin rx, 1) to first order; the robot pushes against it
    np.testing.assert_allclose(force[:2] / force[2], [3e-3, 4e-3], atol=3e-5)


def test_a_loose_marker_hangs_by_its_sag_from_its_time_on(departed, config):
    motion = still(config)
    states = simulate(departed.twin_in(motion, 0.0), motion, departed.T_lab_base)
    tight = replace(departed, robot=replace(departed.robot, loose=()))
    _, loose = measure(departed, motion, states, 103.0)
    _, fixed = measure(tight, motion, states, 103.0)
    moved = loose.marker_position - fixed.marker_position
    column = loose.marker.index("gripper2")
    late = loose.t_mocap >= 105.0
    assert late.any() and not late.all()
    np.testing.assert_allclose(moved[late, column], [[0.0, 0.0, -2e-3]] * late.sum(), atol=1e-12)
    moved[late, column] = 0.0
    assert not moved.any()


def test_a_marker_that_is_not_there_is_reported_with_those_that_are():
    with pytest.raises(UnknownElement, match="no marker named 'nose'.*base1"):
        LooseMarker("nose", 1e-3, 0.0).moved(np.zeros(1), ("base1",), np.zeros((1, 1, 3)))


def test_masses_and_centres_of_mass_weigh_on_the_joints_as_inverse_dynamics_says(lab):
    """Gravity torques of a twin against Pinocchio with the truth's placements, masses and centres of mass."""
    given = [d for d in lab.robot.defects if isinstance(d, (Placement, LinkMass))]
    model = build(mjcf.spec(), given).model
    data = mujoco.MjData(model)
    q = dict(zip(JOINTS, FORWARD, strict=True))
    for name, value in q.items():
        data.joint(name).qpos = value
    mujoco.mj_forward(model, data)
    torque = np.array([data.joint(j).qfrc_bias[0] for j in JOINTS])
    np.testing.assert_allclose(torque, _gravity_torques(given, q), atol=2e-5)
    nominal = _gravity_torques([], q)
    assert np.abs(torque - nominal).max() > 0.2


def _gravity_torques(given, q):
    """Of Pinocchio's model of the URDF with the same placements, masses and centres of mass."""
    tree = xml.fromstring(mjcf.urdf())
    links = {link.get("name"): link for link in tree.iter("link")}
    for d in given:
        if isinstance(d, LinkMass):
            inertial = links[d.link].find("inertial")
            origin, mass, tensor = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
            com = np.array([float(v) for v in origin.get("xyz").split()]) + d.shift
            origin.set("xyz", " ".join(repr(float(v)) for v in com))
            mass.set("value", repr(float(mass.get("value")) * d.scale))
            for key, value in tensor.attrib.items():
                tensor.set(key, repr(float(value) * d.scale))
    model = pin.buildModelFromXML(xml.tostring(tree, encoding="unicode"))
    for d in given:
        if isinstance(d, Placement):
            i = model.getJointId(d.joint_name)
            model.jointPlacements[i] = model.jointPlacements[i] * pin.exp6(np.array(d.xi))
    configuration = pin.neutral(model)
    for name, value in q.items():
        configuration[model.joints[model.getJointId(name)].idx_q] = value
    torques = pin.computeGeneralizedGravity(model, model.createData(), configuration)
    return np.array([torques[model.joints[model.getJointId(n)].idx_v] for n in q])
