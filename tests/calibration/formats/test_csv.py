"""CSV in: static postures and samples, what is read, what is refused and how it is reported."""

from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from calibration import load
from calibration.formats.csv.read import read_csv
from calibration.formats.mapping.layouts import CsvTable
from calibration.recording.schema import Setup
from tests.doubles import rigid_robot

JOINTS = {name: {"motor": name, "unit": "m" if name.startswith("torso") else "rad"} for name in rigid_robot.JOINTS}
HAND = {f"gripper{i}": [f"gripper{i}_{a}" for a in "xyz"] for i in range(4)}
BASE = {f"base{i}": [f"base{i}_{a}" for a in "xyz"] for i in range(4)}
PLATE = {"force": ["Fx", "Fy", "Fz"], "moment": ["Mx", "My", "Mz"], "convention": "action", "axes": "lab"}
PLATE |= {"about": "centre", "force_unit": "N", "moment_unit": "N.m"}


def mapping(**changes):
    """A mapping of the matched robot; its markers are drawn."""
    described = rigid_robot.description([])
    bodies = described.pop("bodies")
    setup = {k: v for k, v in described.items() if k not in ("schema", "trials")}
    return deepcopy({"urdf": "tiago", "setup": setup, "bodies": bodies, "trials": [], "csv": []} | changes)


def write_csv(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join("" if x != x else repr(float(x)) for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def postures(n: int = 12, seed: int = 0) -> dict[str, np.ndarray]:
    """Columns of static postures of a robot a little off nominal, hand markers in the base body's frame."""
    rng, truth = np.random.default_rng(seed), rigid_robot.defects(1)
    q = rigid_robot.near_postures(rng, n)
    T = rigid_robot.hand_in_base(truth, q)
    p = np.einsum("nij,mj->nmi", T[:, :3, :3], np.array(rigid_robot.BODIES["gripper"][1])) + T[:, None, :3, 3]
    columns = {name: (q + truth.offset)[:, j] for j, name in enumerate(rigid_robot.JOINTS)}
    return columns | {c: p[:, k, a] for k, name in enumerate(HAND) for a, c in enumerate(HAND[name])}


def static_mapping(**table):
    base = {"name": "base", "link": "base_footprint", "fitted": True}
    hand = {"name": "gripper", "link": "gripper_grasping_frame", "undrawn": list(HAND), "fitted": True}
    found = mapping(
        bodies=[base, hand],
        trials=[{"id": "postures", "role": "calibration", "kind": "static"}],
        csv=[{"marker_std": 1e-4, "markers": HAND, "joints": JOINTS} | table],
    )
    found["setup"] |= {"marker_frame": "base", "plates": []}
    return found


def series(n: int = 300, seed: int = 0) -> dict[str, np.ndarray]:
    """Columns of base markers and a plate on one clock, the robot standing at (0.9, 0.5), heading -1.6."""
    rng = np.random.default_rng(seed)
    T = rigid_robot.se3(np.array([0.9, 0.5, 0.0, 0.0, 0.0, -1.6]))
    p = np.array(rigid_robot.BODIES["base"][1]) @ T[:3, :3].T + T[:3, 3] + 1e-4 * rng.normal(size=(n, 4, 3))
    f = np.array([3.0, -2.0, -730.0]) + rng.normal(size=(n, 3))
    r = np.array([0.9, 0.5, 0.0]) + [0.01, 0.02, 0.0]
    m = np.cross(r, f) + [0.0, 0.0, 0.5]
    columns = {"t": np.arange(n) / 100.0}
    columns |= {c: p[:, k, a] for k, name in enumerate(BASE) for a, c in enumerate(BASE[name])}
    columns |= {c: f[:, k] for k, c in enumerate(PLATE["force"])} | {c: m[:, k] for k, c in enumerate(PLATE["moment"])}
    return columns | dict(zip(("Cx", "Cy", "Cz"), [-m[:, 1] / f[:, 2], m[:, 0] / f[:, 2], 0.0 * f[:, 0]], strict=True))


def series_mapping(plate=None, **table):
    bodies = rigid_robot.description([])["bodies"]
    return mapping(
        bodies=bodies,
        trials=[{"id": "log", "role": "calibration", "kind": "swing"}],
        csv=[
            {
                "time": {"column": "t", "unit": "s"},
                "markers": BASE,
                "plates": {"plate": PLATE | {"cop": ["Cx", "Cy", "Cz"]} | (plate or {})},
            }
            | table
        ],
    )


def test_static_postures_are_read_with_their_units(lab):
    columns = postures()
    scaled = {k: np.degrees(v) if k.startswith("arm") else 1e3 * v for k, v in columns.items()}
    joints = {n: {"motor": n, "unit": "mm" if n.startswith("torso") else "deg"} for n in rigid_robot.JOINTS}
    lab.run(static_mapping(marker_unit="mm", joints=joints), write_csv(lab.folder / "postures.csv", scaled))
    ((_, means),) = load(lab.out).means("calibration")
    np.testing.assert_allclose(means.q_motor, np.stack([columns[n] for n in rigid_robot.JOINTS], axis=1), atol=1e-12)
    np.testing.assert_allclose(means.marker_position[:, 2, 1], columns["gripper2_y"], atol=1e-12)
    assert (means.marker_position_std == 1e-4).all()


def test_undrawn_markers_get_their_shape_and_a_place_near_the_true_one(lab):
    lab.run(static_mapping(), write_csv(lab.folder / "postures.csv", postures(30)))
    body = load(lab.out).description.bodies[1]
    shape, true = np.array([m.xyz for m in body.markers]), np.array(rigid_robot.BODIES["gripper"][1])
    for i in range(4):
        np.testing.assert_allclose(*(np.linalg.norm(x - x[i], axis=1) for x in (shape, true)), atol=1e-9)
    T = rigid_robot.se3(np.array(body.placement))
    # the drawing is not reported; what remains is the robot's own defects, some millimetres at the hand
    np.testing.assert_allclose(shape @ T[:3, :3].T + T[:3, 3], true, atol=0.03)


def test_samples_are_read_on_one_clock_and_the_plate_is_confirmed_by_its_cop(lab):
    columns = series()
    notes = lab.run(series_mapping(), write_csv(lab.folder / "log.csv", columns))
    dataset = load(lab.out)
    ((_, trial),) = dataset.trials("calibration")
    assert dataset.description.mocap_clock == ("plate",)
    np.testing.assert_array_equal(trial.t_mocap, columns["t"])
    np.testing.assert_array_equal(trial.t_plate, columns["t"])
    np.testing.assert_allclose(trial.plate_wrench[:, 0, 4], columns["My"], rtol=1e-7)
    assert "confirmed by its CoP" in notes[0]


def test_reaction_in_plate_axes_about_the_lab_origin_in_newton_millimetres_is_the_same_wrench(lab):
    columns = series()
    described = series_mapping({"convention": "reaction", "axes": "plate", "about": "lab", "moment_unit": "N.mm"})
    axes = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    described["setup"]["plates"] = [{"name": "plate", "centre": [0.1, 0.2, 0.0], "axes": axes, "size": [3.0, 3.0]}]
    R = np.array(axes).T
    f, m = (np.stack([columns[c] for c in PLATE[key]], axis=1) for key in ("force", "moment"))
    other = dict(columns)
    for k, c in enumerate(PLATE["force"]):
        other[c] = -(f @ R)[:, k]
    for k, c in enumerate(PLATE["moment"]):
        other[c] = -1e3 * (m @ R)[:, k]
    lab.run(described, write_csv(lab.folder / "log.csv", other))
    ((_, trial),) = load(lab.out).trials("calibration")
    expected = np.concatenate([f, m - np.cross([0.1, 0.2, 0.0], f)], axis=1)
    np.testing.assert_allclose(trial.plate_wrench[:, 0], expected, atol=1e-4)


def test_a_force_whose_sign_is_opposite_is_turned_before_moments_are_moved(lab):
    columns = series()
    lab.run(series_mapping(), write_csv(lab.folder / "log.csv", columns))
    ((_, right),) = load(lab.out).trials("calibration")
    lab.run(series_mapping({"reversed": ["Fy"]}), write_csv(lab.folder / "log.csv", columns | {"Fy": -columns["Fy"]}))
    ((_, turned),) = load(lab.out).trials("calibration")
    np.testing.assert_array_equal(turned.plate_wrench, right.plate_wrench)


def test_only_a_force_can_be_reversed(lab, capsys):
    said = lab.refused(capsys, series_mapping({"reversed": ["My"]}), write_csv(lab.folder / "log.csv", series()))
    assert "`reversed` names columns of `force` ['Fx', 'Fy', 'Fz'], found ['My']" in said


def changed(columns, **new):
    return {k: new.get(k, v) for k, v in columns.items()}


def series_cases():
    good = series()
    gap = np.where(np.arange(300) == 7, np.nan, good["Fz"])
    zero = {c: np.where(np.arange(300) == 50, 0.0, good[c]) for c in BASE["base1"]}
    back, twice = good["t"].copy(), good["t"].copy()
    back[50], twice[50] = 0.2, good["t"][49]
    up = {c: -good[c] for c in (*PLATE["force"], *PLATE["moment"])}
    kilo = {c: 1e-3 * good[c] for c in (*PLATE["force"], *PLATE["moment"])}
    milli, blind = {c: 1e3 * good[c] for c in PLATE["moment"]}, {"plate": PLATE}
    never = {c: np.full(300, np.nan) for c in BASE["base3"]}
    return {
        "time goes back": (changed(good, t=back), {}, ["log.csv:52:1: t: time 0.2 does not increase; remove"]),
        "time twice": (changed(good, t=twice), {}, ["log.csv:52:1: t: time 0.49 is the same as in the row before"]),
        "millimetres": ({k: 1e3 * v if "base" in k else v for k, v in good.items()}, {}, ["marker_unit"]),
        "one marker's columns": (changed(good, base1_x=good["base2_x"]), {}, ["nominal 300 mm", "swapped"]),
        "no column": ({k: v for k, v in good.items() if k != "My"}, {}, ["log.csv:1:1: My: no such column"]),
        "zero gap": (good | zero, {}, ["log.csv:52:5: base1_x: the marker is at exactly (0, 0, 0)", "gaps: zero"]),
        "upside down": (good | up, {}, ["log.csv: Fx, Fy, Fz", "pull it up with 730 N", "convention: reaction"]),
        "kilonewtons": (good | kilo, {"plates": blind}, ["log.csv", "plate carries 0.73 N", "see the plate's units"]),
        "moments in newton millimetres": (good | milli, {"plates": blind},
            ["log.csv", "its centre of pressure is", "outside the plate; see the moments' unit"]),
        "a marker never seen": (good | never, {}, ["log.csv", "marker base3 is never seen; take it out"]),
        "plate gap": (changed(good, Fz=gap), {}, ["log.csv:9:16: Fz: the cell is empty"]),
    }  # fmt: skip


@pytest.mark.parametrize("name", series_cases())
def test_bad_samples_are_reported_by_file_column_and_remedy(lab, capsys, name):
    columns, table, words = series_cases()[name]
    said = lab.refused(capsys, series_mapping(**table), write_csv(lab.folder / "log.csv", columns))
    for word in words:
        assert word in said


def test_a_gap_written_as_zeros_is_an_occlusion_where_that_is_mapped(lab):
    columns = series()
    gap = {c: np.where(np.arange(300) == 50, 0.0, columns[c]) for c in BASE["base1"]}
    lab.run(series_mapping(gaps="zero"), write_csv(lab.folder / "log.csv", columns | gap))
    ((_, trial),) = load(lab.out).trials("calibration")
    assert np.argwhere(np.isnan(trial.marker_position[:, 1, 0])).tolist() == [[50]]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"about": "lab"}, "action, lab axes, about the surface centre, moments in N.m"),
        ({"moment_unit": "N.mm"}, "about the surface centre, moments in N.m; map that"),
    ],
)
def test_a_declared_convention_the_cop_contradicts_is_refused_and_the_right_one_named(lab, capsys, wrong, words):
    columns, centre = series(), np.array([0.4, 0.3, 0.0])
    described = series_mapping(wrong)
    described["setup"]["plates"][0]["centre"] = centre.tolist()
    f, m = (np.stack([columns[c] for c in PLATE[key]], axis=1) for key in ("force", "moment"))
    m = m - np.cross(centre, f)
    said = lab.refused(
        capsys, described, write_csv(lab.folder / "log.csv", columns | dict(zip(PLATE["moment"], m.T, strict=True)))
    )
    assert "is" in said and words in said


def test_a_centre_of_pressure_that_wanders_while_nothing_presses_confirms_nothing_and_hurts_nothing(lab):
    columns, rng = series(), np.random.default_rng(3)
    empty = np.arange(300) < 200  # the robot is put down after two thirds of the file
    for name in (*PLATE["force"], *PLATE["moment"]):
        columns[name] = np.where(empty, rng.normal(size=300), columns[name])
    for name in ("Cx", "Cy"):
        columns[name] = np.where(empty, 5.0 * rng.normal(size=300), columns[name])
    described = series_mapping()
    described["setup"]["plates"][0]["size"] = [20.0, 20.0]
    file = write_csv(lab.folder / "log.csv", columns)
    table = CsvTable.model_validate(described["csv"][0])
    recorded = read_csv([file], [table], Setup.model_validate(described["setup"]))
    assert "confirmed by its CoP to" in recorded.notes[0]


def test_a_plate_with_z_down_is_recognised_by_its_cop(lab, capsys):
    columns = series()
    down = {c: -columns[c] for c in ("Fy", "Fz", "My", "Mz")}
    described = series_mapping({"convention": "reaction"})
    said = lab.refused(capsys, described, write_csv(lab.folder / "log.csv", columns | down))
    assert "plate axes ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))" in said


def static_cases():
    good, arm = postures(), ("arm_5_joint", "arm_6_joint")
    return {
        "degrees": ({k: np.degrees(v) if k.startswith("arm") else v for k, v in good.items()}, ["degrees?"]),
        "millimetres": ({k: 1e3 * v if "gripper" in k else v for k, v in good.items()}, ["marker_unit"]),
        "metres as millimetres": ({k: 1e-3 * v if "gripper" in k else v for k, v in good.items()}, ["marker_unit"]),
        "two markers swapped": (good | {"gripper0_x": good["gripper1_x"], "gripper1_x": good["gripper0_x"]},
            ["body gripper is not rigid", "swapped"]),
        "a marker mapped twice": (good | {c: good[d] for c, d in zip(HAND["gripper0"], HAND["gripper1"], strict=True)},
            ["markers gripper0 and gripper1 are at the same place"]),
        "two joints swapped": (good | dict(zip(arm[::-1], (good[n] for n in arm), strict=True)), ["swapped"]),
        "a joint's sign": (good | {"arm_3_joint": -good["arm_3_joint"]}, ["joint"]),
        "a reading missing": (good | {"arm_3_joint": np.where(np.arange(12) == 4, np.nan, good["arm_3_joint"])},
            ["postures.csv:6:4: arm_3_joint: the cell is empty"]),
    }  # fmt: skip


@pytest.mark.parametrize("name", static_cases())
def test_bad_postures_are_reported_by_file_column_and_remedy(lab, capsys, name):
    columns, words = static_cases()[name]
    said = lab.refused(capsys, static_mapping(), write_csv(lab.folder / "postures.csv", columns))
    for word in ("postures.csv", *words):
        assert word in said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "postures.csv:1:1: no rows below the header"),
        ("1.0,2.0,3.0\n1.0,2.0,3.0\n", "write a header line"),
        ("a,a\n1.0,2.0\n", "columns named more than once: ['a']"),
        ("a,b\n1.0,2.0\n1.0\n", "postures.csv:3:1: 1 cells, the header has 2: truncated"),
        ("a,b\n1.0,\x00\n", "postures.csv"),
    ],
)
def test_a_broken_file_is_reported_by_line(lab, capsys, text, words):
    (lab.folder / "postures.csv").write_text(text)
    assert words in lab.refused(capsys, static_mapping(), lab.folder / "postures.csv")


def test_text_in_a_cell_is_reported_by_line_and_column(lab, capsys):
    path = write_csv(lab.folder / "postures.csv", postures())
    lines = path.read_text().splitlines()
    lines[3] = lines[3].replace(lines[3].split(",")[1], "n/a")
    path.write_text("\n".join(lines))
    assert "postures.csv:4:2: arm_1_joint: 'n/a' is no number" in lab.refused(capsys, static_mapping(), path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m["csv"][0]["joints"].update(arm_9_joint={"motor": "arm_1_joint", "unit": "rad"}), "arm_9_joint"),
        (lambda m: m["csv"][0]["joints"].pop("arm_4_joint"), "joints: ['arm_4_joint'] of the setup are not mapped"),
        (lambda m: m["setup"]["joints"][0].update(name="lift"), "no joint named 'lift'"),
        (lambda m: m["bodies"][1].update(undrawn=["gripper0", "gripper1", "gripper2"]), "['gripper3'] belong to no"),
        (lambda m: m["csv"][0].update(marker_unit="cm"), "map.yaml:"),
        (lambda m: m["csv"][0].pop("marker_std"), "give `time` for samples"),
        (lambda m: m["trials"][0].update(id="others"), "no trial of the mapping has the file 'postures'"),
        (lambda m: m["trials"].append({"id": "b", "role": "calibration", "kind": "static"}), "trials.b: no file"),
        (lambda m: m["trials"][0].update(kind="swing"), "holds static postures, trial postures is declared as swing"),
        (lambda m: m.update(csv=[]), "csv: missing"),
        (lambda m: m.update(urdf="ti\0ago"), "urdf: String should match pattern"),
    ],
)  # fmt: skip
def test_a_mapping_that_does_not_fit_is_reported(lab, capsys, change, words):
    described = static_mapping()
    change(described)
    assert words in lab.refused(capsys, described, write_csv(lab.folder / "postures.csv", postures()))


def robot_mapping(convention="reaction"):
    wrist = {"force": ["Wx", "Wy", "Wz"], "moment": ["Tx", "Ty", "Tz"], "convention": convention}
    table = {"time": {"column": "t", "unit": "s"}, "joints": JOINTS, "wrist": wrist}
    return mapping(trials=[{"id": "log", "role": "calibration", "kind": "swing"}], csv=[table])


def test_the_wrist_s_reaction_is_read_as_its_action(lab):
    rng, columns = np.random.default_rng(0), {"t": np.arange(50) / 100.0}
    columns |= {name: np.full(50, q) for name, q in zip(rigid_robot.JOINTS, rigid_robot.CENTRE, strict=True)}
    w = {c: rng.normal(size=50) for c in ("Wx", "Wy", "Wz", "Tx", "Ty", "Tz")}
    notes = lab.run(robot_mapping(), write_csv(lab.folder / "log.csv", columns | w))
    ((_, trial),) = load(lab.out).trials("calibration")
    np.testing.assert_allclose(trial.wrist_wrench, -np.stack(list(w.values()), axis=1), rtol=1e-6)
    assert not any("not used" in note for note in notes)


def test_a_wrist_without_joints_beside_it_is_reported(lab, capsys):
    described = robot_mapping()
    described["csv"][0]["joints"] = {}
    said = lab.refused(capsys, described, write_csv(lab.folder / "log.csv", series()))
    assert "`wrist` is sampled with the joints" in said


def test_readings_off_by_a_wrong_zero_are_not_called_degrees(lab, capsys):
    columns = postures()
    columns["arm_4_joint"] = columns["arm_4_joint"] - 3.5
    said = lab.refused(capsys, static_mapping(), write_csv(lab.folder / "postures.csv", columns))
    assert "joint 'arm_4_joint' reads -" in said and "degrees" not in said


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda j: j.pop("arm_4_joint"),
            "joints: ['arm_4_joint'] of the setup are not mapped, [] are not in the setup",
        ),
        (lambda j: j.update(arm_9_joint=j.pop("arm_7_joint")), "['arm_7_joint'] of the setup are not mapped, ['arm_9_"),
    ],
)
def test_joints_of_samples_that_do_not_fit_the_setup_are_reported(lab, capsys, change, words):
    described = robot_mapping()
    described["csv"][0]["joints"] = dict(JOINTS)
    change(described["csv"][0]["joints"])
    columns = {"t": np.arange(50) / 100.0} | {
        n: np.full(50, q) for n, q in zip(rigid_robot.JOINTS, rigid_robot.CENTRE, strict=True)
    }
    columns |= dict.fromkeys(("Wx", "Wy", "Wz", "Tx", "Ty", "Tz"), np.zeros(50))
    said = lab.refused(capsys, described, write_csv(lab.folder / "log.csv", columns))
    assert "log.csv" in said and words in said
