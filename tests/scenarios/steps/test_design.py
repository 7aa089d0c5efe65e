"""Designed postures: better than random ones, possible, and said how to approach."""

from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from ruamel.yaml import YAML

import mjcf
from calibration.design.candidates import in_sight, visible
from calibration.design.collisions import shapes_of
from calibration.design.exchange import choose
from calibration.design.information import prospect
from calibration.design.plan import compared, nominal_task, plan
from calibration.design.sequence import clear, sides
from calibration.design.tour_file import played
from calibration.errors import InputError
from calibration.recording.experiment import plans_text, read_plans
from calibration.stages.geometry.parameters import geometry_parameters
from scenarios import load
from scenarios.files import yaml_file
from scenarios.files.errors import ScenarioError
from scenarios.steps.design import PLAYED, design, recording, recording_too
from tests.doubles import rigid_robot
from twin.campaign import describe_dataset
from twin.motions import RATE, schedule
from twin.motions.csv_trajectory import read_trajectory

DESCRIBED = describe_dataset(load("humanoids2024").twin, ())


def yaml_text(path):
    return YAML(typ="safe").load(path.read_text())


@pytest.fixture(scope="module")
def task():
    return nominal_task(mjcf.urdf(), DESCRIBED, np.random.default_rng(0))


@pytest.fixture(scope="module")
def pool(task):
    return task.room.pool(90, np.random.default_rng(1))


@pytest.fixture(scope="module")
def few(task, pool):
    """A small prospect: 60 candidates, the hand at 30 other postures."""
    return prospect(task.model, task.parameters, DESCRIBED, task.reading_sigma, pool[:60], pool[60:])


@pytest.fixture(scope="module")
def found(task):
    return plan(task, 30, "G", np.random.default_rng(2))


@pytest.mark.slow
def test_thirty_designed_postures_beat_random_ones_where_the_robot_departs_from_its_model(found, claim):
    against = compared(found, np.random.default_rng(3))
    claim("geometry/design/random errors as expected", against.gain)
    assert len(found.design.chosen) == 30 and len(against.random) == 100
    assert against.gain >= 0.30
    assert against.designed < against.random.min()


def test_a_robot_plays_the_tour(found, tmp_path):
    chain = found.task.model.nominal
    slides = [chain.is_prismatic(j) for j in chain.measured]
    tour = played(chain.measured, found.postures, chain.limits, slides)
    paths = {path.name: path for path in tour.write(tmp_path)}
    assert tuple(paths) == PLAYED
    motion = read_trajectory(paths["tour.csv"], "tour", "calibration", rest=1.0)  # limits and speeds of the twin
    assert len(motion.command) > RATE * tour.t[-1]
    for posture, (start, stop) in zip(found.postures, tour.rests, strict=True):
        at = [np.array([np.interp(t, tour.t, column) for column in tour.q.T]) for t in (start - 0.01, start, stop)]
        np.testing.assert_allclose(at[1:], [posture.q] * 2, atol=1e-9)
        asked = np.array(posture.approach)
        low, high = chain.limits
        free = (asked != 0) & (np.abs(np.array(posture.q) - np.where(asked > 0, low, high)) > 1e-3)
        np.testing.assert_array_equal(np.sign(at[1] - at[0])[free], asked[free])
        assert stop - start == pytest.approx(2.0)
    play, trajectory = (yaml_text(paths[f"tour_{name}.yaml"]) for name in ("play_motion", "trajectory"))
    points = play["play_motion"]["motions"]["calibration_postures"]["points"]
    assert [p["positions"] for p in points] == [p["positions"] for p in trajectory["points"]]
    stamps = [p["time_from_start"]["secs"] + 1e-9 * p["time_from_start"]["nsecs"] for p in trajectory["points"]]
    np.testing.assert_allclose(stamps, tour.t, atol=1e-3)
    np.testing.assert_allclose([p["time_from_start"] for p in points], tour.t, atol=1e-3)
    assert trajectory["joint_names"] == list(chain.measured) and (np.diff(stamps) > 0.0).all()


@pytest.mark.slow
def test_without_departures_they_beat_random_ones_by_thirty_percent(task, claim):
    exact = replace(task, departures=None)
    against = compared(plan(exact, 30, "G", np.random.default_rng(2)), np.random.default_rng(3))
    claim("geometry/design/no random errors", against.gain)
    assert against.gain >= 0.30
    assert against.designed < against.random.min()


def test_designed_postures_are_inside_the_limits_clear_of_the_robot_and_in_sight(found, task):
    q, (low, high) = np.array([p.q for p in found.postures]), task.model.chain.limits
    assert (q > low + 0.005).all() and (q < high - 0.005).all()
    assert not task.room.shapes.collides(q).any() and in_sight(task.room.shapes, DESCRIBED, q).all()
    assert len(np.unique(np.round(q, 3), axis=0)) == 30


def test_their_order_can_be_driven(found, task):
    q = np.array([p.q for p in found.postures])
    hit = [k for k in range(1, 30) if not clear(q[k - 1], q[k], task.room.shapes)]
    assert tuple(hit) == found.tour.contact and len(hit) <= 2
    assert sorted(found.tour.order) == list(range(30))


def test_joints_come_from_both_sides_so_that_play_is_no_geometry(found):
    approach = np.array([p.approach for p in found.postures])
    assert (np.abs(approach[:, 1:]) == 1).all()
    assert (np.abs(approach[:, 1:].sum(axis=0)) <= 20).all()
    assert found.sides.bias.max() < 0.1 * found.sides.one_sided.max()


def test_flanks_of_an_exact_play_move_the_fit_as_predicted(task, few):
    """The bias is that of the least squares the flanks go through, postures read on their flanks."""
    chosen, h = np.arange(20), np.array([0.0, *7 * [2e-3]])
    one = sides(few, chosen, h, np.random.default_rng(0))
    model = task.model
    flank = np.array(few.q[chosen])
    flank[:, model.chain.columns] += np.where(np.abs(one.approach) > 0, h, 0.0)
    T0, T1 = model.poses(few.q[chosen]), model.poses(flank)
    r = np.array([pin.log6(pin.SE3(a).actInv(pin.SE3(b))).vector for a, b in zip(T0, T1, strict=True)])
    J = model.poses_and_derivatives(few.q[chosen], names=task.parameters.names)
    W = few.J_joint[chosen] @ np.linalg.pinv(J.J_joint)  # whitener on the joints' span
    x = few.after(chosen) @ np.einsum("ndr,ndc,nc->r", few.B[chosen], W, r)
    np.testing.assert_allclose(np.linalg.norm(few.P @ x, axis=1), one.one_sided, rtol=0.02)


@pytest.mark.parametrize("criterion", ["D", "E", "G"])
def test_each_criterion_is_best_at_what_it_is_for(few, criterion):
    measure = {
        "D": lambda C: np.linalg.slogdet(C)[1],
        "E": lambda C: np.linalg.eigvalsh(C)[-1],
        "G": lambda C: few.hand(C).max(),
    }[criterion]
    value = {c: measure(few.after(choose(few, 12, c))) for c in "DEG"}
    assert min(value, key=value.get) == criterion
    rng = np.random.default_rng(0)
    assert value[criterion] < min(measure(few.after(rng.choice(60, 12, replace=False))) for _ in range(200))


def test_exchanging_finds_the_best_set_of_a_pool_small_enough_to_try_all(few):
    from itertools import combinations

    small = replace(few, q=few.q[:12], B=few.B[:12], J_joint=few.J_joint[:12], H=few.H[:12])
    best = min(combinations(range(12), 4), key=lambda s: np.linalg.slogdet(small.after(np.array(s)))[1])
    assert tuple(sorted(choose(small, 4, "D"))) == best


def test_predicted_sigmas_are_those_of_the_information_inverted_whole(task, few):
    """All parameters at once, gauge included, by the normal equations with the tolerances as priors."""
    chosen = np.arange(25)
    found = task.model.poses_and_derivatives(few.q[chosen], names=task.parameters.names)
    again = prospect(task.model, task.parameters, DESCRIBED, task.reading_sigma, few.q[chosen], few.q[:1])
    W = again.J_joint @ np.linalg.pinv(found.J_joint)
    np.testing.assert_allclose(W @ found.J_joint, again.J_joint, atol=1e-6)
    J = (few.B[chosen] @ few.V.T / few.scale).reshape(-1, len(task.parameters))
    whole = np.linalg.inv(J.T @ J + np.diag(task.parameters.tolerance**-2.0))
    np.testing.assert_allclose(few.sigma(few.after(chosen)), np.sqrt(np.diag(whole)), rtol=1e-9)


def test_contact_is_noticed(task):
    chain = task.model.chain
    folded = np.array([0.1, 1.4, 0.9, -1.57, 2.3, 0.0, 0.0, 0.0])  # the hand in the base
    out = np.array([0.2, 1.5, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    inside = np.array([0.0, 0.0, -1.5, -3.4, 2.3, 0.0, 0.0, 0.0])
    hit = task.room.shapes.collides(np.array([folded, out, inside]))
    assert not hit[1]
    rng = np.random.default_rng(0)
    assert 0.2 < task.room.shapes.collides(task.room.sample(300, rng)).mean() < 0.6
    bare = shapes_of(pin_text_without_shapes(), chain, DESCRIBED)
    assert not bare.known


def pin_text_without_shapes():
    import xml.etree.ElementTree as ET

    robot = ET.fromstring(mjcf.urdf())
    for link in robot.findall("link"):
        for shape in link.findall("collision"):
            link.remove(shape)
    return ET.tostring(robot, encoding="unicode")


def test_a_box_hides_what_is_behind_it_and_nothing_else():
    T, half = np.eye(4)[None, None], np.array([[0.5, 0.5, 0.5]])
    points = np.array([[[2.0, 0.0, 0.0], [0.0, 0.0, 0.6], [2.0, 0.0, 2.0]]])
    cameras = np.array([[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
    seen = visible(points, cameras, T, half)[0]
    np.testing.assert_array_equal(seen, [[False, True, True], [False, False, True], [True, True, True]])


def test_the_file_reads_back(found, tmp_path):
    remedy = found.remedy("geometry", "why: a test")
    (tmp_path / "d.yaml").write_text(plans_text(DESCRIBED.joint_names, [remedy]))
    joints, remedies = read_plans(tmp_path / "d.yaml")
    assert joints == DESCRIBED.joint_names and remedies == (remedy,)
    assert remedy.sigma[0].name == "frame.base.base.x" and all(s.after <= s.before for s in remedy.sigma)


@pytest.mark.parametrize(
    "text",
    [
        "3",
        "schema: 1",
        "{schema: 1, joints: [a], remedies: [{stage: s, why: w, postures: [{q: [1, 2], approach: [0]}]}]}",
    ],
)
def test_a_file_that_is_none_is_reported(tmp_path, text):
    (tmp_path / "d.yaml").write_text(text)
    with pytest.raises(InputError):
        read_plans(tmp_path / "d.yaml")


def test_a_robot_without_wheels_or_shapes_is_designed_for_too():
    described = rigid_robot.described()
    bare = nominal_task(pin_text_without_shapes(), described, np.random.default_rng(0))
    rigid = geometry_parameters(bare.model.chain, described)
    at = partial(prospect, bare.model, rigid, described, bare.reading_sigma)
    q = bare.room.pool(80, np.random.default_rng(0))
    assert at(q[:60], q[60:]).B.shape[2] == 36


@pytest.mark.slow
def test_the_command_writes_postures_and_a_scenario_that_records_them(tmp_path):
    out, campaign = tmp_path / "postures.yaml", tmp_path / "designed.yaml"
    found = design(load("humanoids2024"), 5, "D", out, campaign)
    (remedy,) = read_plans(out)[1]
    assert remedy.postures == found.plan.postures and len(remedy.postures) == 5
    assert [p.q for p in remedy.postures] == list(load(campaign).twin.campaign.given_postures)


def test_designed_postures_are_recorded_where_they_were_chosen(found, tmp_path):
    yaml_file.write(tmp_path / "designed.yaml", recording(load("humanoids2024"), found))
    config = load(tmp_path / "designed.yaml").twin
    motion = schedule(config.campaign, mjcf.spec().compile(), 0)[0]
    rests = [motion.command[round(0.5 * (a + b) * RATE)] for a, b in motion.dwells]
    np.testing.assert_allclose(rests, [p.q for p in found.postures], atol=1e-12)
    sides = np.array([p.approach for p in found.postures])
    np.testing.assert_array_equal(motion.approach[sides != 0], sides[sides != 0])
    for (start, _), side in zip(motion.dwells, sides, strict=True):
        before = motion.command[round(start * RATE) - 20 : round(start * RATE) + 1]
        assert (side * np.diff(before, axis=0) >= -1e-12).all() and (side * np.ptp(before, axis=0))[side != 0].any()


def test_approaches_that_are_not_one_a_posture_are_refused():
    given = "[[0.1,1,0,-1,1,0,0,0],[0.1,1,0,-1,1,0.5,0,0]]"
    with pytest.raises(ScenarioError, match="1 approaches for 2 given_postures"):
        load(
            "humanoids2024",
            [f"twin.campaign.given_postures={given}", "twin.campaign.given_approaches=[[0,1,1,1,1,1,1,1]]"],
        )


def test_what_an_estimate_asks_for_is_recorded_after_the_scenario_s_own_postures(found, tmp_path):
    remedy = replace(found.remedy("geometry", "too few"), postures=found.postures[:8])
    (tmp_path / "record_next.yaml").write_text(plans_text(DESCRIBED.joint_names, [remedy]))
    plain = load("humanoids2024", ["twin.campaign.calibration_postures=5"])
    both = recording_too(plain, tmp_path / "record_next.yaml").twin.campaign
    alone = schedule(plain.twin.campaign, mjcf.spec().compile(), plain.seed)[0]
    rests = [alone.command[round(stop * RATE)] for _, stop in alone.dwells]
    np.testing.assert_allclose(both.given_postures, [*rests, *(p.q for p in remedy.postures)], atol=1e-12)
    assert both.given_approaches == ((0,) * 8,) * 5 + tuple(p.approach for p in remedy.postures)
    beyond = replace(remedy.postures[0], q=np.r_[0.1, 9.0, np.zeros(6)])
    (tmp_path / "beyond.yaml").write_text(plans_text(DESCRIBED.joint_names, [replace(remedy, postures=(beyond,))]))
    with pytest.raises(ScenarioError, match=r"beyond.yaml: arm_1_joint goes from 0.0 to 2.7\d* \(got 9.0\)"):
        recording_too(plain, tmp_path / "beyond.yaml")
    (tmp_path / "other.yaml").write_text(plans_text(("a",), []))
    with pytest.raises(ScenarioError, match="joints are"):
        recording_too(plain, tmp_path / "other.yaml")
