"""Random damage until the time is over: `make fuzz`, FUZZ_SECONDS=1800 by default.

Each example damages a file of the small laboratory and runs a command on it; `runs/fuzz.json` has those that ended in a
traceback, a crash, beyond the bounds of time and memory, or with a file written elsewhere. Each cause is shown once,
with the smallest damage hypothesis found.
"""

import json
import os
import re
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import count
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tests.acceptance.claims import measured
from tests.hostile import mutation
from tests.hostile.rows.case import Case, judged
from tests.hostile.rows.laboratory import make, make_formats, renew

ROOT = Path(__file__).parents[2]
FOUND, KEPT = ROOT / "runs/fuzz.json", ROOT / "docs/results/fuzz.json"
ANY = (0, 1, 2)
_WHOLE = 1800  # [s] of a search that is kept for docs/reliability.md
_EXAMPLES = 15  # of a target before the next one


@dataclass(frozen=True)
class Target:
    """What is damaged, and the commands that read it.

    Attributes:
        path: A file of the laboratory.
        damage: Changes it.
        commands: Of which one is run.
        renewed: The dataset whose checksums are renewed.
    """

    path: str
    damage: Callable[[Path, Sequence[mutation.Change]], None]
    commands: tuple[str, ...]
    renewed: str = ""


_FILES = "csv csv/swing.mocap.csv csv/swing.robot.csv csv/swing.plate.csv"
_FRAMES = "calibrate one --stages clocks,registration --out out"
_ZEROS = "estimate/zeros.yaml"
_IMPORT = "import {} --map {}/mapping.yaml --out out"
TARGETS = {
    "dataset.json": Target(
        "one/dataset.json", mutation.of_json, ("export csv one --out out", _FRAMES, "look one --out out")
    ),
    "trial.nc": Target(
        "one/trials/swing.nc",
        mutation.of_netcdf,
        (_FRAMES, "export bag one --out out", "look one --out out", "calibrate one --out out"),
        "one",
    ),
    "postures.nc": Target("data/trials/postures.nc", mutation.of_netcdf, ("calibrate data --out out",), "data"),
    "nominal.urdf": Target("one/nominal.urdf", mutation.of_bytes, (_FRAMES,)),
    "estimate.json": Target(
        "estimate/estimate.json",
        mutation.of_json,
        ("evaluate estimate data --out out", "export urdf estimate --out out/x.urdf"),
    ),
    "run files": Target("run/evaluation.json", mutation.of_json, ("check run --max model_2.mm=9",)),
    "score": Target("run/score.json", mutation.of_json, ("check run --max model_2.mm=9",)),
    "mapping": Target("csv/mapping.yaml", mutation.of_yaml, (_IMPORT.format(_FILES, "csv"),)),
    "CSV": Target("csv/swing.robot.csv", mutation.of_csv, (_IMPORT.format(_FILES, "csv"),)),
    "marker CSV": Target(
        "csv/swing.mocap.csv",
        mutation.of_csv,
        (_IMPORT.format("csv csv/swing.mocap.csv", "csv"), "import --init out/map.yaml csv/swing.mocap.csv"),
    ),
    "C3D": Target("c3d/log.c3d", mutation.of_bytes, (_IMPORT.format("c3d c3d/log.c3d", "c3d"),)),
    "bag": Target("bag/swing.bag", mutation.of_bytes, (_IMPORT.format("bag bag/swing.bag", "bag"),)),
    "scenario": Target("scenario.yaml", mutation.of_yaml, ("show scenario.yaml",)),
    "whole scenario": Target("humanoids2024.yaml", mutation.of_yaml, ("show humanoids2024.yaml",)),
    "--set": Target("scenario.yaml", lambda path, changes: None, ("simulate humanoids2024 --out scenario.yaml",)),
    "zeros": Target(_ZEROS, mutation.of_yaml, (f"evaluate estimate/calibrated.urdf data --zeros {_ZEROS} --out out",)),
    "plan": Target("plan.yaml", mutation.of_yaml, ("simulate short --also plan.yaml --out scenario.yaml",)),
}


@dataclass
class Tally:
    """What was tried and found."""

    tried: Counter = field(default_factory=Counter)
    codes: Counter = field(default_factory=Counter)
    memory: float = 0.0
    seconds: float = 0.0
    causes: dict[str, dict] = field(default_factory=dict)


def cause_of(output: str, wrong: Sequence[str]) -> str:
    """A short name of what went wrong: the last line of ours in a traceback, and the error."""
    lines = re.findall(r'File "[^"]*/((?:calibration|scenarios|twin|mjcf)/[^"]*)", line (\d+)', output)
    error = re.findall(r"^([A-Za-z_.]+(?:Error|Exception|Warning)):", output, re.MULTILINE)
    return " ".join([*(f"{a}:{b}" for a, b in lines[-1:]), *error[-1:]]) or "; ".join(wrong)[:150]


def tried(name: str, changes: Sequence[mutation.Change], laboratory: Path, tally: Tally) -> str:
    """Try one example; return its cause where something is wrong."""
    target = TARGETS[name]
    command = target.commands[changes[0][0] % len(target.commands)]
    if name == "--set":
        command += "".join(f" --set {_overriding(where, what)}" for where, what in changes)

    def spoil(folder: Path) -> None:
        target.damage(folder / target.path, changes)
        if target.renewed:
            renew(folder, target.renewed)

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "at"
        shutil.copytree(laboratory, folder)
        found = judged(Case(name, spoil, command, codes=ANY), folder)
    tally.tried[name] += 1
    tally.codes[found.outcome.code] += 1
    tally.memory = max(tally.memory, found.outcome.memory)
    tally.seconds = max(tally.seconds, found.outcome.seconds)
    if not found.wrong:
        return ""
    cause = cause_of(found.outcome.output, found.wrong)
    tally.causes[cause] = {
        "target": name,
        "changes": changes,
        "wrong": found.wrong,
        "output": found.outcome.output[-1500:],
    }
    return cause


def _overriding(where: int, what: int) -> str:
    """A value of the scenario, or its half way, set to something."""
    paths = [one.path for one in _values()]
    keys = paths[where % len(paths)].split(".")
    text = json.dumps(mutation.VALUES[what % len(mutation.VALUES)])[:200].replace(" ", "")
    return f"{'.'.join(keys[: 1 + what // 64 % len(keys)])}={text}"


@cache
def _values():
    from scenarios import steps
    from scenarios.files.value_paths import value_paths

    return tuple(value_paths(steps.load("humanoids2024")))


def search(laboratory: Path, seconds: float) -> Tally:
    """Go from target to target until the time is over."""
    tally, end, names = Tally(), time.monotonic() + seconds, list(TARGETS)
    for k in count():
        if time.monotonic() > end:
            return tally
        known = set(tally.causes)
        _examples(names[k % len(names)], laboratory, tally, end)
        for cause in tally.causes.keys() - known:
            print(f"{names[k % len(names)]}: {cause}", flush=True)
    return tally


def _examples(name: str, laboratory: Path, tally: Tally, end: float) -> None:
    """Some examples of one target."""

    @settings(
        max_examples=_EXAMPLES, deadline=None, database=None, phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(st.lists(st.tuples(st.integers(0, 2**31), st.integers(0, 2**31)), min_size=1, max_size=3))
    def one(changes):
        if time.monotonic() < end:
            tried(name, changes, laboratory, tally)

    one()


def main() -> None:
    """Search, and write what was found."""
    asked, kept = float(os.environ.get("FUZZ_SECONDS", _WHOLE)), measured()
    with tempfile.TemporaryDirectory() as place:
        laboratory = make_formats(make(Path(place) / "laboratory"))
        tally = search(laboratory, asked)
    print(f"{sum(tally.tried.values())} examples: {dict(tally.tried)}; exit codes {dict(tally.codes)}")
    print(f"at most {tally.memory / 1e9:.2f} GB and {tally.seconds:.0f} s; {len(tally.causes)} causes")
    FOUND.parent.mkdir(exist_ok=True)
    FOUND.write_text(json.dumps(tally.causes, indent=1) + "\n")
    if asked >= _WHOLE:
        found = {"examples": tally.tried.total(), "causes": len(tally.causes)}
        found |= {"memory_MB": round(tally.memory / 1e6), "seconds": round(tally.seconds), "minutes": round(asked / 60)}
        KEPT.write_text(json.dumps(kept | found) + "\n", encoding="utf-8")
    sys.exit(bool(tally.causes))


if __name__ == "__main__":
    main()
