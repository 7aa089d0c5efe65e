"""Cases of damaged and forged datasets: names and places of files, JSON, arrays, URDF."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibration.recording.trial import read_trial, write_trial
from tests.hostile.rows.case import Case, edit, linked, pipe, put, replaced, text
from tests.hostile.rows.laboratory import renew, trial, values

LOOK_ONE = "look data --trial xyz --out out"
CALIBRATE, LOOK, EXPORT = "calibrate data --out out", "look data --out out", "export csv data --out out"
EVALUATE = "evaluate run/estimate run/dataset --out out"
IMPORT = "import csv csv/swing.mocap.csv csv/swing.robot.csv csv/swing.plate.csv --map csv/mapping.yaml --out out"
DATA, MAP = "data/dataset.json", "csv/mapping.yaml"

_LONG = "a" * 300
_BAD_NAMES = {
    "parent": "../x", "deep parent": "../../../../x", "absolute": "/tmp/x", "slash": "a/b", "dots": "..", "dot": ".",
    "hidden": ".x", "empty": "", "long": _LONG, "newline": "a\nb", "NUL": "a\0b", "tag": "<script>alert(1)</script>",
    "mathtext": "$\\frac{$", "space": "a b", "option": "--out", "right to left": "\u202ea", "backslash": "..\\x",
}  # fmt: skip

NAMES = [
    Case(f"trial id {kind}, {command.split()[0]}", put(DATA, "trials", 0, "id", value=name), command, "pattern")
    for k, (kind, name) in enumerate(_BAD_NAMES.items())
    for command in ((LOOK, EXPORT, CALIBRATE)[k % 3],)
] + [
    Case("joint with a slash", put(DATA, "joints", 0, "name", value="a/b"), LOOK, "joints.0.name"),
    Case("body with a newline", put(DATA, "bodies", 0, "name", value="a\nb"), LOOK, "bodies.0.name"),
    Case("marker too long", put(DATA, "bodies", 0, "markers", 0, "name", value=_LONG), LOOK, "markers.0.name"),
    Case("file in the parent", put(DATA, "trials", 0, "file", value="../x.nc"), LOOK, "inside the dataset"),
    Case("file absolute", put(DATA, "trials", 0, "file", value="/etc/passwd"), LOOK, "inside the dataset"),
    Case("file that is a folder", put(DATA, "trials", 0, "file", value="trials"), LOOK, "missing|is a folder"),
    Case("file with NUL", put(DATA, "trials", 0, "file", value="a\0"), LOOK, "inside the dataset"),
    Case("file too long", put(DATA, "trials", 0, "file", value=_LONG), LOOK, "200"),
    Case("trial listed twice", edit(DATA, lambda d: d["trials"].append(d["trials"][0])), LOOK, "more than once"),
    Case("mapping's trial id in the parent", replaced(MAP, "id: swing", "id: ../../x"), IMPORT, "pattern"),
    Case("mapping's trial id absolute", replaced(MAP, "id: swing", "id: /tmp/x"), IMPORT, "pattern"),
]


def _linked_out(folder: Path) -> None:
    path = folder / "data/trials/xyz.nc"
    path.rename(folder / "elsewhere.nc")
    path.symlink_to(folder / "elsewhere.nc")


JSON = [
    Case("nested 200,000 deep", text(DATA, "[" * 200_000), CALIBRATE, "nested too deeply"),
    Case("integer of 5000 digits", text(DATA, '{"schema": ' + "1" * 5000 + "}"), CALIBRATE, "broken JSON"),
    Case("key twice", text(DATA, '{"schema": 1, "schema": 1}'), CALIBRATE, "is there twice"),
    Case("cut off", text(DATA, '{"schema": 1,'), CALIBRATE, "broken JSON"),
    Case("not UTF-8", text(DATA, b"\xff\xfe{}"), CALIBRATE, "not UTF-8"),
    Case("a list", text(DATA, "[]"), CALIBRATE, "dataset"),
    Case("100 MB", text(DATA, b" " * (100 * 2**20)), CALIBRATE, "MB", slow=True),
    Case("NaN", text(DATA, '{"gravity": [0, 0, NaN]}'), CALIBRATE, "gravity"),
    Case("endless device", linked(DATA, "/dev/zero"), CALIBRATE, "no regular file"),
    Case("pipe", pipe(DATA), CALIBRATE, "no regular file"),
    Case("unknown field", put(DATA, "truth", value=1), CALIBRATE, "truth"),
    Case("100,000 trials", edit(DATA, lambda d: d.update(trials=d["trials"] * 33_334)), CALIBRATE, "10000", slow=True),
    Case("10,000 joints", edit(DATA, lambda d: d.update(joints=d["joints"] * 1250)), CALIBRATE, "joints"),
    Case("no gravity", put(DATA, "gravity", value=[0, 0, 0]), CALIBRATE, "gravity"),
    Case("gravity 1e300", put(DATA, "gravity", value=[0, 0, 1e300]), CALIBRATE, "gravity"),
    Case("sigma 1e-300", put(DATA, "sigmas", "marker", value=1e-300), CALIBRATE, "sigmas.marker"),
    Case("tolerance 1e300", put(DATA, "tolerances", "link_com", value=1e300), CALIBRATE, "tolerances.link_com"),
    Case("plate axes zero", put(DATA, "plates", 0, "axes", value=[[0, 0, 0]] * 3), CALIBRATE, "right-handed"),
    Case("plate axes left-handed", put(DATA, "plates", 0, "axes", 0, value=[-1, 0, 0]), CALIBRATE, "right-handed"),
    Case(
        "payload on an unknown link",
        put(DATA, "payload", value={"link": "no", "mass": 1, "com": [0, 0, 0], "tolerance": 0.1}),
        CALIBRATE,
        "no frame named 'no'",
    ),
    Case(
        "payload of 1e308 kg",
        put(DATA, "payload", value={"link": "arm_7_link", "mass": 1e308, "com": [0, 0, 0], "tolerance": 0.1}),
        CALIBRATE,
        "payload.mass",
    ),
    Case(
        "wheels of one name",
        put(DATA, "wheels", value=2 * [{"name": "w", "type": "drive", "centre": [0, 0, 0.1], "contact": [0, 0, 0]}]),
        CALIBRATE,
        "wheels named more than once: ['w']",
    ),
    Case("body on an unknown link", put(DATA, "bodies", 1, "link", value="no"), CALIBRATE, "no frame named 'no'|no "),
    Case("base frame that moves", put(DATA, "base_frame", value="torso_lift_link"), CALIBRATE, "moves with joint"),
    Case("tool frame on the base", put(DATA, "tool_frame", value="base_footprint"), CALIBRATE, "no measured joint"),
    Case("joints in another order", edit(DATA, lambda d: d["joints"].reverse()), CALIBRATE, "joints"),
    Case(
        "hand drawn in a line",
        edit(DATA, lambda d: [m.update(xyz=[0.1 * k, 0, 0]) for k, m in enumerate(d["bodies"][1]["markers"])]),
        CALIBRATE,
        "drawn in a line",
    ),
    Case("a lone surrogate", text(DATA, '{"robot": "\\ud800"}'), CALIBRATE, "robot"),
]


def _dimension(folder: Path) -> None:
    import netCDF4

    with netCDF4.Dataset(folder / "data/trials/xyz.nc", "w") as file:
        file.createDimension("t_robot", 10**9)
        file.createDimension("joint", 8)
        for name in ("joint", "marker", "marker_body"):
            file.createVariable(name, str, ("joint",))
        file.createVariable("t_robot", "f8", ("t_robot",), compression="zlib")
        file.createVariable("q_motor", "f4", ("t_robot", "joint"), compression="zlib")
    renew(folder)


def _absent(folder: Path) -> None:
    import netCDF4

    with netCDF4.Dataset(folder / "data/trials/xyz.nc", "w") as file:
        file.createDimension("t_robot", 2)
        file.createDimension("joint", 1)
        file.createDimension("t_mocap", 10**9)
        file.createDimension("marker", 10**6)
        for name in ("joint", "marker", "marker_body"):
            file.createVariable(name, str, ("joint",))
        file.createVariable("t_robot", "f8", ("t_robot",))[:] = [0, 1]
        file.createVariable("q_motor", "f4", ("t_robot", "joint"))[:] = 0
    renew(folder)


def _strings(file) -> None:
    file.renameVariable("q_motor", "old")
    file.createVariable("q_motor", str, ("t_robot", "joint"))


def _one_sample(*names: str) -> Callable[[Path], None]:
    """The swing with the first sample of some arrays alone."""

    def spoil(folder: Path) -> None:
        path = folder / "data/trials/swing.nc"
        swing = read_trial(path)
        write_trial(path, replace(swing, **{name: getattr(swing, name)[:1] for name in names}))
        renew(folder)

    return spoil


def _last(value: float):
    def change(t: np.ndarray) -> np.ndarray:
        t[-1] = value
        return t

    return change


def _cut(folder: Path) -> None:
    path = folder / "data/trials/xyz.nc"
    path.write_bytes(path.read_bytes()[:5000])
    renew(folder)


def _swapped(t: np.ndarray) -> np.ndarray:
    return t[::-1]


TRIALS = [
    Case("dimension of 1e9", _dimension, LOOK_ONE, "numbers"),
    Case("dimension of 1e15 of an array that is not there", _absent, LOOK_ONE, "numbers"),
    Case("readings that are text", trial("xyz", _strings), LOOK_ONE, "no numbers"),
    Case("cut off", _cut, LOOK_ONE, "not a readable netCDF4"),
    Case("times in milliseconds", values("postures", "t_robot", lambda t: 1e3 * t), CALIBRATE, "milliseconds"),
    Case("marker times in milliseconds", values("postures", "t_mocap", lambda t: 1e3 * t), LOOK, "milliseconds"),
    Case("plate times in microseconds", values("postures", "t_plate", lambda t: 1e6 * t), LOOK, "milliseconds"),
    Case("last time 1e300", values("swing", "t_robot", _last(1e300)), CALIBRATE, "t_robot spans"),
    Case("last time infinite", values("swing", "t_robot", _last(np.inf)), CALIBRATE, "finite"),
    Case("last time a day later", values("swing", "t_robot", _last(86400.0)), CALIBRATE, "t_robot spans"),
    Case("times reversed", values("swing", "t_mocap", _swapped), CALIBRATE, "does not increase"),
    Case("times all alike", values("swing", "t_plate", lambda t: 0 * t), CALIBRATE, "does not increase"),
    Case("dwells reversed", values("postures", "dwell_stop", _swapped), CALIBRATE, "dwell"),
    Case("dwells all alike", values("postures", "dwell_start", lambda t: 0 * t + t[0]), CALIBRATE, "dwell"),
    Case("a dwell NaN", values("postures", "dwell_start", _last(np.nan)), EXPORT, "dwell"),
    Case("approach 127", values("postures", "approach", lambda x: x + 127), CALIBRATE, "approach"),
    Case("a link out of the dataset", _linked_out, LOOK_ONE, "link out"),
    Case(
        "one sample of readings",
        _one_sample("t_robot", "q_motor", "q_link", "v_motor", "effort", "q_command", "wrist_wrench"),
        CALIBRATE,
        "t_robot",
    ),
    Case("one sample of the plate", _one_sample("t_plate", "plate_wrench"), CALIBRATE, "t_plate"),
    Case("checksum of another", put(DATA, "trials", 0, "sha256", value="0" * 64), LOOK, "sha256"),
    Case(
        "one plate sample NaN",
        values("xyz", "plate_wrench", lambda w: np.where(w == w[5], np.nan, w)),
        LOOK_ONE,
        codes=(0,),
        slow=True,
    ),
    Case(
        "one plate sample infinite",
        values("xyz", "plate_wrench", lambda w: np.where(w == w[5], np.inf, w)),
        LOOK_ONE,
        codes=(0,),
        slow=True,
    ),
    Case(
        "NaN in a reading",
        values("postures", "q_motor", lambda q: np.where(q == q[50], np.nan, q)),
        CALIBRATE,
        codes=(0, 1),
        slow=True,
    ),
    Case("readings NaN", values("postures", "q_motor", lambda q: np.nan * q), CALIBRATE, codes=(1, 2), slow=True),
    Case(
        "markers infinite",
        values("postures", "marker_position", lambda p: np.inf * p),
        CALIBRATE,
        codes=(1, 2),
        slow=True,
    ),
    Case("markers zero", values("postures", "marker_position", lambda p: 0 * p), CALIBRATE, codes=(1, 2), slow=True),
    Case("wrench 1e30", values("swing", "plate_wrench", lambda w: 1e30 * w), CALIBRATE, codes=(0, 1, 2), slow=True),
]

_LINK = '<link name="l{0}"/><joint name="j{0}" type="fixed"><parent link="l{1}"/><child link="l{0}"/></joint>'
_ROBOT = '<robot name="r"><link name="l0"/>{}</robot>'
URDF_PATH = "data/nominal.urdf"

URDF = [
    Case(
        "10,000 links in a row",
        text(URDF_PATH, _ROBOT.format("".join(_LINK.format(k, k - 1) for k in range(1, 10_001)))),
        CALIBRATE,
        "links",
    ),
    Case(
        "an entity",
        text(URDF_PATH, '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>'),
        CALIBRATE,
        "document type",
    ),
    Case(
        "an entity in an estimate", text("run/estimate/nominal.urdf", "<!DOCTYPE r><robot/>"), EVALUATE, "document type"
    ),
    Case("a loop", text(URDF_PATH, _ROBOT.format(_LINK.format(1, 2) + _LINK.format(2, 1))), CALIBRATE, "tree"),
    Case("negative mass", replaced(URDF_PATH, '<mass value="', '<mass value="-'), CALIBRATE, "mass value"),
    Case("NaN", replaced(URDF_PATH, 'xyz="', 'xyz="nan '), CALIBRATE, "nan"),
    Case("not XML", text(URDF_PATH, "<robot"), CALIBRATE, "not a URDF"),
    Case("200,000 elements deep", text(URDF_PATH, "<a>" * 200_000), CALIBRATE, "not a URDF", slow=True),
    Case("endless device", linked(URDF_PATH, "/dev/zero"), CALIBRATE, "no regular file"),
    Case("pipe", pipe(URDF_PATH), CALIBRATE, "no regular file"),
    Case(
        "an axis of no length", replaced(URDF_PATH, '<axis xyz="0 0 1"', '<axis xyz="0 0 0"'), CALIBRATE, "axis length"
    ),
    Case(
        "no masses", replaced(URDF_PATH, "<mass value=", "<mass value='0' old=", 99), CALIBRATE, "no masses", (0,), True
    ),
    Case("of another robot", replaced(URDF_PATH, "arm_4_joint", "elbow", 99), CALIBRATE, "no joint named"),
]

GROUPS = {"names": NAMES, "JSON": JSON, "trials": TRIALS, "URDF": URDF}
