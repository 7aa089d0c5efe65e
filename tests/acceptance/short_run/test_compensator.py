"""`Compensator` in use: its poses are the ladder's rows, in one go and sample by sample."""

import json
import shutil
from dataclasses import replace
from functools import reduce
from operator import getitem

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

import calibration
from calibration import Compensator, load_estimate
from calibration.errors import InputError, NotEnoughData, ShapeError
from calibration.mocap.cluster_pose import poses_of
from calibration.mocap.postures import readings_at
from calibration.numerics.lie import from_vector, inverse, mean, to_vector
from calibration.prediction.base_pose import loaded_base
from calibration.prediction.hand_pose import at_readings
from calibration.prediction.predict import predictor
from calibration.prediction.slipping_base import SlippingBase
from calibration.recording.clock import Clock
from calibration.robot.urdf import calibrated_urdf
from calibration.stages.joints.correction import velocities
from twin.truth import read_trial

SAME = Clock("one", 0.0, 0.0, np.zeros((2, 2)), 0.0, 0.0)


@pytest.fixture(scope="module")
def result(quick_run):
    return quick_run


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


@pytest.mark.parametrize(
    ("at", "message"),
    [
        (("models", "model_2", "reading_error"), "model_2: reading_error has"),
        (("bundle", "links", "share"), "shift has shape"),
    ],
)
def test_an_estimate_with_a_joint_less_than_the_others_is_refused(result, tmp_path, at, message):
    folder = shutil.copytree(result.folder / "estimate", tmp_path / "estimate")
    content = json.loads((folder / "estimate.json").read_text("utf-8"))
    reduce(getitem, at, content).pop()
    (folder / "estimate.json").write_text(json.dumps(content), "utf-8")
    with pytest.raises(InputError, match=message):
        load_estimate(folder)


def test_base_and_drive_trains_are_of_the_robot_as_weighed_and_placed(result):
    estimate, found = load_estimate(result.folder / "estimate"), Compensator.load(result.folder / "estimate")
    weighed = estimate.bundle.links.on(estimate.urdf)
    placed = calibrated_urdf(weighed, found.hand.chain)
    assert found.arm.trains.urdf == found.slipping.lab.urdf == placed != weighed != estimate.urdf
    prepared = predictor(estimate, calibration.load(result.folder / "dataset"))
    assert prepared.bundled.trains.urdf == placed
    assert (prepared.bundled.trains.dynamics.column.compliance == estimate.bundle.bending.compliance).all()


def test_an_estimate_of_before_is_loaded_by_links_where_they_nominally_are(result, tmp_path):
    folder = shutil.copytree(result.folder / "estimate", tmp_path / "estimate")
    content = json.loads((folder / "estimate.json").read_text("utf-8"))
    assert content["bundle"].pop("placed")
    (folder / "estimate.json").write_text(json.dumps(content), "utf-8")
    estimate, found = load_estimate(folder), Compensator.load(folder)
    assert found.arm.trains.urdf == estimate.bundle.links.on(estimate.urdf)
    assert not found.arm.trains.dynamics.column.compliance.any()


def at_pictures(trial, t, q, w=None):
    """A trial with motor readings q (n, k), and a plate's w (n, 6), at times t (n,) of its pictures; nothing else."""
    nothing, ok = np.full_like(q, np.nan), np.isin(trial.t_mocap, t)
    wrench = np.zeros((len(t), 6)) if w is None else w
    return replace(
        trial, t_mocap=t, marker_position=trial.marker_position[ok], t_robot=t, q_motor=q, q_link=nothing,
        v_motor=nothing, effort=nothing, q_command=nothing, t_plate=t, plate_wrench=wrench[:, None],
        wrist_wrench=np.zeros((0, 6)),
    )  # fmt: skip


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
    same = at_pictures(trial, t, q, w)
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
    np.testing.assert_allclose(found.T, rows[row, "plate"], rtol=0.0, atol=1e-11)
    # as recorded: at the plate's own times there, averaged and picked at the camera's times here
    assert np.sqrt(((found.T - real[row, "plate"])[:, :3, 3] ** 2).mean()) < 1e-4
    still = compensator.predict(t, q, T_lab_base_start=start)
    np.testing.assert_allclose(still.T, rows[row, "fixed"], rtol=0.0, atol=1e-11)
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
    trial, whole = dataset.read(entry), predictor(result.estimate, dataset)
    slips = estimate.bundle.stick_slip
    slips = replace(slips, directions=tuple(d for d in slips.directions if d.source == "dynamics"))
    same = replace(at_pictures(trial, t, q), t_plate=np.zeros(0), plate_wrench=np.zeros((0, 1, 6)))
    bare = {"description": whole.description.model_copy(update={"plates": ()}), "plate": None, "robot": SAME}
    rows = replace(whole, bundled=replace(whole.bundled, stick_slip=slips), **bare)(entry, same).rows
    expected = next(p for p in rows if (p.model, p.base, p.encoder) == ("full", "dynamics", "motor"))
    laboratory = estimate.laboratory.model_copy(update={"plates": ()})
    alone = Compensator.of(replace(estimate, bundle=replace(estimate.bundle, stick_slip=slips), laboratory=laboratory))
    start = start @ from_vector(compensator.hand.base) @ inverse(from_vector(alone.hand.base))
    found, still = (alone.predict(t[:n], q[:n], None, start) for n in (len(t), 50))
    np.testing.assert_allclose(found.T, expected.T_lab_hand, rtol=0.0, atol=1e-11)
    assert np.abs(found.T[:50] - still.T)[:, :3, 3].max() < 1e-3 < np.ptp(found.T[:, :3, 3])


def test_it_is_the_row_by_the_wrist_s_sensor_too(result, compensator, swing):
    """It shows how the hand moves, which moves the base."""
    t, q, w, start, rows, *_ = swing
    dataset, full = calibration.load(result.folder / "dataset"), Compensator.load(result.folder / "estimate")
    entry = dataset.entries("validation", "swing")[0]
    trial, predict = dataset.read(entry), predictor(result.estimate, dataset)
    wrist = readings_at(trial, predict.robot, t, trial.wrist_wrench)
    same = replace(at_pictures(trial, t, q, w), wrist_wrench=wrist)
    found = replace(predict, robot=SAME, plate=SAME)(entry, same).rows
    expected = next(p for p in found if (p.model, p.base, p.encoder) == ("full", "plate", "motor"))
    start = start @ from_vector(compensator.hand.base) @ inverse(from_vector(full.hand.base))
    seen = full.predict(t, q, w, start, wrist=wrist)
    np.testing.assert_allclose(seen.T, expected.T_lab_hand, rtol=0.0, atol=1e-11)
    assert np.abs(seen.T - rows["full", "plate"]).max() > 1e-7


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


def test_steps_under_a_wrench_follow_the_prediction_but_for_its_filter(estimate, compensator, swing):
    """A joint with backlash that stops elsewhere in its gap is most of it, in a sixth of the samples."""
    t, q, w, start, *_ = swing
    v, whole, before, found = velocities(t, q), compensator.predict(t, q, w, start), None, []
    for k in range(500):
        pose = compensator.step(t[k], q[k], w[k], start, v[k], before)
        before = pose.state
        found.append(pose.T[0])
    e = np.sqrt(((np.array(found) - whole.T[:500])[:, :3, 3] ** 2).mean(axis=1))
    moved = (whole.T - compensator.predict(t, q, T_lab_base_start=start).T)[:500, :3, 3]
    size = np.sqrt((moved**2).mean())
    assert np.quantile(e, 0.8) < 0.1 * size
    assert np.sqrt((e**2).mean()) < (0.15 if estimate.main == "full" else 0.1) * size


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
    assert max(traces[:2]) < traces[2]


def test_the_variance_of_a_base_that_slips_is_in_the_hands(compensator, swing, monkeypatch):
    if compensator.slipping is None:
        pytest.skip("a base that only springs")
    (t, q, w, start, *_), moved = swing, SlippingBase.moved

    def less_sure(*args):
        x, variance = moved(*args)
        return x, variance + np.repeat([1e-6, 0.0], 3)

    surely = compensator.predict(t, q, w, start).covariance
    monkeypatch.setattr(SlippingBase, "moved", less_sure)
    more = (compensator.predict(t, q, w, start).covariance - surely)[:, :3, :3]
    np.testing.assert_allclose(more, np.broadcast_to(1e-6 * np.eye(3), more.shape), atol=1e-12)


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
