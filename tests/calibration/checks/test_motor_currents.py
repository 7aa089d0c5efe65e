"""Motor currents swapped or reversed, named by gravity; none where friction, few postures or no load show nothing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calibration import load
from calibration.checks.motor_currents import check_currents
from calibration.errors import InputError
from calibration.recording.trial import Trial
from scenarios.commands import main
from tests.calibration.checks.test_joint_columns import CHAIN, files
from tests.doubles import rigid_robot

PER_AMPERE = np.array([1000.0, 13.6, 13.6, 8.7, 8.7, 20.6, 20.6, 20.6])
FRICTION, QUANTUM = np.array([100.0, 0.6, 0.6, 0.5, 0.5, 0.15, 0.15, 0.15]), 1e-3  # [N, N.m], [A]
ARM = [rigid_robot.JOINTS.index(f"arm_{k}_joint") for k in range(1, 8)]


@cache
def postures(n: int = 20) -> Trial:
    """Postures of a robot whose motors hold it, each stuck somewhere within its friction."""
    rng = np.random.default_rng(2)
    motor, dwells = rigid_robot.through(rigid_robot.random_angles(rng, n, torso=False), 1.0, 1.0)
    trial = rigid_robot.record(rigid_robot.defects(2), motor, 20.0, rng, dwells)
    stuck = np.repeat(rng.uniform(-1.0, 1.0, (n + 1, 8)), 200, axis=0)
    held = CHAIN.gravity_torques(trial.q_motor) + (FRICTION * np.resize(stuck, trial.q_motor.shape))
    return replace(trial, effort=np.round(held / PER_AMPERE / QUANTUM) * QUANTUM)


def changed(trial: Trial, order: dict[int, int], turned: tuple[int, ...] = ()) -> Trial:
    effort = trial.effort[:, [order.get(k, k) for k in range(8)]].copy()
    effort[:, turned] *= -1.0
    return replace(trial, effort=effort)


@pytest.mark.parametrize(("order", "turned", "words"), [
    ({}, (ARM[3],), "joint arm_4_joint: its motor current falls .* in `reversed_effort`"),
    ({ARM[1]: ARM[3], ARM[3]: ARM[1]}, (), "joint arm_2_joint: .* torque of arm_4_joint .*; joint arm_4_joint: "),
    ({ARM[6]: ARM[4], ARM[4]: ARM[6]}, (), "joint arm_7_joint: its motor current follows .* of arm_5_joint"),
])  # fmt: skip
def test_wrong_currents_are_reported_by_name(order, turned, words):
    with pytest.raises(InputError, match=f"^here: .*{words}"):
        check_currents(CHAIN, [("here", changed(postures(), order, turned)), ("there", postures())])
    halves = [(name, changed(postures(n), order, turned)) for name, n in (("one", 11), ("two", 10))]
    with pytest.raises(InputError, match=f"^one and 1 more: .*{words}"):
        check_currents(CHAIN, halves)


def test_right_currents_are_no_alarm_and_what_gravity_does_not_tell_is_none():
    trial = postures()
    check_currents(CHAIN, [("here", trial)])
    check_currents(CHAIN, [("here", changed(trial, {}, (ARM[0], ARM[6])))])  # they carry nothing
    check_currents(CHAIN, [("here", changed(postures(6), {}, (ARM[3],)))])  # too few postures
    check_currents(CHAIN, [("here", replace(trial, effort=np.full_like(trial.effort, np.nan)))])
    pulled = trial.effort + 0.5 * trial.q_motor / PER_AMPERE * np.eye(8)[ARM[4]] * 10.0  # a harness at arm_5
    check_currents(CHAIN, [("here", replace(trial, effort=pulled))])


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as exit:
        main.main([str(a) for a in arguments])
    return exit.value.code


def test_an_import_refuses_a_reversed_current_unless_the_mapping_declares_it(tmp_path, capsys):
    wrong = changed(postures(), {}, (ARM[3],))
    source, csv = rigid_robot.write(tmp_path / "s", [("postures", "calibration", "static", wrong)]), tmp_path / "csv"
    assert run("export", "csv", source, "--out", csv) == 0
    args = ("import", "csv", *files(csv), "--map", csv / "mapping.yaml", "--out", tmp_path / "out")
    assert run(*args) == 2
    assert "arm_4_joint" in capsys.readouterr().err and not (tmp_path / "out").exists()
    text = (csv / "mapping.yaml").read_text()
    (csv / "mapping.yaml").write_text(text.replace("reversed_effort: []", "reversed_effort: [arm_4_joint]"))
    assert run(*args) == 0
    ((_, found),) = load(tmp_path / "out").trials("calibration")
    np.testing.assert_allclose(found.effort, postures().effort, atol=1e-12)
    (csv / "mapping.yaml").write_text(text.replace("reversed_effort: []", "reversed_effort: [arm_9_joint]"))
    assert run(*args) == 2 and "arm_9_joint" in capsys.readouterr().err
