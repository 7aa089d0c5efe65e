"""Columns of joints swapped, reversed or in degrees, beside the hand's markers: reported by name, nothing written."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import mjcf
from calibration import load
from calibration.checks.column_hypotheses import readings
from calibration.checks.joint_columns import _shown, check_columns
from calibration.errors import InputError
from calibration.recording.posture_means import PostureMeans
from calibration.recording.trial import Trial
from calibration.robot.chain import chain_of_frames
from scenarios.commands import main
from tests.doubles import geared_robot, rigid_robot

A, B = (rigid_robot.JOINTS.index(f"arm_{i}_joint") for i in (5, 6))


@cache
def trials() -> list[tuple[str, str, str, Trial]]:
    """A swing and a sweep of a robot with a real one's zeros (0.1 rad at arm_5), seconds off the markers' clock."""
    rng, truth, found, start = np.random.default_rng(3), rigid_robot.defects(3), [], 20.0
    for name, motor in (("swing", geared_robot.swing(rng, 12.0)), ("sweep", geared_robot.sweep(4, 6.0))):
        found.append(
            (name, "calibration", "swing", geared_robot.record(truth, geared_robot.gears(rng), motor, start, rng, 1e-3))
        )
        start += len(motor) / geared_robot.GRID + 5.0
    return found


def swapped(q):
    out = q.copy()
    out[:, [A, B]] = q[:, [B, A]]
    return out


def reversed_(q):
    out = q.copy()
    out[:, B] = -q[:, B]
    return out


def degrees(q):
    return np.column_stack([q[:, 0], np.degrees(q[:, 1:])])


WRONG = {
    "swapped": (swapped, "joints arm_5_joint and arm_6_joint are swapped"),
    "reversed": (reversed_, "joint arm_6_joint is reversed"),
    "degrees": (degrees, "(recorded in degrees?)"),
}
SOME_WRONG = ["swapped", *(pytest.param(name, marks=pytest.mark.slow) for name in ("reversed", "degrees"))]


def with_readings(change):
    return [(n, r, k, replace(t, q_motor=change(t.q_motor))) for n, r, k, t in trials()]


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as exit:
        main.main([str(a) for a in arguments])
    return exit.value.code


def files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.name not in ("mapping.yaml", "nominal.urdf"))


@pytest.mark.parametrize("name", SOME_WRONG)
def test_wrong_columns_of_csv_files_are_reported_by_name(tmp_path, capsys, name):
    change, words = WRONG[name]
    source, csv = rigid_robot.write(tmp_path / "source", with_readings(change)), tmp_path / "csv"
    assert run("export", "csv", source, "--out", csv) == 0
    assert run("import", "csv", *files(csv), "--map", csv / "mapping.yaml", "--out", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert words in said and ".csv" in said and not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", SOME_WRONG)
def test_wrong_columns_of_bags_added_to_c3d_files_are_reported_by_name(tmp_path, capsys, name):
    change, words = WRONG[name]
    source = rigid_robot.write(tmp_path / "source", with_readings(change))
    for kind in ("c3d", "bag"):
        assert run("export", kind, source, "--out", tmp_path / kind) == 0
    c3d, bag, first, out = (tmp_path / n for n in ("c3d", "bag", "first", "out"))
    assert run("import", "c3d", *files(c3d), "--map", c3d / "mapping.yaml", "--out", first) == 0
    assert run("import", "bag", *files(bag), "--map", bag / "mapping.yaml", "--add-to", first, "--out", out) == 2
    said = capsys.readouterr().err
    assert words in said and ".bag" in said and not out.exists()


def test_right_columns_are_imported(tmp_path):
    source, csv = rigid_robot.write(tmp_path / "source", trials()), tmp_path / "csv"
    assert run("export", "csv", source, "--out", csv) == 0
    assert run("import", "csv", *files(csv), "--map", csv / "mapping.yaml", "--out", tmp_path / "out") == 0
    assert len(load(tmp_path / "out").description.trials) == 2


D = rigid_robot.described()
CHAIN = chain_of_frames(mjcf.urdf(), D.joint_names, D.base_frame, D.tool_frame)


@pytest.mark.parametrize("reading", list(readings(CHAIN))[::7], ids=lambda r: r.meaning)
def test_every_reading_is_recognised(reading):
    wrong = [(n, replace(t, q_motor=reading.of(t.q_motor))) for n, _, _, t in trials()]
    with pytest.raises(InputError, match=f"^swing and 1 more: {reading.meaning}: .* correct the mapping file"):
        check_columns(D, CHAIN, wrong)


def two_swings(change) -> list[tuple[str, Trial]]:
    """Two swings of one robot and a sweep; the readings of the second swing are changed."""
    return [(n, replace(t, q_motor=change(t.q_motor)) if n == "two" else t) for n, t in right_swings()]


@cache
def right_swings() -> list[tuple[str, Trial]]:
    rng, truth = np.random.default_rng(5), rigid_robot.defects(3)
    drives, found = geared_robot.gears(rng), []
    for name, motor in (
        ("one", geared_robot.swing(rng, 12.0)),
        ("two", geared_robot.swing(rng, 9.0)),
        ("sweep", geared_robot.sweep(4, 6.0)),
    ):
        trial = geared_robot.record(truth, drives, motor, 20.0, rng, 1e-3)
        found.append((name, trial))
    return found


@pytest.mark.parametrize(("change", "words"), [
    (swapped, "joints arm_5_joint and arm_6_joint are swapped: .* correct this file's columns"),
    (reversed_, "joint arm_6_joint is reversed"),
    (lambda q: np.column_stack([q[:, 0], q[:, :0:-1]]), "no two swapped explain it: other columns are swapped"),
])  # fmt: skip
def test_one_wrong_file_among_right_ones_is_named(change, words):
    with pytest.raises(InputError, match=f"^two: .*{words}"):
        check_columns(D, CHAIN, two_swings(change))
    check_columns(D, CHAIN, two_swings(lambda q: q))


def test_columns_in_quite_another_order_are_refused_though_not_explained():
    wrong = [
        (n, replace(t, q_motor=np.column_stack([t.q_motor[:, 0], t.q_motor[:, :0:-1]]))) for n, _, _, t in trials()
    ]
    with pytest.raises(InputError, match="no two swapped explain it"):
        check_columns(D, CHAIN, wrong)


def test_a_joint_that_hardly_moves_and_a_trial_without_markers_are_no_alarm():
    (_, _, _, swing), (_, _, _, sweep) = trials()
    still = swing.q_motor.copy()
    none = replace(sweep, marker=(), marker_body=(), marker_position=np.zeros((len(sweep.t_mocap), 0, 3)))
    check_columns(D, CHAIN, [("sweep", sweep)])  # one joint only: the frames are not reported
    check_columns(D, CHAIN, [("swing", replace(swing, q_motor=still)), ("none", none)])
    check_columns(D, CHAIN, [("none", none)])


def test_one_marker_on_the_hand_tells_swapped_columns_of_postures():
    truth, rng = rigid_robot.defects(3), np.random.default_rng(0)
    q = rigid_robot.near_postures(rng, 30)
    base, hand = (np.array(x) for _, x in rigid_robot.BODIES.values())
    at_hand = rigid_robot.positions(rigid_robot.hand_in_base(truth, q), hand[:1])
    p = np.concatenate([np.broadcast_to(base, (30, *base.shape)), at_hand], axis=1)
    labels = [f"base{i}" for i in range(4)] + ["gripper0"]
    owner = tuple(label[:-1] for label in labels)

    def means(q):
        return PostureMeans(
            "m", rigid_robot.JOINTS, q, tuple(labels), owner, p, np.full(p.shape, 1e-4), np.zeros(q.shape)
        )

    one = D.model_copy(
        update={
            "bodies": tuple(
                b.model_copy(update={"markers": b.markers[:1]}) if b.name == "gripper" else b for b in D.bodies
            )
        }
    )
    assert _shown(one, "m", means(q)).oriented is False
    check_columns(one, CHAIN, [("m", means(q + truth.offset))])
    with pytest.raises(InputError, match="^m: joints arm_5_joint and arm_6_joint are swapped"):
        check_columns(one, CHAIN, [("m", means(swapped(q + truth.offset)))])


@pytest.mark.parametrize(("change", "words"), [
    (lambda q: q, ""),
    (lambda q: q + 1.3, ""),
    (swapped, "link encoder of arm_5_joint follows the motor of arm_6_joint"),
    (reversed_, "link encoder of arm_6_joint has its sign turned"),
])  # fmt: skip
def test_link_readings_are_held_against_their_motor_s(tmp_path, capsys, change, words):
    with_link = [(n, r, k, replace(t, q_link=change(t.q_motor + 5e-3))) for n, r, k, t in trials()[:1]]
    source, csv = rigid_robot.write(tmp_path / "source", with_link), tmp_path / "csv"
    assert run("export", "csv", source, "--out", csv) == 0
    code = run("import", "csv", *files(csv), "--map", csv / "mapping.yaml", "--out", tmp_path / "out")
    said = capsys.readouterr().err
    assert code == (2 if words else 0) and words in said and (tmp_path / "out").exists() == (not words)
