"""A twin-like campaign out of every format and in again: the dataset, its mapping, the calibration of it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration import calibrate, load, save_estimate
from calibration.formats.mapping.mapping import MappedBody
from calibration.recording.trial import Trial
from scenarios.commands import main
from scenarios.steps import import_export
from tests.calibration.recording.test_posture_means import dataset as means_dataset
from tests.calibration.recording.test_posture_means import means
from tests.doubles import rigid_robot

READINGS = ("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command", "wrist_wrench")
SIGNALS = (*READINGS, "t_mocap", "marker_position", "t_plate")
PLACES = ("plate_wrench", "plate_centre", "dwell_start", "dwell_stop", "approach")


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    """A short campaign with plates, link readings, an approach and an occlusion, on rates C3D can hold."""
    folder = tmp_path_factory.mktemp("source") / "dataset"
    truth, rng = rigid_robot.defects(4), np.random.default_rng(4)
    static, dwells = rigid_robot.through(rigid_robot.near_postures(rng, 14), dwell=0.6, move=0.8)
    trials, start = [], 20.0
    for name, role, kind, motor, rests in (
        ("postures", "calibration", "static", static, dwells),
        *((f"sweep{j}", "calibration", "sweep", rigid_robot.sweep(j, seconds=6.0), None) for j in (1, 4)),
        ("swing", "validation", "swing", rigid_robot.swing(np.full(8, 0.3), np.full(8, 0.2), 4.0), None),
    ):
        trial = rigid_robot.record(truth, motor, start, rng, rests)
        trials.append((name, role, kind, finished(trial)))
        start += len(motor) / rigid_robot.GRID + 15.0
    return rigid_robot.write(folder, trials)


def finished(trial: Trial) -> Trial:
    approach = np.sign(np.sin(np.arange(8 * len(trial.dwell_start)))).reshape(-1, 8).astype(np.int8)
    position = trial.marker_position.copy()
    position[50:60, 1] = np.nan
    on_grid = {f"t_{i}": (np.round(t[0] * r) + np.arange(len(t))) / r for i, r in (("robot", 100.0), ("plate", 200.0))
               for t in [getattr(trial, f"t_{i}")]}  # fmt: skip
    link = trial.q_motor + 1e-3
    link[:, 0] = np.nan
    wrist = np.random.default_rng(1).normal(size=(len(link), 6)) * [20.0, 20.0, 20.0, 2.0, 2.0, 2.0]
    return replace(trial, marker_position=position, approach=approach, q_link=link, wrist_wrench=wrist, **on_grid)


def run(*arguments: object) -> None:
    with pytest.raises(SystemExit) as exit:
        main.main([str(a) for a in arguments])
    assert exit.value.code == 0


def exported(source: Path, folder: Path, kind: str) -> list[Path]:
    run("export", kind, source, "--out", folder)
    return sorted(p for p in folder.iterdir() if p.name not in ("mapping.yaml", "nominal.urdf"))


def largest(a: Path, b: Path, names: tuple[str, ...]) -> dict[str, float]:
    """Largest difference of each array over all trials."""
    one, other = load(a), load(b)
    found = dict.fromkeys(names, 0.0)
    for e, f in zip(one.description.trials, other.description.trials, strict=True):
        assert (e.id, e.role, e.kind, e.motion) == (f.id, f.role, f.kind, f.motion)
        x, y = one.read(e), other.read(f)
        assert (x.joint, x.marker, x.marker_body, x.plate) == (y.joint, y.marker, y.marker_body, y.plate)
        for name in names:
            p, q = getattr(x, name), getattr(y, name)
            np.testing.assert_array_equal(np.isnan(p), np.isnan(q))
            found[name] = max(found[name], float(np.nanmax(np.abs(p - q))) if np.isfinite(p).any() else 0.0)
    same = {"trials"}
    first, second = (d.description.model_dump() for d in (one, other))
    assert {k for k in first if first[k] != second[k]} <= same
    assert one.urdf == other.urdf
    return found


@pytest.fixture(scope="module")
def csv(source, tmp_path_factory) -> list[Path]:
    """The campaign as CSV files."""
    return exported(source, tmp_path_factory.mktemp("csv") / "csv", "csv")


def test_csv_gives_every_bit_back_in_the_order_of_recording(source, csv, tmp_path):
    mapping = yaml.safe_load((csv[0].parent / "mapping.yaml").read_text())
    (csv[0].parent / "listed.yaml").write_text(yaml.safe_dump(mapping | {"trials": mapping["trials"][::-1]}))
    run("import", "csv", *csv, "--map", csv[0].parent / "listed.yaml", "--out", tmp_path / "back")
    assert set(largest(source, tmp_path / "back", SIGNALS + PLACES).values()) == {0.0}


@pytest.fixture(scope="module")
def back(source, tmp_path_factory) -> Path:
    """The campaign from C3D for markers and plates, and bags for the joints."""
    folder = tmp_path_factory.mktemp("back")
    for kind, extra in (("c3d", []), ("bag", ["--add-to", folder / "c3d_dataset"])):
        files = exported(source, folder / kind, kind)
        out = folder / f"{kind}_dataset"
        run("import", kind, *files, "--map", folder / kind / "mapping.yaml", "--out", out, *extra)
    return folder / "bag_dataset"


def test_c3d_and_bag_give_everything_back_to_float32(source, back):
    found = largest(source, back, SIGNALS + PLACES)
    assert found.pop("marker_position") < 1e-6
    assert found.pop("plate_wrench") < 1e-4
    assert max(found.pop(name) for name in ("t_mocap", "t_plate", "t_robot")) < 1e-9
    assert set(found.values()) == {0.0}


def test_calibrating_the_imported_campaign_equals_calibrating_the_native_one(source, back):
    native, again = (calibrate(load(folder), ["clocks", "registration", "geometry"]) for folder in (source, back))
    assert native.calibrated and again.calibrated and native.main == again.main
    for name in ("registration", "model_2"):
        for p, q in zip(native.model(name).parameters, again.model(name).parameters, strict=True):
            # positions are rounded to a thousandth of the markers' noise; a twentieth of a sigma is nobody's concern
            assert abs(p.value - q.value) < 0.05 * p.sigma, p.name


def test_posture_means_go_out_as_csv_and_come_back(tmp_path, capsys):
    some = means(rigid_robot.defects(1), 12)
    folder = means_dataset(tmp_path / "source", {"calibration": some})
    files = exported(folder, tmp_path / "csv", "csv")
    run("import", "csv", *files, "--map", tmp_path / "csv/mapping.yaml", "--out", tmp_path / "back")
    ((_, found),) = load(tmp_path / "back").means("calibration")
    for name, value in vars(some).items():
        if name != "id":
            np.testing.assert_array_equal(getattr(found, name), value)
    with pytest.raises(SystemExit) as exit:
        main.main(["export", "c3d", str(folder), "--out", str(tmp_path / "c3d")])
    assert exit.value.code == 2 and not (tmp_path / "c3d").exists()
    assert "posture means have no time; export csv" in capsys.readouterr().err


def test_the_calibrated_urdf_is_written_and_only_of_an_estimate_that_may_be_used(estimate, tmp_path, capsys):
    save_estimate(estimate, tmp_path / "estimate")
    run("export", "urdf", tmp_path / "estimate", "--out", tmp_path / "robot.urdf")
    text = (tmp_path / "robot.urdf").read_text()
    assert text == (tmp_path / "estimate/calibrated.urdf").read_text() != estimate.urdf
    path = tmp_path / "estimate/estimate.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"status": "not_calibrated"}))
    with pytest.raises(SystemExit) as exit:
        main.main(["export", "urdf", str(tmp_path / "estimate"), "--out", str(tmp_path / "other.urdf")])
    assert exit.value.code == 1 and not (tmp_path / "other.urdf").exists()
    assert "must not be used" in capsys.readouterr().err


def test_an_export_replaces_an_export_and_nothing_else(source, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.tex").write_text("mine")
    with pytest.raises(SystemExit) as exit:
        main.main(["export", "csv", str(source), "--out", str(tmp_path / "mine")])
    assert exit.value.code == 2 and [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.tex"]


def test_importing_into_the_dataset_that_is_added_to_keeps_it_when_it_fails(csv, tmp_path):
    mapping = csv[0].parent / "mapping.yaml"
    mocap = [p for p in csv if p.name.endswith("mocap.csv")]
    robot = [tmp_path / p.name for p in csv if p.name.endswith("robot.csv")]
    shown = []
    import_export.import_files("csv", mocap, mapping, tmp_path / "d", progress=lambda *now: shown.append(now))
    assert [step for step, _, _ in shown] == ["import"] * len(mocap) and {at for _, at, _ in shown} == {
        p.name for p in mocap
    }
    assert shown[0][2] == 0.0 and (np.diff([share for _, _, share in shown]) > 0.0).all() and shown[-1][2] < 1.0
    before = (tmp_path / "d/dataset.json").read_bytes()
    for path in robot:
        path.write_text("t\n1.0\n")
    arguments = ["--map", mapping, "--out", tmp_path / "d", "--add-to", tmp_path / "d"]
    with pytest.raises(SystemExit) as exit:
        main.main(["import", "csv", *map(str, [*robot, *arguments])])
    assert exit.value.code == 2
    assert (tmp_path / "d/dataset.json").read_bytes() == before


@pytest.mark.parametrize("sigma", [None, (1e-4, 1e-4, 2e-3, 2e-3, 2e-3, 1e-3)])
def test_a_mapping_says_of_a_body_what_the_dataset_does(sigma):
    base = rigid_robot.described().base_body.model_copy(update={"placement": (0.1,) * 6, "tolerance": sigma})
    assert MappedBody.of(base).drawn() == base
