"""`tiago-twin look`: a page a trial, and what it says of holes, gaps, loads and missing encoders."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from calibration.numerics.wrench import centre_of_pressure
from calibration.recording.dataset import load
from scenarios.commands import main
from scenarios.plots.style import MISSED, drawing
from scenarios.quicklook.page import look, page
from scenarios.quicklook.plots import gaps, holes
from scenarios.quicklook.summary import looked_at
from tests.calibration.recording.test_posture_means import dataset as means_dataset
from tests.calibration.recording.test_posture_means import means
from tests.doubles import rigid_robot


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A sweep with a hidden marker, lost messages, one joint without link readings and a plate unloaded at first."""
    truth, rng = rigid_robot.defects(2), np.random.default_rng(2)
    trial = rigid_robot.record(truth, rigid_robot.sweep(3, seconds=3.0), 12.0, rng)
    position, wrench = trial.marker_position.copy(), trial.plate_wrench.copy()
    position[100:130, 5] = np.nan
    wrench[:50] = 0.3 * rng.normal(size=wrench[:50].shape)
    there = np.ones(len(trial.t_robot), dtype=bool)
    there[100:120] = False
    link = trial.q_motor + 1e-3 * np.sin(trial.t_robot)[:, None]
    link[:, 0] = np.nan
    trial = replace(replace(trial, q_link=link), marker_position=position, plate_wrench=wrench)
    readings = ("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command")
    trial = replace(trial, **{name: getattr(trial, name)[there] for name in readings})
    return rigid_robot.write(tmp_path_factory.mktemp("look") / "dataset", [("sweep", "calibration", "sweep", trial)])


@pytest.fixture(scope="module")
def one(folder):
    dataset = load(folder)
    return looked_at(dataset, dataset.description.trials[0])


@pytest.fixture(scope="module")
def panels(folder, one):
    with drawing():
        return {ax.get_title(loc="left"): ax for ax in page(load(folder), one).axes}


def run(*arguments):
    with pytest.raises(SystemExit) as left:
        main.main(["look", *map(str, arguments)])
    return left.value.code


def test_a_picture_a_trial_and_what_it_holds_in_words(folder, tmp_path, capsys):
    assert run(folder, "--out", tmp_path / "pictures") == 0
    assert [p.name for p in (tmp_path / "pictures").iterdir()] == ["sweep.png"]
    said = capsys.readouterr().out
    n = len(load(folder).read(load(folder).description.trials[0]).t_plate)
    for words in (
        "1 hole of up to 210 ms",
        "gripper1 the most",
        f"{100 * 50 / n:.2g} % not loaded",
        rigid_robot.JOINTS[0],
    ):
        assert words in said


def test_a_marker_that_moves_on_its_body_is_reported(tmp_path):
    trial = rigid_robot.record(
        rigid_robot.defects(2), rigid_robot.sweep(3, seconds=3.0), 12.0, np.random.default_rng(2)
    )
    position = trial.marker_position.copy()
    position[200:, trial.marker_body.index("base")] += [2e-3, 0.0, 0.0]
    trial = replace(trial, marker_position=position)
    dataset = load(rigid_robot.write(tmp_path / "dataset", [("sweep", "calibration", "sweep", trial)]))
    (said,) = (line for line in looked_at(dataset, dataset.description.trials[0]).findings if "cluster noise" in line)
    moved = dict(part.split() for part in said.split(": ")[1].split(", "))
    assert float(moved["base"]) > 0.3 and float(moved["gripper"]) < 0.1


def test_gaps_are_drawn_where_the_marker_was_hidden(panels, one):
    ax, t = panels["markers and gaps"], one.trial.t_mocap - one.trial.t_mocap[0]
    lost = [line for line in ax.lines if to_hex(line.get_color()) == MISSED]
    (gap,) = lost
    np.testing.assert_allclose(gap.get_xdata(), t[[100, 129]])
    assert set(gap.get_ydata()) == {5.0} and ax.get_yticklabels()[5].get_text() == "gripper1"


def test_nothing_is_drawn_where_messages_were_lost(panels):
    ax = panels["arm_3_joint: link - motor"]
    first, second = (line.get_xdata() for line in ax.lines)
    assert second[0] - first[-1] == pytest.approx(0.21, rel=1e-3)
    assert ax.get_ylabel() == "[mrad]"


def test_a_joint_without_a_link_encoder_is_reported(panels):
    (text,) = panels["torso_lift_joint: link - motor"].texts
    assert text.get_text() == "no link encoder"


def test_the_centre_of_pressure_is_drawn_in_millimetres_while_the_plate_is_loaded(panels, one):
    path = panels["centre of pressure, a ring where it begins"].lines[0].get_xydata()
    w, centre = one.trial.plate_wrench[:, 0], one.trial.plate_centre[0]
    assert np.isnan(path[:50]).all()
    np.testing.assert_allclose(path[50:, 0], 1e3 * (centre[0] - w[50:, 4] / w[50:, 2]))
    np.testing.assert_allclose(path[50:, 1], 1e3 * (centre[1] + w[50:, 3] / w[50:, 2]))


def test_force_is_drawn_about_its_mean_which_the_legend_tells(panels, one):
    w = one.trial.plate_wrench[:, 0]
    legend = [text.get_text() for text in panels["force on the plates"].get_legend().get_texts()]
    assert f"Fz {-w[:, 2].mean():+.0f} N" in legend


def test_posture_means_have_a_picture_too(tmp_path):
    folder = means_dataset(tmp_path / "means", {"calibration": means(rigid_robot.defects(1), 12)})
    (found,) = look(folder, tmp_path / "out")
    assert "12 static postures as means" in found.findings[0] and len(list((tmp_path / "out").iterdir())) == 1


def test_an_unknown_trial_and_a_folder_that_is_none_are_reported_and_nothing_is_written(folder, tmp_path, capsys):
    assert run(folder, "--trial", "swing", "--out", tmp_path / "out") == 2
    assert "no trial 'swing'; its trials are sweep" in capsys.readouterr().err
    assert run(tmp_path / "nothing", "--out", tmp_path / "out") == 2
    assert "dataset.json" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_runs_of_what_is_missing():
    assert gaps(np.array([0, 0, 1, 1, 0, 1, 0], bool)) == [(0, 1), (4, 4), (6, 6)]
    assert gaps(np.ones(3, bool)) == [] and holes(np.array([0.0])).tolist() == []
    assert holes(np.array([0.0, 0.1, 0.2, 0.5, 0.6])).tolist() == [2]


def test_a_plate_that_carries_next_to_nothing_has_no_centre_of_pressure():
    wrench = np.array([[0.0, 0.0, -100.0, 5.0, -3.0, 0.0], [0.0, 0.0, -19.9, 5.0, -3.0, 0.0], np.zeros(6)])
    found = centre_of_pressure(wrench, np.array([0.9, 0.45, 0.1]))
    np.testing.assert_allclose(found[0], [0.9 - 0.03, 0.45 - 0.05, 0.1])
    assert np.isnan(found[1:]).all()
    np.testing.assert_allclose(centre_of_pressure(-wrench, np.array([0.9, 0.45, 0.1]))[0], found[0])


def test_the_weight_at_both_ends_the_motors_and_the_wrist_are_reported(tmp_path):
    rng, names = np.random.default_rng(0), rigid_robot.JOINTS
    trial = rigid_robot.record(rigid_robot.defects(2), rigid_robot.sweep(3, seconds=3.0), 12.0, rng)
    wrench, effort = trial.plate_wrench.copy(), np.zeros_like(trial.effort)
    wrench[...] = [0.0, 0.0, -700.0, 0.0, 0.0, 0.0]
    effort[40, 4] = -2.25
    wrist = np.zeros((len(trial.t_robot), 6))
    wrist[10, :3], wrist[10:, 0] = [3.0, 4.0, 0.0], 6.0
    late = np.flatnonzero(trial.t_plate >= trial.t_plate[-1] - 1.0)
    wrench[late, :, 2] = -700.0 - 1.5 / wrench.shape[1]
    trial = replace(trial, plate_wrench=wrench, effort=effort, wrist_wrench=wrist)
    folder = rigid_robot.write(tmp_path / "dataset", [("sweep", "calibration", "sweep", trial)])
    said = "\n".join(looked_at(load(folder), load(folder).description.trials[0]).findings)
    assert "in the last: -1.50 N" in said
    assert f"motor currents of 8 joints, {names[4]} the most, 2.25 A" in said
    assert "wrist: force 0.0-7.2 N" in said
