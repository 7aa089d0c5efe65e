"""The head-to-head of joint corrections: its page, and the command that makes it."""

import pytest
from typer.testing import CliRunner

from scenarios.commands.main import app
from scenarios.datasets.index import Row
from scenarios.datasets.run_spec import Magnitude
from scenarios.studies import joint_run
from scenarios.studies.joint_table import page


def row(id: int, none: float, physical: float) -> Row:
    values = {"none.static.arm_1_joint_mrad": none, "physical.static.arm_1_joint_mrad": physical}
    return Row(id, "ok", magnitudes=tuple(Magnitude(*item) for item in values.items()))


def test_the_page_has_medians_and_the_worst_and_counts_failed_robots():
    text = page(
        {"rigid": [row(0, 1.0, 0.1), row(1, 3.0, 0.3), row(2, 2.0, 0.2), Row(3, "failed", "no rank")]}, "Made by hand."
    )
    assert "\n\nMade by hand.\n" in text and "## `rigid`, 3 of 4 robots" in text
    assert "| none | 2.00 [3.00] |" in text and "| physical | 0.20 [0.30] |" in text
    assert "| Static | arm_1 |" in text and "In sample |" not in text


def test_one_command_makes_the_page_of_several_scenarios(tmp_path, monkeypatch):
    monkeypatch.setattr(joint_run, "head_to_head", fake)
    command = ["study", "joints", "short", "rigid", "-n", "2", "--out", str(tmp_path / "s"), "--workers", "0"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    text = (tmp_path / "s" / "joints.md").read_text()
    assert text.count("2 of 2 robots") == 2 and "study joints short rigid -n 2" in text


def fake(scenario, out):
    return (Magnitude("none.new_motion.arm_1_joint_mrad", float(scenario.seed % 7)),)


@pytest.mark.slow
def test_physical_drive_trains_beat_the_printed_sigmoid_on_new_motion(tmp_path):
    command = ["study", "joints", "humanoids2024", "-n", "2", "--out", str(tmp_path / "s")]
    assert CliRunner().invoke(app, command).exit_code == 0
    index = (tmp_path / "s" / "humanoids2024" / "index.csv").read_text().splitlines()
    names = index[0].split(",")
    for line in index[1:]:
        run = dict(zip(names, line.split(","), strict=True))
        for k in range(1, 8):
            errors = {c: float(run[f"{c}.new_motion.arm_{k}_joint_mrad"]) for c in ("physical", "sigmoid_total")}
            assert errors["physical"] < 0.6 * errors["sigmoid_total"]
