"""Fixtures for test suites of calibration code: simulated robots with known errors, and assertions on calibrations.

    def test_my_calibration(twin_run, assert_improves, assert_within):
        run = twin_run("short", seed=3)               # simulated, calibrated by us, evaluated: paths and numbers
        mine = run.evaluate(calibrate(run.dataset))   # yours: the path of an estimate.json or a URDF
        assert_improves(mine, by=0.5)
        assert_within(mine, mm=3.0, deg=1.0)

    improves     RMSE(model) <= (1 - by) RMSE(over)           of the hand's position on trials no calibration has used
    covers       n_covered >= F^-1(0.001; n_judged, 0.95)     F binomial: valid 95 % intervals

The program runs in a process of its own, so that packages of a project may have any name. Results are cached in
$TIAGO_TWIN_CACHE, else the user's cache directory, by scenario, seed, settings and the content of the program.
"""

import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest

_PREDICTIVE = ("plate", "dynamics", "fixed")  # of the base's motion, without measuring it: the first that is there
_RARE = 0.001  # how often valid intervals fail `assert_covers`
_UNUSED = 30 * 86400.0  # [s] after which a cached result is removed
_PACKAGES = ("calibration", "mjcf", "scenarios", "twin")
_MAIN = "import sys; sys.path.insert(0, {home!r}); from scenarios.commands.main import main; main()"


@dataclass(frozen=True)
class TwinResult:
    """An evaluated calibration, as plain values and paths.

    Attributes:
        folder: Holds evaluation.json and score.json.
        main: The model it is about.
        rows: Errors on held-out trials against the motion capture, as in evaluation.json.
        score: Errors against the truth, as in score.json.
    """

    folder: Path
    main: str
    rows: tuple[dict[str, Any], ...] = field(repr=False)
    score: dict[str, Any] = field(repr=False)

    def row(self, model: str = "", trials: str = "dynamic", base: str = "", encoder: str = "motor") -> dict[str, Any]:
        """A row of the ladder: `model` "" is the main one, `base` "" the best source that does not measure the base."""
        name = model or self.main
        found = {r["base"]: r for r in self.rows if (r["model"], r["trials"], r["encoder"]) == (name, trials, encoder)}
        wanted = base or next((b for b in _PREDICTIVE if b in found), "")
        if wanted not in found:
            known = sorted({f"{r['model']} ({r['trials']}, base {r['base']}, {r['encoder']})" for r in self.rows})
            raise KeyError(f"no row {name} ({trials}, base {wanted or 'any'}, {encoder}); there are {', '.join(known)}")
        return found[wanted]


@dataclass(frozen=True)
class TwinRun(TwinResult):
    """A simulated robot, its recordings, our calibration of it and their evaluation.

    `dataset` is what a calibration may read, `truth` is for evaluation only, `estimate` is our own calibration.
    """

    dataset: Path
    truth: Path
    estimate: Path

    def evaluate(self, estimate: Path | str) -> TwinResult:
        """Evaluate another calibration of this robot, given as an estimate folder or .json, a URDF, or poses."""
        path = Path(estimate).resolve()
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        content = [self.folder.name, *(part for file in files for part in (file.name, _sha256(file)))]
        arguments = ("evaluate", str(path), str(self.dataset), "--truth", str(self.truth))
        folder = _cached("evaluation", content, arguments)
        rows, file = _rows(folder), path / "estimate.json" if path.is_dir() else path
        names = {str(row["model"]) for row in rows}
        name = _json(file).get("main") if file.suffix == ".json" else file.stem
        return TwinResult(folder, name if name in names else str(rows[-1]["model"]), rows, _json(folder / "score.json"))


@pytest.fixture(scope="session")
def twin_run() -> Callable[..., TwinRun]:
    """A run of a scenario, `twin_run(scenario="short", seed=None, settings=(), quick=True)`, made once and cached.

    `scenario` is a name from `tiago-twin list` or a path, `settings` are "path=value" as `--set` takes them.
    """

    def run(
        scenario: str | Path = "short", seed: int | None = None, settings: Sequence[str] = (), quick: bool = True
    ) -> TwinRun:
        chosen = [*_chosen(seed, settings), *(["--quick"] if quick else [])]
        folder = _cached("run", [*_content(scenario), *chosen], ("run", _name(scenario), *chosen))
        main = _json(folder / "estimate" / "estimate.json")["main"]
        paths = (folder / name for name in ("dataset", "truth", "estimate"))
        return TwinRun(folder, main, _rows(folder), _json(folder / "score.json"), *paths)

    return run


@pytest.fixture(scope="session")
def twin_dataset() -> Callable[..., tuple[Path, ...]]:
    """Recorded robots, `twin_dataset(scenario="swing20", n=3, seed=None, settings=())`: a folder each, with truth."""

    def dataset(
        scenario: str | Path = "swing20", n: int = 3, seed: int | None = None, settings: Sequence[str] = ()
    ) -> tuple[Path, ...]:
        chosen = ["-n", str(n), *_chosen(seed, settings)]
        folder = _cached("dataset", [*_content(scenario), *chosen], ("dataset", _name(scenario), *chosen))
        return tuple(sorted(path.parent.parent for path in folder.rglob("dataset/dataset.json")))

    return dataset


@pytest.fixture(scope="session")
def assert_improves() -> Callable[..., None]:
    """`assert_improves(result, model="", over="nominal", *, by=0.0, trials="dynamic", base="", encoder="motor")`.

    Fails unless the position RMSE of `model` is below that of the row `over` by the share `by` [-]. `base` "" is the
    best source of the base's motion without measuring it, for both rows.
    """

    def improves(  # noqa: PLR0913  a row of the ladder has so many names
        result: TwinResult,
        model: str = "",
        over: str = "nominal",
        *,
        by: float = 0.0,
        trials: str = "dynamic",
        base: str = "",
        encoder: str = "motor",
    ) -> None:
        """Fail unless `model` is better than `over` by the share `by` [-] in position RMSE [mm]."""
        ours, theirs = result.row(model, trials, base, encoder), result.row(over, trials)
        found, before = (row["position_rmse_norm_mm"] for row in (ours, theirs))
        if not found <= (1.0 - by) * before:
            pytest.fail(
                f"{_words(ours)}: {found:.2f} mm, {over}: {before:.2f} mm; "
                f"{1.0 - found / before:.0%} better, at least {by:.0%} required",
                pytrace=False,
            )

    return improves


@pytest.fixture(scope="session")
def assert_within() -> Callable[..., None]:
    """`assert_within(result, model="", *, mm=None, deg=None, trials="dynamic", base="", encoder="motor")`.

    Fails unless the RMSE of position (norm) and of orientation on held-out trials are at most `mm` and `deg`.
    """

    def within(  # noqa: PLR0913  a row of the ladder has so many names
        result: TwinResult,
        model: str = "",
        *,
        mm: float | None = None,
        deg: float | None = None,
        trials: str = "dynamic",
        base: str = "",
        encoder: str = "motor",
    ) -> None:
        """Fail unless the errors of `model` are at most `mm` [mm] and `deg` [deg]; None: no limit."""
        row = result.row(model, trials, base, encoder)
        for name, limit, unit in (("position_rmse_norm_mm", mm, "mm"), ("orientation_rmse_deg", deg, "deg")):
            found = row[name]
            if limit is not None and (found is None or not found <= limit):
                shown = "unknown" if found is None else f"{found:.2f} {unit}"
                pytest.fail(f"{_words(row)}: {name} is {shown}, at most {limit:g} {unit} allowed", pytrace=False)

    return within


@pytest.fixture(scope="session")
def assert_covers() -> Callable[..., None]:
    """`assert_covers(result, at_least=None)`: fails unless 95 % intervals contain the true values.

    `at_least` is the share of the judged parameters and combinations; None: what one in a thousand sets of valid
    intervals falls short of.
    """

    def covers(result: TwinResult, at_least: float | None = None) -> None:
        n, inside = (int(result.score.get(key) or 0) for key in ("n_judged", "n_covered"))
        least = _quantile(n) if at_least is None else at_least * n
        if n == 0 or inside < least:
            entries = [*result.score["parameters"], *result.score["combinations"]]
            outside = [p["name"] for p in entries if p["z"] is not None and abs(p["z"]) > 1.96]
            worst = f"; outside: {', '.join(outside[:10])}" if outside else ""
            pytest.fail(
                f"{inside} of {n} intervals of 95 % contain the truth, at least {math.ceil(least)} required{worst}",
                pytrace=False,
            )

    return covers


def _quantile(n: int) -> int:
    """Smallest k with P(at most k of n intervals contain the truth) >= 0.001."""
    total = 0.0
    for k in range(n + 1):
        total += math.comb(n, k) * 0.95**k * 0.05 ** (n - k)
        if total >= _RARE:
            return k
    return n


def _words(row: dict[str, Any]) -> str:
    return f"{row['model']} ({row['trials']} trials, base {row['base']}, {row['encoder']} encoders)"


def _chosen(seed: int | None, settings: Sequence[str]) -> list[str]:
    """Seed and settings as options of the command line."""
    return [*(() if seed is None else ("--seed", str(seed))), *(part for s in settings for part in ("--set", s))]


def _name(scenario: str | Path) -> str:
    """A scenario's name, or its path wherever the program runs."""
    return str(Path(scenario).resolve()) if Path(scenario).is_file() else str(scenario)


def _content(scenario: str | Path) -> list[str]:
    """What a scenario is: its name, or its file with those beside it that it may extend."""
    path = Path(scenario)
    return [_sha256(p) for p in sorted(path.parent.glob("*.yaml"))] + [path.name] if path.is_file() else [str(scenario)]


def _rows(folder: Path) -> tuple[dict[str, Any], ...]:
    return tuple(_json(folder / "evaluation.json")["rows"])


def _json(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _home() -> Path:
    """The folder the four packages are in, without importing one of them."""
    here = Path(__file__).resolve()
    if here.parent.name == "testing":  # the source tree
        return here.parents[2]
    installed = metadata.distribution("tiago-twin")
    origin = json.loads(installed.read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        return Path(url2pathname(urlparse(origin["url"]).path))
    return Path(str(installed.locate_file("")))


def _program(home: Path) -> list[str]:
    """Version and content of the installed program, and of what computes for it."""
    files = (p for package in _PACKAGES for p in (home / package).rglob("*") if p.suffix in (".py", ".yaml", ".xml"))
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.relative_to(home).as_posix().encode() + b"\0" + path.read_bytes())
    return [digest.hexdigest(), sys.version, *(metadata.version(name) for name in ("mujoco", "pin", "numpy", "scipy"))]


def _cache() -> Path:
    """The cache directory; results that nobody used for 30 days are removed from it."""
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tiago-twin"
    folder = Path(os.environ.get("TIAGO_TWIN_CACHE") or usual) / "pytest"
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        if time.time() - old.stat().st_mtime > _UNUSED:
            shutil.rmtree(old, ignore_errors=True)
    return folder


def _cached(kind: str, content: Sequence[str], arguments: Sequence[str]) -> Path:
    """The folder a command wrote for this content, from an earlier session where there is one."""
    home, cache = _home(), _cache()
    key = hashlib.sha256("\0".join([kind, *_program(home), *content]).encode()).hexdigest()[:20]
    folder = cache / f"{kind}-{key}"
    if not folder.is_dir():
        part = cache / f"{kind}-{key}.{os.getpid()}"
        command = [sys.executable, "-P", "-c", _MAIN.format(home=str(home)), *arguments, "--out", str(part)]
        done = subprocess.run(command, cwd=cache, capture_output=True, text=True)
        if done.returncode:
            shutil.rmtree(part, ignore_errors=True)
            shown = " ".join(["tiago-twin", *arguments])
            pytest.fail(f"{shown}: exit {done.returncode}\n{done.stderr.strip()[-2000:]}", pytrace=False)
        try:
            part.rename(folder)
        except OSError:  # another session was faster
            shutil.rmtree(part, ignore_errors=True)
    os.utime(folder)
    return folder
