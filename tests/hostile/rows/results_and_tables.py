"""Cases of damaged, forged and mistaken files beside the dataset: results, CSV and mappings, YAML and options."""

from pathlib import Path

import netCDF4

from tests.hostile.rows.case import Case, edit, pipe, put, replaced, text
from tests.hostile.rows.datasets import EVALUATE, IMPORT, MAP

REPORT, SCENARIO = "report run", "simulate scenario.yaml --out out"
ESTIMATE = "run/estimate/estimate.json"

_SUSPENSION = {"form": "printed", "C": [[1.0]], "tangent": [[1.0]], "gravity": [[1.0]], "held_out": []}
_TWO = {"joints": ["turn"], "base_frame": "base", "tool_frame": "hand"}


def _other_covariances(folder: Path) -> None:
    with netCDF4.Dataset(folder / "run/estimate/estimate.nc", "w") as file:
        group = file.createGroup("model_2")
        group.createDimension("parameter", 2)
        group.createVariable("random", "f8", ("parameter", "parameter"))[:] = [[1.0, 0.0], [0.0, 1.0]]


RESULTS = [
    Case("estimate with covariances of others", _other_covariances, EVALUATE, "those of others"),
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
    Case(
        "estimate whose stiffness is one number",
        put(ESTIMATE, "suspension", value=_SUSPENSION | {"K": [[1.0]]}),
        EVALUATE,
        "expected (6, 6)",
    ),
    Case(
        "estimate of a model without parameters of the hand",
        edit(ESTIMATE, lambda e: [m.update(parameters=[], combinations=[]) for m in e["models"].values()]),
        EVALUATE,
        codes=(0, 1, 2),
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
    Case("picture magnified infinitely", lambda d: None, "picture run --clip out.gif --magnify inf", "--magnify"),
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
    Case("a pipe", pipe("csv/swing.mocap.csv"), IMPORT, "no regular file"),
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
    Case(
        "mapping with wheels of one name",
        replaced(
            MAP, "wheels: []", "wheels:" + 2 * "\n  - {name: w, type: drive, centre: [0, 0, 0.1], contact: [0, 0, 0]}"
        ),
        IMPORT,
        "wheels named more than once",
    ),
    Case(
        "semicolons and decimal commas",
        lambda d: [
            p.write_text(p.read_text().replace(",", ";").replace(".", ",")) for p in (d / "csv").glob("swing.*.csv")
        ],
        IMPORT,
        codes=(0,),
        slow=True,
    ),
    Case(
        "a draft in a folder that is not there",
        lambda d: None,
        "import --init out/map.yaml csv/swing.mocap.csv csv/swing.robot.csv --urdf data/nominal.urdf",
        codes=(0,),
    ),
    Case(
        "markers in metres called millimetres",
        replaced(MAP, "marker_unit: m", "marker_unit: mm"),
        IMPORT,
        "or see marker_unit",
    ),
    Case("a comment above the header", replaced("csv/swing.robot.csv", "t", "# log\nt"), IMPORT, "is it the header?"),
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

GROUPS = {"results": RESULTS, "CSV and mappings": CSV, "YAML and options": YAML}
