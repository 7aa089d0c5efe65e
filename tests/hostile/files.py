"""Cases of damaged, forged and mistaken files: datasets, estimates, results, laboratory files, scenarios."""

import os
from pathlib import Path

import numpy as np

from tests.hostile.case import Case, edit, put, replaced, text
from tests.hostile.laboratory import renew, trial, values

LOOK_ONE = "look data --trial xyz --out out"
CALIBRATE, LOOK, EXPORT = "calibrate data --out out", "look data --out out", "export csv data --out out"
EVALUATE, REPORT = "evaluate run/estimate run/dataset --out out", "report run"
IMPORT = "import csv csv/swing.mocap.csv csv/swing.robot.csv csv/swing.plate.csv --map csv/mapping.yaml --out out"
SCENARIO = "simulate scenario.yaml --out out"
DATA, ESTIMATE, MAP = "data/dataset.json", "run/estimate/estimate.json", "csv/mapping.yaml"
ANY = (0, 1, 2)

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


def _pipe(path: str):
    def spoil(folder: Path) -> None:
        (folder / path).unlink()
        os.mkfifo(folder / path)

    return spoil


def _linked(path: str, to: str):
    def spoil(folder: Path) -> None:
        (folder / path).unlink()
        (folder / path).symlink_to(to)

    return spoil


JSON = [
    Case("nested 200,000 deep", text(DATA, "[" * 200_000), CALIBRATE, "nested too deeply"),
    Case("integer of 5000 digits", text(DATA, '{"schema": ' + "1" * 5000 + "}"), CALIBRATE, "broken JSON"),
    Case("key twice", text(DATA, '{"schema": 1, "schema": 1}'), CALIBRATE, "is there twice"),
    Case("cut off", text(DATA, '{"schema": 1,'), CALIBRATE, "broken JSON"),
    Case("not UTF-8", text(DATA, b"\xff\xfe{}"), CALIBRATE, "not UTF-8"),
    Case("a list", text(DATA, "[]"), CALIBRATE, "dataset"),
    Case("100 MB", text(DATA, b" " * (100 * 2**20)), CALIBRATE, "MB", slow=True),
    Case("NaN", text(DATA, '{"gravity": [0, 0, NaN]}'), CALIBRATE, "gravity"),
    Case("endless device", _linked(DATA, "/dev/zero"), CALIBRATE, "no regular file"),
    Case("pipe", _pipe(DATA), CALIBRATE, "no regular file"),
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
    Case("endless device", _linked(URDF_PATH, "/dev/zero"), CALIBRATE, "no regular file"),
    Case("pipe", _pipe(URDF_PATH), CALIBRATE, "no regular file"),
    Case("of another robot", replaced(URDF_PATH, "arm_4_joint", "elbow", 99), CALIBRATE, "no joint named"),
]

_SUSPENSION = {"form": "printed", "C": [[1.0]], "tangent": [[1.0]], "gravity": [[1.0]], "held_out": []}
_TWO = {"joints": ["turn"], "base_frame": "base", "tool_frame": "hand"}

RESULTS = [
    Case("estimate cut off", text(ESTIMATE, "{"), EVALUATE, "broken JSON"),
    Case("estimate {}", text(ESTIMATE, "{}"), EVALUATE, "models"),
    Case(
        "estimate with a parameter twice",
        edit(ESTIMATE, lambda e: e["models"]["model_2"]["parameters"].append(e["models"]["model_2"]["parameters"][0])),
        EVALUATE,
        "twice|more than once",
    ),
    Case(
        "estimate with a model named ../x",
        edit(ESTIMATE, lambda e: e["models"].update({"../x": e["models"]["model_2"]})),
        EVALUATE,
        "models",
    ),
    Case(
        "estimate with a value 1e308",
        put(ESTIMATE, "models", "model_2", "parameters", 0, "value", value=1e308),
        EVALUATE,
        "less than or equal",
    ),
    Case(
        "estimate of link_zero one short",
        edit(ESTIMATE, lambda e: e.update(link_zero=[0.0, 0.0, 0.0], robot=_TWO)),
        EVALUATE,
        "link_zero",
    ),
    Case(
        "estimate whose stiffness is ragged",
        put(ESTIMATE, "suspension", value=_SUSPENSION | {"K": [[1.0], [1.0, 2.0]]}),
        EVALUATE,
        "do not fit",
    ),
    Case("covariance file damaged", text("run/estimate/estimate.nc", b"CDF\x01aaaa"), EVALUATE, "netCDF4"),
    Case("plan that is a list", text("run/estimate/record_next.yaml", "[1]"), EVALUATE, "postures and motions"),
    Case("evaluation {}", text("run/evaluation.json", "{}"), REPORT, "evaluation.json"),
    Case("evaluation []", text("run/evaluation.json", "[]"), REPORT, "evaluation.json"),
    Case("evaluation deep", text("run/evaluation.json", "[" * 100_000), REPORT, "nested too deeply"),
    Case("score {}", text("run/score.json", "{}"), REPORT, "score.json"),
    Case(
        "scenario note of bombs",
        text("run/scenario.yaml", "a: &a [x]\n" + "b: [*b]\n"),
        REPORT,
        "within itself|not YAML",
    ),
    Case("evaluation.nc damaged", text("run/evaluation.nc", b"\x89HDF\r\n\x1a\nx"), REPORT, "netCDF4"),
    Case("check of results []", text("run/score.json", "[]"), "check run --max model_2.mm=2", "no results"),
    Case(
        "check of results without rows",
        put("run/score.json", "rows", 0, value=[1]),
        "check run --max model_2.mm=2",
        "no results",
    ),
    Case(
        "check of a figure that is a list",
        put("run/score.json", "coverage_95", value=[1]),
        "check run --max coverage=2",
        "not known",
    ),
    Case("collection {", text("run/collection.json", "{"), "dataset short -n 1 --out run", "not a collection"),
]


def _csv(old: str, new: str):
    return replaced("csv/swing.mocap.csv", old, new)


def _cell(row: int, column: int, value: str, file: str = "csv/swing.mocap.csv"):
    def spoil(folder: Path) -> None:
        lines = (folder / file).read_text().splitlines()
        cells = lines[row].split(",")
        cells[column] = value
        lines[row] = ",".join(cells)
        (folder / file).write_text("\n".join(lines) + "\n")

    return spoil


CSV = [
    Case("a cell of 20,000 characters", _cell(3, 1, "1" * 20_000), IMPORT, "no value|no number"),
    Case("a cell that is text", _cell(3, 1, "x" * 20_000), IMPORT, "no number"),
    Case("a time that is infinite", _cell(-1, 0, "inf"), IMPORT, "no value"),
    Case("a time of 1e300", _cell(-1, 0, "1e300"), IMPORT, "no value"),
    Case("a time of tomorrow", _cell(-1, 0, "90000"), IMPORT, "spans"),
    Case("a reading that is infinite", _cell(4, 1, "inf", "csv/swing.robot.csv"), IMPORT, "no value"),
    Case("an empty reading", _cell(4, 1, "", "csv/swing.robot.csv"), IMPORT, "empty"),
    Case("a row too short", _cell(4, 1, "1,2,3,4"), IMPORT, "cells"),
    Case("times in milliseconds", replaced(MAP, "unit: s\n", "unit: ms\n", 9), IMPORT, "has a sample each"),
    Case("no rows", text("csv/swing.mocap.csv", "t,m1_x,m1_y,m1_z\n"), IMPORT, "no rows"),
    Case("binary", text("csv/swing.mocap.csv", bytes(range(256))), IMPORT, "no CSV|no rows|header"),
    Case(
        "3000 columns",
        text("csv/swing.mocap.csv", ",".join(f"c{k}" for k in range(3000)) + "\n" + "0," * 2999 + "0\n"),
        IMPORT,
        "columns",
    ),
    Case(
        "byte order mark of Excel",
        lambda d: (d / "csv/swing.mocap.csv").write_bytes(b"\xef\xbb\xbf" + (d / "csv/swing.mocap.csv").read_bytes()),
        IMPORT,
        codes=(0,),
    ),
    Case("a pipe", _pipe("csv/swing.mocap.csv"), IMPORT, "no regular file"),
    Case(
        "mapping's urdf an endless device",
        replaced(MAP, "urdf: nominal.urdf", "urdf: /dev/zero"),
        IMPORT,
        "no regular file",
    ),
    Case(
        "mapping with a joint twice",
        replaced(MAP, "setup:", "reversed_effort: [no]\nsetup:"),
        IMPORT,
        "reversed_effort",
    ),
    Case(
        "mapping with overlapping dwells",
        replaced(MAP, "dwells:\n", "dwells: [[0.1, 0.5], [0.4, 0.9]]\n"),
        IMPORT,
        "dwell",
    ),
    Case("mapping with ragged approach", replaced(MAP, "approach:\n", "approach: [[1], [1, 1]]\n"), IMPORT, "approach"),
]

_BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)
)

YAML = [
    Case("aliases of aliases", text("scenario.yaml", _BOMB), SCENARIO, "aliases"),
    Case("aliases of aliases in a mapping", text(MAP, _BOMB), IMPORT, "aliases"),
    Case("an alias within itself", text("scenario.yaml", "a: &a [*a]\n"), SCENARIO, "within itself"),
    Case(
        "50,000 unknown keys",
        text("scenario.yaml", "".join(f"k{k}: 1\n" for k in range(50_000))),
        SCENARIO,
        "MB",
        slow=True,
    ),
    Case(
        "2,000 unknown keys",
        text("scenario.yaml", "".join(f"k{k}: 1\n" for k in range(2_000))),
        SCENARIO,
        "more",
        slow=True,
    ),
    Case("5 MB", text("scenario.yaml", "a: " + "x" * 5 * 2**20), SCENARIO, "MB"),
    Case("an integer of 5000 digits", text("scenario.yaml", "seed: " + "1" * 5000 + "\n"), SCENARIO, "not YAML"),
    Case("a day that is none", text("scenario.yaml", "description: 2024-02-30\n"), SCENARIO, "not YAML"),
    Case(
        "a Python object",
        text("scenario.yaml", "a: !!python/object/apply:os.system ['touch x']\n"),
        SCENARIO,
        "scenario.yaml",
    ),
    Case("100,000 deep", text("scenario.yaml", "[" * 100_000), SCENARIO, "deep|not YAML", slow=True),
    Case(
        "deep by indentation",
        text("scenario.yaml", "\n".join(" " * k + f"a{k}:" for k in range(900))),
        SCENARIO,
        "scenario.yaml",
    ),
    Case(
        "extends an endless device",
        text("scenario.yaml", "name: a\ndescription: b\nextends: /dev/zero\n"),
        SCENARIO,
        "no regular file|no such",
    ),
    Case("extends secrets", text("scenario.yaml", "extends: secret\n"), SCENARIO, "secret"),
    Case("not UTF-8", text("scenario.yaml", b"name: \xff\n"), SCENARIO, "UTF-8"),
    Case(
        "--set with an alias within itself",
        lambda d: None,
        "simulate short --out out --set seed=&a,[*a]".replace(",", "_"),
        "--set",
    ),
    Case(
        "--set of a duration",
        lambda d: None,
        "simulate short --quick --out out --set twin.instruments.mocap.swap_duration=300",
        codes=(0, 2),
        slow=True,
    ),
    Case(
        "--set infinite",
        lambda d: None,
        "simulate short --out out --set twin.instruments.mocap.swap_duration=.inf",
        "finite",
    ),
    Case(
        "--set seed of 5000 digits", lambda d: None, "simulate short --out out --set seed=" + "1" * 5000, "--set seed"
    ),
]

GROUPS = {
    "names": NAMES,
    "JSON": JSON,
    "trials": TRIALS,
    "URDF": URDF,
    "results": RESULTS,
    "CSV and mappings": CSV,
    "YAML and options": YAML,
}
