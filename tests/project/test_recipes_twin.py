"""The recipes of CONTRIBUTING.md that add to the twin are carried out, each in a copy of the packages."""

import json
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from scenarios import load
from scenarios.files.errors import ScenarioError
from tests.project.recipes import copied, recipe, run_script
from twin.errors import TwinError
from twin.motions import JOINTS, RATE, schedule, trajectory
from twin.motions.csv_trajectory import InvalidTrajectory, read_trajectory

POSE = [0.12, 1.5, 0.1, -1.55, 0.6, 0.1, 0.1, 0.1]
SHORT = ["twin.campaign.only=[xyz, figure_eight]", "twin.campaign.validation_swing=2.0", "twin.campaign.rest=1.0"]
ADDED = [
    "twin.defects=[{kind: added_mass, link: arm_5_link, mass: {uniform: [0.2, 0.3]}}]",
    "twin.instruments.further=[{kind: gyroscope, bias: 1.0e-3, noise: 1.0e-5}]",
]
RECORD = """
import sys
from pathlib import Path
from scenarios import load
from twin import record
record(load("humanoids2024", sys.argv[2:]).twin, 0, Path(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the packages with a defect, an instrument and a motion added, and a short campaign of all three."""
    tree = copied(tmp_path_factory.mktemp("tree"), "calibration", "mjcf", "scenarios", "twin")
    add_defect(tree)
    add_instrument(tree)
    with (tree / "twin/motions/swings.py").open("a", encoding="utf-8") as file:
        file.write(recipe("motion"))
    run_script(tree, RECORD, str(tree / "out"), *SHORT, *ADDED)
    return tree


@pytest.fixture
def true(tree) -> dict[str, float]:
    truth = json.loads((tree / "out/truth/truth.json").read_text(encoding="utf-8"))
    return {p["name"]: p["value"] for p in truth["parameters"]}


def add_defect(tree: Path) -> None:
    (tree / "twin/defects/added_mass.py").write_text(recipe("defect"), encoding="utf-8")
    face = tree / "twin/defects/__init__.py"
    listed = face.read_text(encoding="utf-8").replace(
        "DEFECTS: tuple[type[Defect], ...] = (\n", "DEFECTS: tuple[type[Defect], ...] = (\n    AddedMass,\n"
    )
    face.write_text(
        listed.replace(
            "from twin.defects.bending", "from twin.defects.added_mass import AddedMass\nfrom twin.defects.bending"
        )
    )


def test_a_defect_is_a_file_and_a_line(true):
    assert 0.2 < true["added_mass.arm_5_link.mass"] < 0.3 and true["added_mass.arm_5_link.x"] == 0.0


def add_instrument(tree: Path) -> None:
    (tree / "twin/instruments/gyroscope.py").write_text(recipe("instrument"), encoding="utf-8")
    face = tree / "twin/instruments/__init__.py"
    text = face.read_text(encoding="utf-8")
    text = text.replace("...] = ()", "...] = (Gyroscope,)")
    text = text.replace(
        "from twin.instruments.instrument",
        "from twin.instruments.gyroscope import Gyroscope\nfrom twin.instruments.instrument",
    )
    face.write_text(text, encoding="utf-8")
    layout = tree / "calibration/recording/trial.py"
    text = layout.read_text(encoding="utf-8").replace("_LABELS = ", f"{recipe('channel')}_LABELS = ", 1)
    last = "    wrist_wrench: np.ndarray = field(default_factory=lambda: _empty(0, 6))\n"
    layout.write_text(text.replace(last, last + recipe("channel-fields")), encoding="utf-8")


def test_an_instrument_is_a_file_a_line_and_its_channels(tree, true):
    with netCDF4.Dataset(tree / "out/dataset/trials/xyz.nc") as file:
        seen, t = (np.array(file[name][:]) for name in ("base_angular_velocity", "t_gyroscope"))
        assert (file["base_angular_velocity"].units, file["t_gyroscope"].clock) == ("rad/s", "mocap")
    zero = [true[f"gyroscope.zero.{axis}"] for axis in "xyz"]
    assert np.ptp(seen, axis=0).max() > 1e-3 and (true["gyroscope.noise"], len(t)) == (1e-5, len(seen))
    np.testing.assert_allclose(seen[(t - t[0]) < 0.5].mean(axis=0), zero, atol=1e-4)


def test_a_motion_is_an_entry(tree):
    _, trial = json.loads((tree / "out/dataset/dataset.json").read_text(encoding="utf-8"))["trials"]
    assert (trial["id"], trial["role"]) == ("figure_eight", "validation")


def test_ten_lines_of_python_change_a_defect_simulate_and_plot(tmp_path):
    run_script(
        tmp_path,
        recipe("python")
        + "one, other = (line.get_ydata() for line in plt.gca().lines)\nassert 1e-4 < abs(one - other).max() < 0.1\n",
    )


def written(path: Path, t: list[float], q: list[list[float]], names: tuple[str, ...] = JOINTS) -> Path:
    rows = [",".join(map(str, (time, *row))) for time, row in zip(t, q, strict=True)]
    path.write_text("\n".join([",".join(("t", *names)), *rows]) + "\n", encoding="utf-8")
    return path


def test_a_trajectory_is_no_file_of_ours(tmp_path, monkeypatch, nominal_model):
    monkeypatch.chdir(tmp_path)
    there = [[*POSE[:1], 1.5 - 0.1 * k, *POSE[2:]] for k in range(4)]
    written(tmp_path / "there.csv", [0.0, 0.5, 1.0, 1.5], there)
    written(tmp_path / "back.csv", [10.0, 10.5, 11.0, 11.5], there[::-1])
    (tmp_path / "mine.yaml").write_text(recipe("trajectory"), encoding="utf-8")
    campaign = load("mine.yaml", ["twin.campaign.only=[xyz]"]).twin.campaign
    motions = {m.id: m for m in schedule(campaign, nominal_model, 0)}
    assert set(motions) == {"xyz", "there", "back"}
    assert (motions["there"].role, motions["back"].role) == ("calibration", "validation")
    rest = round(campaign.rest * RATE)
    np.testing.assert_allclose(motions["there"].command[rest :: round(0.5 * RATE)][:4], there, atol=1e-12)
    np.testing.assert_allclose(motions["back"].command, motions["there"].command[::-1], atol=1e-12)
    assert np.ptp(motions["there"].command[: rest + 1], axis=0).max() == 0.0
    alone = load("humanoids2024", ["twin.campaign.motions={mine: back.csv}"]).twin.campaign.motions["mine"]
    assert (alone.file, alone.role) == ("back.csv", "validation")


@pytest.mark.parametrize(
    ("t", "q", "message"),
    [
        ([0.0, 1.0], [POSE, [*POSE[:1], 3.0, *POSE[2:]]], "arm_1_joint is at 3 at t = 1 s; it goes from 0 to 2.7"),
        (
            [0.0, 0.1],
            [POSE, [*POSE[:1], 1.0, *POSE[2:]]],
            "arm_1_joint moves at 5 rad/s after t = 0 s; its limit is 1.95 rad/s",
        ),
        ([0.0, 0.0], [POSE, POSE], "times must rise; after t = 0 s they do not"),
        ([0.0], [POSE], "n >= 2"),
        ([0.0, 1.0], [POSE, [float("nan"), *POSE[1:]]], "every number must be finite"),
    ],
)
def test_what_the_robot_cannot_follow_is_refused(tmp_path, t, q, message):
    with pytest.raises(InvalidTrajectory, match=message):
        trajectory("mine", t, np.array(q))
    with pytest.raises(TwinError, match=f"mine.csv: .*{message}"):
        read_trajectory(written(tmp_path / "mine.csv", t, q), "mine", "validation", 1.0)


def test_files_that_are_no_trajectories_are_refused(tmp_path):
    def refused(text: str) -> str:
        (tmp_path / "mine.csv").write_text(text, encoding="utf-8")
        with pytest.raises(InvalidTrajectory) as info:
            read_trajectory(tmp_path / "mine.csv", "mine", "validation", 1.0)
        return str(info.value)

    assert "columns are t, arm_1_joint; there must be t, torso_lift_joint, arm_1_joint" in refused(
        "t,arm_1_joint\n0,1\n"
    )
    assert "could not convert string to float: 'x'" in refused(",".join(("t", *JOINTS)) + "\nx" + ",0" * 8 + "\n")
    assert "mine.csv: " in refused("")
    with pytest.raises(InvalidTrajectory, match="none.csv: cannot be read: No such file"):
        read_trajectory(tmp_path / "none.csv", "mine", "validation", 1.0)
    with pytest.raises(ScenarioError, match="there is a trial of this name; choose another"):
        load("humanoids2024", ["twin.campaign.motions={xyz: mine.csv}"])


@pytest.fixture(scope="module")
def nominal_model():
    import mjcf

    return mjcf.model()
