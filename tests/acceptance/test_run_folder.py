"""The short variant of the default scenario, from the simulation to the report."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import xarray
from scipy.ndimage import uniform_filter1d

import calibration
from calibration import Compensator, load_estimate
from calibration.errors import InputError, NotEnoughData, ShapeError
from calibration.evaluation.bands import Bands
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.postures import readings_at
from calibration.numerics.lie import from_vector, inverse, mean, to_vector
from calibration.prediction.base_pose import loaded_base
from calibration.prediction.hand_pose import at_readings
from calibration.prediction.predict import predictor
from calibration.recording.clock import Clock
from calibration.stages.joints.correction import velocities
from twin.truth import read_parameters, read_trial

SAME = Clock("one", 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)


@pytest.fixture(scope="module")
def result(quick_run):
    return quick_run


def figure(rows, model, base, trials="dynamic", name="position_rmse_component_mm"):
    found = [r for r in rows if (r["model"], r["base"], r["trials"], r["encoder"]) == (model, base, trials, "motor")]
    return found[0][name]


@pytest.fixture(scope="module")
def rows(result):
    return json.loads((result.folder / "score.json").read_text())["rows"]


def test_the_run_folder_is_complete(result):
    present = {str(p.relative_to(result.folder)) for p in result.folder.rglob("*") if p.is_file()}
    expected = {
        "scenario.yaml",
        "dataset/dataset.json",
        "dataset/nominal.urdf",
        "truth/truth.json",
        "estimate/estimate.json",
        "estimate/estimate.nc",
        "estimate/calibrated.urdf",
        "estimate/master_calibration.yaml",
        "estimate/zeros.yaml",
        "evaluation.json",
        "score.json",
        "report.html",
        "figures/twin.png",
    }
    assert expected <= present
    trials = json.loads((result.folder / "dataset/dataset.json").read_text())["trials"]
    assert {f"dataset/{t['file']}" for t in trials} | {f"truth/{t['file']}" for t in trials} <= present


def test_each_step_of_the_ladder_is_a_step_down(result, rows):
    assert result.estimate.status == "calibrated"
    nominal, registration = figure(rows, "nominal", "fixed"), figure(rows, "registration", "fixed")
    assert registration < nominal
    assert figure(rows, "model_2", "fixed") < 0.5 * min(nominal, registration)
    assert figure(rows, "model_2", "measured") < 0.5 * figure(rows, "registration", "measured")
    assert figure(rows, "model_2", "measured") < figure(rows, "model_2", "fixed")
    angle = {
        m: figure(rows, m, "measured", name="orientation_rmse_deg") for m in ("nominal", "registration", "model_2")
    }
    assert angle["model_2"] < 0.5 * angle["registration"] < 0.5 * angle["nominal"]


def test_the_dataset_holds_no_seed_and_no_drawn_value(result):
    text = (result.folder / "dataset/dataset.json").read_text()
    assert "seed" not in text
    drawn = [p for p in read_parameters(result.folder / "truth/truth.json") if p.name.startswith(("geometry", "link."))]
    assert len(drawn) > 48
    assert not [p.name for p in drawn if repr(abs(p.value))[:8] in text]


def test_play_is_read_back_from_a_recording(result):
    """arm_7 carries next to no load: its encoders differ by the play, and by the link encoder's own waves."""
    dataset = calibration.load(result.folder / "dataset")
    trial = next(t for e, t in dataset.trials("calibration") if e.id == "sweep_arm_7_joint")
    truth = {p.name: p.value for p in read_parameters(result.folder / "truth/truth.json")}
    j = trial.joint.index("arm_7_joint")
    waves = sum(abs(truth[f"encoder.arm_7_joint.link.{w}"]) for w in ("cos1", "sin1", "cos2", "sin2"))
    low, high = np.percentile((trial.q_motor - trial.q_link)[:, j], [5.0, 95.0])
    assert high - low == pytest.approx(truth["backlash.arm_7_joint.gap"], abs=1e-3 + 2 * waves)
    assert high - low > 0.8 * truth["backlash.arm_7_joint.gap"]


def test_clocks_come_back(result):
    truth = {p.name: p.value for p in read_parameters(result.folder / "truth/truth.json")}
    for instrument, tolerance in (("robot", 1e-3), ("plate", 5e-3)):
        clock = result.estimate.clock(instrument)
        t = np.linspace(120.0, 300.0, 20)
        true = t * (1.0 + truth[f"clock.{instrument}.drift"]) + truth[f"clock.{instrument}.offset"]
        assert np.sqrt(np.mean((clock.to_mocap(t) - true) ** 2)) < tolerance, instrument


def test_every_parameter_of_the_truth_is_judged_once(result):
    score = json.loads((result.folder / "score.json").read_text())
    names = [p["name"] for p in score["parameters"]]
    true = [p.name for p in read_parameters(result.folder / "truth/truth.json")]
    derived = [name for name in names if name.startswith(("suspension.K.", "suspension.C."))]
    assert sorted(names) == sorted(true + derived) and len(set(names)) == len(names)
    assert {p["status"] for p in score["parameters"]} <= {"estimated", "combined", "not_identifiable", "not_estimated"}
    floor = [r for r in score["rows"] if r["model"] == "floor"]
    assert floor and all(r["skill"] == 1.0 for r in floor)


def test_other_programs_open_every_file(result):
    for path in [*result.folder.glob("dataset/trials/*.nc"), *result.folder.glob("truth/trials/*.nc")]:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            for name, variable in data.variables.items():
                assert variable.dtype.kind not in "fi" or "units" in variable.attrs, (path.name, name)


def test_roll_and_pitch_of_the_base_are_predicted_from_the_plate(result, base_r2):
    """Without its markers beyond the first second, on swings no stage has seen; inverse dynamics: test_seeds.py."""
    r2 = base_r2(result.folder, result.estimate, "plate")
    assert r2.min() >= 0.95
    reported = {b["source"]: b for b in json.loads((result.folder / "score.json").read_text())["base"]}
    assert [reported["plate"]["roll_r2"], reported["plate"]["pitch_r2"]] == pytest.approx(r2, rel=1e-9)


def test_the_papers_models_keep_their_order(rows):
    def mm(model, base):
        return figure(rows, model, base)

    assert mm("model_1", "plate") <= mm("nominal", "fixed")
    assert mm("model_2", "plate") < min(mm("model_1", "plate"), mm("registration", "plate"))
    assert mm("model_3", "plate") <= min(1.10 * mm("model_2", "plate"), 5.7)
    assert figure(rows, "model_3", "plate", name="orientation_rmse_deg") <= 2.71


def test_one_estimate_is_scored_under_both_protocols(result):
    found = json.loads((result.folder / "evaluation.json").read_text())
    assert [(p["protocol"], p["model"]) for p in found["protocols"]] == [
        (protocol, model) for protocol in ("public", "ours") for model in ("nominal", "model_1", "model_2", "model_3")
    ]
    reported = {(x["joint"], x["regime"]): x for x in found["regimes"]}
    assert {(f"arm_{k}_joint", r) for k in range(1, 8) for r in ("unseen_motion", "static")} <= reported.keys()
    assert all(x["n"] > 0 and x["discrepancy_before_mrad"] > 0.0 for x in reported.values())
    better = {tuple(c["b"]): c["finding"] for c in found["comparisons"]}
    assert better["model_2", "plate"] == "better"
    assert better["model_1", "plate"] != "worse"


ROW = {"full": "full", "model_2": "model_3"}


@pytest.fixture(scope="module", params=ROW)
def estimate(result, request):
    """The estimate as it is, and by the row it would have without drive trains."""
    found = load_estimate(result.folder / "estimate")
    assert found.main == "full"
    return replace(found, main=request.param)


@pytest.fixture(scope="module")
def compensator(estimate):
    return Compensator.of(estimate)


def test_the_main_row_is_loaded(result):
    assert Compensator.load(result.folder / "estimate").arm is not None


def test_a_model_with_a_joint_less_than_the_others_is_refused(result, tmp_path):
    folder = shutil.copytree(result.folder / "estimate", tmp_path / "estimate")
    content = json.loads((folder / "estimate.json").read_text("utf-8"))
    content["models"]["model_2"]["reading_error"].pop()
    (folder / "estimate.json").write_text(json.dumps(content), "utf-8")
    with pytest.raises(InputError, match="model_2: reading_error has"):
        load_estimate(folder)


@pytest.fixture(scope="module")
def swing(result, compensator):
    """A validation swing with every instrument at the motion capture's times, and the ladder's predictions of it."""
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    t_robot, t_plate = predict.robot.from_mocap(trial.t_mocap), predict.plate.from_mocap(trial.t_mocap)
    ok = (t_robot >= trial.t_robot[0]) & (t_robot <= trial.t_robot[-1])
    ok &= (t_plate >= trial.t_plate[0]) & (t_plate <= trial.t_plate[-1])
    t, q = trial.t_mocap[ok], readings_at(trial, predict.robot, trial.t_mocap[ok], trial.q_motor)
    samples = round(float(np.diff(trial.t_mocap).mean() / np.diff(trial.t_plate).mean()))  # of the plate in a picture
    averaged = uniform_filter1d(trial.plate_wrench[:, 0], samples, axis=0)
    w = np.stack([np.interp(t_plate[ok], trial.t_plate, column) for column in averaged.T], axis=1)
    nothing = np.full_like(q, np.nan)
    same = replace(
        trial, t_mocap=t, marker_position=trial.marker_position[ok], t_robot=t, q_motor=q, q_link=nothing,
        v_motor=nothing, effort=nothing, q_command=nothing, t_plate=t, plate_wrench=w[:, None],
        wrist_wrench=np.zeros((0, 6)),
    )  # fmt: skip
    rows = {
        (p.model, p.base): p.T_lab_hand
        for p in replace(predict, robot=SAME, plate=SAME)(entry, same).rows
        if p.encoder == "motor"
    }
    real = {(p.model, p.base): p.T_lab_hand[ok] for p in predict(entry, trial).rows if p.encoder == "motor"}
    T_lab_B = poses_of(dataset.description.base_body, same).T
    start = mean(T_lab_B[t <= t[0] + 1.0]) @ inverse(from_vector(compensator.hand.base))
    true = read_trial(result.folder / "truth" / entry.file).hand_pose[ok]
    return t, q, w, start, rows, real, true


def test_it_is_the_ladder_s_row_with_the_base_from_the_plate(estimate, compensator, swing):
    t, q, w, start, rows, real, _ = swing
    found, row = compensator.predict(t, q, w, start), ROW[estimate.main]
    np.testing.assert_allclose(found.T, rows[row, "plate"], rtol=0.0, atol=1e-12)
    # as recorded: at the plate's own times there, averaged and picked at the camera's times here
    assert np.sqrt(((found.T - real[row, "plate"])[:, :3, 3] ** 2).mean()) < 1e-4
    still = compensator.predict(t, q, T_lab_base_start=start)
    np.testing.assert_allclose(still.T, rows[row, "fixed"], rtol=0.0, atol=1e-12)
    assert 1e3 * np.abs(found.T - still.T)[:, :3, 3].max() > 1.0
    robot, plate = (estimate.clock(name) for name in ("robot", "plate"))
    own, t_wrench = robot.from_mocap(t), plate.from_mocap(t)
    clocks = compensator.predict(own, q, w, start, t_wrench=t_wrench)
    off = np.abs(clocks.T - found.T).max(axis=(1, 2))  # the robot's second is 12 ppm off, so are velocities
    if estimate.main != "full":
        assert off.max() <= 5e-5
        return
    # a gear that is about to cross its gap may stay: then the arm is elsewhere until it crosses, the base hardly
    assert np.quantile(off, 0.98) <= 5e-5
    at, read = (
        loaded_base(compensator.suspension, compensator.laboratory, start),
        (own, compensator.clocks, t_wrench, w),
    )
    by_clocks, by_mocap = (compensator.slipping.moved(at, *x)[0] for x in ((own, q, at_readings(*read)), (t, q, w)))
    apart = np.abs(by_clocks - by_mocap).max(axis=(1, 2))
    assert np.quantile(apart, 0.98) <= 1e-5 and apart.max() <= 5e-5


def test_without_a_plate_it_is_the_row_with_the_base_from_dynamics(result, compensator, swing):
    estimate, dataset = load_estimate(result.folder / "estimate"), calibration.load(result.folder / "dataset")
    t, q, _, start, *_ = swing
    entry = dataset.entries("validation", "swing")[0]
    trial, whole, nothing = dataset.read(entry), predictor(result.estimate, dataset), np.full_like(q, np.nan)
    slips = estimate.bundle.stick_slip
    slips = replace(slips, directions=tuple(d for d in slips.directions if d.source == "dynamics"))
    ok = np.isin(trial.t_mocap, t)
    same = replace(
        trial, t_mocap=t, marker_position=trial.marker_position[ok], t_robot=t, q_motor=q, q_link=nothing,
        v_motor=nothing, effort=nothing, q_command=nothing, t_plate=np.zeros(0), plate_wrench=np.zeros((0, 1, 6)),
        wrist_wrench=np.zeros((0, 6)),
    )  # fmt: skip
    bare = {"description": whole.description.model_copy(update={"plates": ()}), "plate": None, "robot": SAME}
    rows = replace(whole, bundled=replace(whole.bundled, stick_slip=slips), **bare)(entry, same).rows
    expected = next(p for p in rows if (p.model, p.base, p.encoder) == ("full", "dynamics", "motor"))
    laboratory = estimate.laboratory.model_copy(update={"plates": ()})
    alone = Compensator.of(replace(estimate, bundle=replace(estimate.bundle, stick_slip=slips), laboratory=laboratory))
    start = start @ from_vector(compensator.hand.base) @ inverse(from_vector(alone.hand.base))
    found, still = (alone.predict(t[:n], q[:n], None, start) for n in (len(t), 50))
    np.testing.assert_allclose(found.T, expected.T_lab_hand, rtol=0.0, atol=1e-12)
    assert np.abs(found.T[:50] - still.T)[:, :3, 3].max() < 1e-3 < np.ptp(found.T[:, :3, 3])


def test_without_velocities_readings_are_taken_to_be_at_rest(estimate, compensator, swing):
    t, q, _, start, rows, *_ = swing
    found = compensator.predict(t[::100], q[::100], T_lab_base_start=start)
    if estimate.main == "model_2":
        np.testing.assert_allclose(found.T, rows["model_2", "fixed"][::100], atol=1e-9)
    np.testing.assert_allclose(found.T[0], rows[estimate.main, "fixed"][0], atol=1e-4)  # it is at rest there
    one = compensator.step(t[300], q[300], T_lab_base_start=start)
    np.testing.assert_allclose(one.T[0], found.T[3], atol=1e-9)


def test_markers_are_where_the_pose_at_rest_has_them(compensator, swing):
    t, q, *_ = swing
    X = np.array([[0.1, 0.0, 0.05], [-0.05, 0.1, 0.1]])
    found, pose = compensator.points(X, q[::200]), compensator.predict(t[::200], q[::200])
    T = inverse(from_vector(compensator.hand.base)) @ pose.T
    places = np.einsum("nij,mj->nmi", T[:, :3, :3], X) + T[:, None, :3, 3]
    np.testing.assert_allclose(found.positions, places, atol=1e-12)
    assert (found.radius_95 > 0.0).all()


def test_a_step_is_the_prediction_of_its_sample(estimate, compensator, swing):
    t, q, w, start, *_ = swing
    v, whole = velocities(t, q), compensator.predict(t, q, T_lab_base_start=start)
    if estimate.main == "full":  # meshes remember; accelerations of single samples lag by half of one
        before, e = None, []
        for k in range(len(t)):
            one = compensator.step(t[k], q[k], T_lab_base_start=start, velocity=v[k], before=before)
            before = one.state
            e.append((one.T[0] - whole.T[k])[:3, 3])
        assert np.sqrt((np.array(e) ** 2).mean()) < 1e-4
        return
    for k in range(0, len(t), 97):
        one = compensator.step(t[k], q[k], T_lab_base_start=start, velocity=v[k])
        np.testing.assert_allclose(one.T[0], whole.T[k], atol=1e-12)
        np.testing.assert_allclose(one.covariance[0], whole.covariance[k], atol=1e-15)


def test_steps_under_a_wrench_follow_the_prediction_but_for_its_filter(compensator, swing):
    t, q, w, start, *_ = swing
    v, whole, before, found = velocities(t, q), compensator.predict(t, q, w, start), None, []
    for k in range(500):
        pose = compensator.step(t[k], q[k], w[k], start, v[k], before)
        before = pose.state
        found.append(pose.T[0])
    e = (np.array(found) - whole.T[:500])[:, :3, 3]
    moved = (whole.T - compensator.predict(t, q, T_lab_base_start=start).T)[:500, :3, 3]
    assert np.sqrt((e**2).mean()) < 0.1 * np.sqrt((moved**2).mean())


def test_the_covariance_contains_the_truth_and_counts_what_the_model_leaves_out(compensator, swing):
    t, q, w, start, _, _, true = swing
    reported, still, in_base = (
        compensator.predict(t, q, w, start),
        compensator.predict(t, q, None, start),
        compensator.predict(t, q),
    )
    after = slice(200, None)
    for pose in (reported, still):
        e = to_vector(inverse(pose.T[after]) @ true[after])
        nees = np.einsum("ni,nij,nj->n", e, np.linalg.inv(pose.covariance[after]), e)
        assert 0.1 < nees.mean() / 6.0 < 2.0
    traces = [np.trace(p.covariance[:, :3, :3], axis1=1, axis2=2).mean() for p in (in_base, reported, still)]
    assert traces[0] < traces[1] < traces[2]


def test_another_payload_turns_the_joints(estimate, compensator, swing):
    t, q, *_ = swing
    heavy = Compensator.of(estimate, payload=2.0)
    assert np.abs(heavy.predict(t, q).T - compensator.predict(t, q).T)[:, :3, 3].max() > 1e-4


def test_what_is_missing_is_reported(compensator, swing):
    t, q, w, start, *_ = swing
    with pytest.raises(NotEnoughData, match="no suspension"):
        replace(compensator, suspension=None).predict(t, q, w, start)
    with pytest.raises(NotEnoughData, match="second"):
        compensator.predict(t[:20], q[:20], w[:20], start)
    with pytest.raises(ShapeError, match="wrench"):
        compensator.predict(t, q, w[:5], start)
    no_plate = replace(compensator, laboratory=compensator.laboratory.model_copy(update={"plates": ()}))
    with pytest.raises(NotEnoughData, match="no plate"):
        no_plate.predict(t, q, w, start)
    assert np.isfinite(no_plate.predict(t, q, w).T).all()


def test_a_base_that_slips_loads_the_links_as_predicted_where_it_is_measured(result):
    """Its markers do where it was not identified."""
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    poses = predict.poses(entry, trial)
    assert poses.geared("measured") is poses.geared("plate")
    still = replace(predict, bundled=replace(predict.bundled, stick_slip=None)).poses(entry, trial)
    torques = [still.geared(source).loads.torque for source in ("measured", "fixed")]
    assert np.abs(np.subtract(*torques)).max() > 0.1


def test_white_noise_of_the_base_s_markers_is_not_in_the_band_of_a_dwell(result):
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    bands, predicted = Bands(result.estimate, dataset.description, predict.robot), predict(entry, trial)
    rows = [
        {(p.model, p.base): p.covariance for p in bands.on(predicted, e, trial).rows if p.encoder == "motor"}
        for e in (entry, entry.model_copy(update={"kind": "static"}))
    ]
    moving, still = (np.trace(of["full", "measured"], axis1=1, axis2=2) for of in rows)
    assert np.nanmedian(np.sqrt((moving - still) / 3.0)) == pytest.approx(2e-4, rel=0.5)  # 0.1 mm of a marker, at 0.8 m
    np.testing.assert_array_equal(*(of["full", "plate"] for of in rows))


def test_links_that_inverse_dynamics_let_stop_elsewhere_widen_the_band_of_their_rows(result):
    """The base they predict jolts links otherwise: so do predictions of calibration dwells say, in the estimate."""
    dataset, parts = calibration.load(result.folder / "dataset"), result.estimate.bundle
    assert (parts.at_rest_by_dynamics > 0.0).all() and parts.by_dynamics.at_rest is parts.at_rest_by_dynamics
    wide = replace(parts, at_rest_by_dynamics=parts.at_rest + 5e-3)
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    rows = [
        {
            (p.model, p.base): p.covariance
            for p in bands.on(predict(entry, trial), entry, trial).rows
            if p.encoder == "motor"
        }
        for of in (parts, wide)
        for bands in [Bands(replace(result.estimate, bundle=of), dataset.description, predict.robot)]
    ]
    np.testing.assert_array_equal(*(of["full", "plate"] for of in rows))
    narrow, wider = (np.nanmax(np.trace(of["full", "dynamics"], axis1=1, axis2=2)) for of in rows)
    assert wider > 2.0 * narrow


def test_it_is_the_row_by_the_wrist_s_sensor_too(result, compensator, swing):
    """It shows how the hand moves, which moves the base."""
    t, q, w, start, rows, *_ = swing
    dataset = calibration.load(result.folder / "dataset")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    ok, nothing = np.isin(trial.t_mocap, t), np.full_like(q, np.nan)
    wrist = readings_at(trial, predict.robot, t, trial.wrist_wrench)
    same = replace(
        trial, t_mocap=t, marker_position=trial.marker_position[ok], t_robot=t, q_motor=q, q_link=nothing,
        v_motor=nothing, effort=nothing, q_command=nothing, t_plate=t, plate_wrench=w[:, None], wrist_wrench=wrist,
    )  # fmt: skip
    found = next(
        p.T_lab_hand
        for p in replace(predict, robot=SAME, plate=SAME)(entry, same).rows
        if (p.model, p.base, p.encoder) == ("full", "plate", "motor")
    )
    seen = compensator.predict(t, q, w, start, wrist=wrist).T
    if compensator.arm is not None:
        np.testing.assert_allclose(seen, found, rtol=0.0, atol=1e-12)
        assert np.abs(seen - rows["full", "plate"]).max() > 1e-7
