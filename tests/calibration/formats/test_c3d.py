"""C3D out and in, and by a reader that shares no code: signs, units, corners, origins, rates and counts."""

import struct
import warnings
from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from calibration import load
from calibration.errors import InputError
from calibration.formats.c3d.file import checked_header
from calibration.formats.c3d.plate import C3dPlate, channels_of, drawn_plate, lab_wrench
from calibration.formats.c3d.write import write_c3d
from calibration.recording.trial import sha256
from tests.doubles.c3d_data import DEPTH, PLATES, described, mapping, trial

MICRON, FORCE, MOMENT = 1e-6, 1e-4, 1e-4


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "log.c3d"
    write_c3d(path, trial(), described(), DEPTH)
    return path


def rewritten(path, change):
    """The file after a change of its parameters or data, as another program might have left it."""
    c3d = ezc3d.c3d(str(path))
    change(c3d)
    c3d.write(str(path))
    return path


def set_parameter(group, name, value):
    def change(c3d):
        kind = c3d["parameters"][group][name]["type"]
        if isinstance(value, list) and value and isinstance(value[0], str):
            c3d["parameters"][group][name]["value"] = value
        else:
            c3d.add_parameter(group, name, np.asarray(value, dtype=float))
            c3d["parameters"][group][name]["type"] = kind

    return change


def test_markers_and_wrenches_come_back_to_the_rounding_of_float32(lab, file):
    lab.run(mapping(), file, kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    true = trial()
    np.testing.assert_array_equal(np.isnan(found.marker_position), np.isnan(true.marker_position))
    assert np.nanmax(np.abs(found.marker_position - true.marker_position)) < MICRON
    d = np.abs(found.plate_wrench - true.plate_wrench)
    assert d[..., :3].max() < FORCE and d[..., 3:].max() < MOMENT
    np.testing.assert_allclose(found.t_mocap, true.t_mocap, atol=1e-9)
    np.testing.assert_allclose(found.t_plate, true.t_plate, atol=1e-9)
    assert load(lab.out).description.mocap_clock == ()


def test_moments_are_about_the_setup_s_centre_where_the_file_s_is_a_little_off(lab, tmp_path):
    off, true = np.array([1e-3, -1.5e-3, 0.0]), trial()
    moved = described().model_copy(update={"plates": tuple(
        p.model_copy(update={"centre": tuple(np.array(p.centre) + off)}) for p in described().plates
    )})  # fmt: skip
    about = true.plate_wrench.copy()
    about[..., 3:] -= np.cross(off, about[..., :3])
    write_c3d(tmp_path / "log.c3d", replace(true, plate_wrench=about, plate_centre=true.plate_centre + off), moved)
    lab.run(mapping(), tmp_path / "log.c3d", kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    assert np.abs(found.plate_wrench - true.plate_wrench)[..., 3:].max() < MOMENT
    assert np.abs(about - true.plate_wrench)[..., 3:].max() > 0.3, "half a newton metre is at stake"


def test_the_same_trial_gives_the_same_bytes(tmp_path, file):
    write_c3d(tmp_path / "b.c3d", trial(), described(), DEPTH)
    assert sha256(file) == sha256(tmp_path / "b.c3d")


class Independent:
    """The file by the package c3d, and the plates' maths done again from FORCE_PLATFORM alone."""

    def __init__(self, path) -> None:
        import c3d

        with path.open("rb") as stream, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            reader = c3d.Reader(stream)
            frames = list(reader.read_frames(copy=True))
            self.points = np.array([p for _, p, _ in frames])
            self.analog = np.concatenate([a for *_, a in frames], axis=1).T
            group = reader.get("FORCE_PLATFORM")
            self.corners = np.array(group.get("CORNERS").float_array).reshape(-1, 4, 3)
            self.origin = np.array(group.get("ORIGIN").float_array).reshape(-1, 3)
            self.channel = np.array(group.get("CHANNEL").int16_array).reshape(-1, 6)
            self.type = np.array(group.get("TYPE").int16_array).ravel()
            self.used = group.get("USED").int16_value
            self.labels = [label.strip() for label in reader.point_labels]

    def reaction(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Force [N], moment about the surface centre [N.m] and centre of pressure [m], lab axes."""
        c, raw = self.corners[k] / 1e3, self.analog[:, self.channel[k] - 1]
        x, y = c[0] - c[1], c[0] - c[3]
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        R = np.stack([x, y, np.cross(x, y)], axis=1)
        f, m = raw[:, :3], raw[:, 3:] / 1e3
        to_surface = self.origin[k] / 1e3
        assert R[2, 2] < -0.999 and to_surface[2] <= 0.0
        at_centre = m - np.cross(to_surface, f)
        f, at_centre = (np.where(f[:, 2:] != 0.0, x, np.nan) for x in (f, at_centre))  # past the last sample
        cop = np.stack([-at_centre[:, 1] / f[:, 2], at_centre[:, 0] / f[:, 2], 0.0 * f[:, 0]], axis=1)
        return f @ R.T, at_centre @ R.T, cop @ R.T + c.mean(axis=0)


def test_an_independent_reader_finds_the_same_markers_wrench_and_centre_of_pressure(file):
    found, true = Independent(file), trial()
    assert (found.used, found.type.tolist(), found.labels) == (2, [2, 2], list(true.marker))
    n = len(true.t_mocap)
    seen = np.isfinite(true.marker_position).all(axis=2)
    np.testing.assert_array_equal(found.points[:n, :, 3] >= 0.0, seen)
    assert np.abs(found.points[:n, :, :3][seen] / 1e3 - true.marker_position[seen]).max() < MICRON
    for k, plate in enumerate(PLATES):
        f, m, cop = (x[: len(true.t_plate)] for x in found.reaction(k))
        action = true.plate_wrench[:, k]
        assert np.abs(f + action[:, :3]).max() < FORCE and np.abs(m + action[:, 3:]).max() < MOMENT
        axes, centre = np.array(plate["axes"]), np.array(plate["centre"])
        local_f, local_m = action[:, :3] @ axes.T, action[:, 3:] @ axes.T
        along = np.stack([-local_m[:, 1] / local_f[:, 2], local_m[:, 0] / local_f[:, 2], 0 * local_f[:, 0]], axis=1)
        assert np.abs(cop - (along @ axes + centre)).max() < MICRON


@pytest.mark.parametrize("left", [0.0, 512.0])
def test_a_marker_with_a_negative_residual_was_not_seen_whatever_its_coordinates_say(lab, file, left):
    """Laboratories leave zeros, or the last position, in the gaps."""
    raw, header = bytearray(file.read_bytes()), checked_header(file)
    stride = 4 * (4 * header.points + header.analog)
    for frame in range(50, 60):
        struct.pack_into("<4f", raw, header.data_start + frame * stride + 4 * 4 * 2, left, left, left, -1.0)
    file.write_bytes(bytes(raw))
    lab.run(mapping(), file, kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    assert np.isnan(found.marker_position[50:60, 2]).all()
    assert np.isfinite(found.marker_position[49, 2]).all() and np.isfinite(found.marker_position[60, 2]).all()


def test_a_laboratory_reads_the_reaction_upwards(file):
    f, *_ = Independent(file).reaction(0)
    assert np.nanmean(f[:, 2]) > 300.0


def test_the_transducers_are_below_the_surface_in_the_raw_file(file):
    np.testing.assert_allclose(Independent(file).origin[:, 2], -1e3 * DEPTH, rtol=1e-6)


def test_whole_numbers_are_stored_as_whole_numbers(file):
    c3d = ezc3d.c3d(str(file))
    for name in ("USED", "TYPE", "ZERO", "CHANNEL"):
        assert c3d["parameters"]["FORCE_PLATFORM"][name]["type"] == 2, name


def test_type_4_reads_output_by_row_of_its_matrix(lab, file):
    rng, true = np.random.default_rng(1), trial()
    matrices = np.stack([np.diag([100, 100, 200, 2e4, 2e4, 1e4]) + 5.0 * rng.normal(size=(6, 6)) for _ in PLATES], 2)
    plates = [drawn_plate(p, DEPTH) for p in described().plates]

    def to_volts(c3d):
        a = c3d["data"]["analogs"]
        for k, plate in enumerate(plates):
            si = np.repeat([1.0, 1e-3], 3)[:, None] * matrices[:, :, k]
            volts = channels_of(C3dPlate(4, plate.corners, plate.origin, si), -true.plate_wrench[:, k])
            a[0, 6 * k : 6 * k + 6, : len(volts)] = volts.T
        c3d["data"]["analogs"] = a
        c3d["parameters"]["ANALOG"]["UNITS"]["value"] = ["V"] * 12
        c3d.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", matrices)
        set_parameter("FORCE_PLATFORM", "TYPE", [4, 4])(c3d)

    described_ = mapping()
    for plate in described_["c3d"]["plates"].values():
        plate["moment_unit"] = "N.mm"
    lab.run(described_, rewritten(file, to_volts), kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    d = np.abs(found.plate_wrench - true.plate_wrench)
    assert d[..., :3].max() < 1e-3 and d[..., 3:].max() < 1e-3


def test_moments_in_newton_metres_are_read_as_such_where_the_file_says_so(lab, file):
    def to_metres(c3d):
        units = np.tile(np.repeat([1.0, 1e-3], 3), 2)
        c3d["data"]["analogs"] = c3d["data"]["analogs"] * units[None, :, None]
        c3d["parameters"]["ANALOG"]["UNITS"]["value"] = ["N", "N", "N", "Nm", "Nm", "Nm"] * 2

    lab.run(mapping(), rewritten(file, to_metres), kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    assert np.abs(found.plate_wrench - trial().plate_wrench)[..., 3:].max() < MOMENT


def test_without_a_clock_group_markers_and_plates_share_the_clock_and_the_mapping_says_when(lab, file):
    def forget(c3d):
        del c3d["parameters"]["CLOCK"]

    described_ = mapping(trials=[{"id": "log", "role": "calibration", "kind": "swing", "start": 7.0}])
    notes = lab.run(described_, rewritten(file, forget), kind="c3d")
    dataset = load(lab.out)
    ((_, found),) = dataset.trials("calibration")
    assert dataset.description.mocap_clock == ("plate",) and any("no CLOCK group" in note for note in notes)
    assert found.t_mocap[0] == found.t_plate[0] == 7.0


def test_files_without_a_time_of_their_own_need_a_start_each(lab, capsys, file):
    def forget(c3d):
        del c3d["parameters"]["CLOCK"]

    rewritten(file, forget)
    other = file.with_name("other.c3d")
    other.write_bytes(file.read_bytes())
    trials = [{"id": n, "role": "calibration", "kind": "swing"} for n in ("log", "other")]
    said = lab.refused(capsys, mapping(trials=trials), file, other, kind="c3d")
    assert "trials: log and other overlap in time on the mocap clock" in said and "give each a `start`" in said


def test_static_postures_are_marked_by_events(lab, tmp_path):
    dwells = np.array([[100.31, 100.87], [161.13, 161.99]])  # the second one in the second minute
    static = replace(
        trial(65.0, rate=20.0, plate_rate=100.0),
        dwell_start=dwells[:, 0],
        dwell_stop=dwells[:, 1],
        approach=np.zeros((2, 8), np.int8),
    )
    write_c3d(tmp_path / "log.c3d", static, described())
    described_ = mapping(trials=[{"id": "log", "role": "calibration", "kind": "static"}])
    described_["c3d"]["dwell_events"] = ["dwell start", "dwell stop"]
    lab.run(described_, tmp_path / "log.c3d", kind="c3d")
    ((_, found),) = load(lab.out).trials("calibration")
    np.testing.assert_allclose(np.stack([found.dwell_start, found.dwell_stop], axis=1), dwells, atol=1e-5)


def test_300_markers_keep_their_names(tmp_path):
    one = trial(0.1)
    many = replace(
        one,
        marker=tuple(f"m{i}" for i in range(300)),
        marker_body=("base",) * 300,
        marker_position=np.repeat(one.marker_position[:, :1], 300, axis=1) + np.arange(300)[:, None] * 1e-3,
    )
    write_c3d(tmp_path / "log.c3d", many, described())
    from calibration.formats.c3d.file import C3dFile

    assert C3dFile(tmp_path / "log.c3d").labels("POINT") == list(many.marker)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rate": 120.0}, "are no whole multiple of markers at 120 Hz"),
        ({"rate": 1000.0, "plate_rate": 100.0}, "are no whole multiple"),
        ({"seconds": 66.0, "rate": 1000.0}, "66000 frames, C3D counts 65535 at most; split the trial"),
    ],
)
def test_what_c3d_cannot_hold_is_not_written(tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        write_c3d(tmp_path / "log.c3d", trial(**changes), described())
    assert not (tmp_path / "log.c3d").exists()


def test_uneven_times_are_not_written(tmp_path):
    one = trial()
    t = one.t_mocap.copy()
    t[7] += 3e-3
    with pytest.raises(InputError, match=r"steps of 7.000 to 13.000 ms; C3D has one fixed rate"):
        write_c3d(tmp_path / "log.c3d", replace(one, t_mocap=t), described())


def corners(order):
    def change(c3d):
        c = c3d["parameters"]["FORCE_PLATFORM"]["CORNERS"]["value"]
        c3d.add_parameter("FORCE_PLATFORM", "CORNERS", c[:, order, :])

    return change


def positive_origin(c3d):
    c3d.add_parameter("FORCE_PLATFORM", "ORIGIN", -c3d["parameters"]["FORCE_PLATFORM"]["ORIGIN"]["value"])


def lower(c3d):
    c = c3d["parameters"]["FORCE_PLATFORM"]["CORNERS"]["value"]
    c3d.add_parameter("FORCE_PLATFORM", "CORNERS", c + np.array([0.0, 0.0, 50.0])[:, None, None])


def holes(c3d):
    c3d["data"]["analogs"][0, 2, 500:520] = np.nan


def clock(name, value):
    return set_parameter("CLOCK", name, [value])


BAD = {
    "a block of NaN": (holes, "plate: 20 samples are missing, the first is 500; cut them out"),
    "mirrored corners": (corners([1, 0, 3, 2]), "CORNERS put its z axis upwards"),
    "corners from another one": (corners([1, 2, 3, 0]), "x axis along"),
    "crossed corners": (corners([0, 2, 1, 3]), "the four corners are no rectangle"),
    "a plate elsewhere": (lower, "the file puts its centre at [0.9, 0.45, 0.05] m"),
    "ORIGIN above the surface": (positive_origin, "ORIGIN z is +41.3 mm, the transducer above the surface"),
    "moments in another unit than said": (
        set_parameter("ANALOG", "UNITS", ["N", "N", "N", "N.mm", "N.m", "N.mm"] * 2), "map the right `moment_unit`",
    ),
    "no units": (set_parameter("ANALOG", "UNITS", [""] * 12), "are [''] and the mapping nothing of its moments"),
    "pounds": (set_parameter("ANALOG", "UNITS", ["lbf"] * 12), "expected N and N.mm"),
    "type 3": (set_parameter("FORCE_PLATFORM", "TYPE", [3, 3]), "is of type 3; export it as type 2 or 4"),
    "one plate": (set_parameter("FORCE_PLATFORM", "USED", [1]), "FORCE_PLATFORM:USED is 1, there is no plate 2"),
    "fewer types than plates": (set_parameter("FORCE_PLATFORM", "TYPE", [2]), "TYPE has (1,) values, expected (2,)"),
    "three channels a plate": (
        set_parameter("FORCE_PLATFORM", "CHANNEL", [[1, 7], [2, 8], [3, 9]]), "CHANNEL has (3, 2) values, expected (6,",
    ),
    "a channel the file lacks": (
        set_parameter("FORCE_PLATFORM", "CHANNEL", [[k, k + 7] for k in range(1, 7)]), "the file has 1 to 12; export",
    ),
    "more samples than frames": (clock("MOCAP_SAMPLES", "100000"), "CLOCK:MOCAP_SAMPLES is 100000, the file has"),
    "fewer plate samples than none": (clock("PLATE_SAMPLES", "-3"), "CLOCK:PLATE_SAMPLES is -3, the file has"),
    "a start that is no number": (clock("MOCAP_START", "noon"), "CLOCK:MOCAP_START is ['noon'], expected a number"),
    "labels": (set_parameter("POINT", "LABELS", [f"m{i}" for i in range(8)]), "POINT:LABELS: no ['base0', 'base1'"),
    "inches": (set_parameter("POINT", "UNITS", ["in"]), "POINT:UNITS is ['in'], expected mm or m"),
    "metres": (set_parameter("POINT", "UNITS", ["m"]), "m from the laboratory's origin; in millimetres?"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_reported_with_channel_and_remedy(lab, capsys, file, name):
    change, words = BAD[name]
    described_ = mapping()
    if name == "metres":
        described_["c3d"]["plates"] = {}
    said = lab.refused(capsys, described_, rewritten(file, change), kind="c3d")
    assert f"{file}: " in said and words in said


@pytest.mark.parametrize("convention", ["action"])
def test_action_for_reaction_is_seen_by_the_robots_weight(lab, capsys, file, convention):
    described_ = mapping()
    for plate in described_["c3d"]["plates"].values():
        plate["convention"] = convention
    said = lab.refused(capsys, described_, file, kind="c3d")
    assert "plate: Fz is +" in said and "its wrench is the reaction, or the plate is upside down" in said


@pytest.mark.parametrize("size", [0, 100, 700, -1, -2000])
def test_a_truncated_file_is_reported(lab, capsys, file, size):
    whole = file.read_bytes()
    data_end = checked_header(file).data_start + checked_header(file).data_bytes
    file.write_bytes(whole[: size if size >= 0 else data_end + size])
    said = lab.refused(capsys, mapping(), file, kind="c3d")
    assert f"{file}: " in said and ("truncated" in said or "is no C3D file" in said)


def test_a_rate_that_was_renamed_is_reported(lab, capsys, file):
    raw = bytearray(file.read_bytes())
    at = raw.index(b"\x04\x02RATE", raw.index(b"ANALOG")) if b"\x04\x02RATE" in raw else None
    if at is None:
        positions = [i for i in range(512, len(raw) - 8) if raw[i : i + 4] == b"RATE"]
        at = positions[-1] if len(positions) > 1 else positions[0]
    value = raw.index(struct.pack("<f", 1000.0), 512)
    raw[value : value + 4] = struct.pack("<f", 1003.0)
    file.write_bytes(bytes(raw))
    said = lab.refused(capsys, mapping(), file, kind="c3d")
    assert "ANALOG:RATE 1003 Hz is not 10 times POINT:RATE 100 Hz" in said


def test_more_frames_than_c3d_counts_are_reported(tmp_path):
    path, n = tmp_path / "long.c3d", 70000
    c3d = ezc3d.c3d()
    c3d["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    c3d["parameters"]["POINT"]["LABELS"]["value"] = ("a",)
    c3d["data"]["points"] = np.ones((4, 1, n))
    c3d.write(str(path))
    with pytest.raises(InputError, match=r"holds more than 65535 frames, which C3D cannot count; split the trial"):
        checked_header(path)


def test_a_file_of_another_machine_is_reported(tmp_path, file):
    raw = bytearray(file.read_bytes())
    raw[515] = 85
    file.write_bytes(bytes(raw))
    with pytest.raises(InputError, match="DEC or SGI"):
        checked_header(file)


def test_channels_and_wrench_are_inverse_to_each_other_on_a_turned_plate():
    plate = drawn_plate(described().plates[1], DEPTH)
    wrench = np.random.default_rng(3).normal(size=(50, 6)) * [100.0, 100.0, 700.0, 40.0, 40.0, 5.0]
    np.testing.assert_allclose(lab_wrench(plate, channels_of(plate, wrench)), wrench, atol=1e-12)
    np.testing.assert_allclose(plate.centre, PLATES[1]["centre"], atol=1e-15)
    np.testing.assert_allclose(plate.size, PLATES[1]["size"])
