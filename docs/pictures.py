"""Pictures of the README and the documents, made from a finished run: `make pictures`.

docs/robot.gif      held-out motion, base motion x 50, markers, plate force, nominal robot pale
docs/ladder.svg     six rows of the ladder, from evaluation.json
docs/report.png     first screen of report.html; docs/report_real.png that of a recorded dataset's
docs/pictures.json  sha256 of the files that decide what they look like
"""

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from scenarios.plots.style import ESTIMATE, NOMINAL, OTHER, drawing, figure, svg
from scenarios.report.results.ladder import best_of_each
from scenarios.report.results.run_results import read
from scenarios.report.results.section import run_view

DOCS = Path(__file__).parent
SOURCES = ("scenarios/report/**/*.*", "scenarios/plots/*.py", "twin/rendering/*.py", "docs/pictures.py")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
TIAGO_TWIN = Path(sys.executable).with_name("tiago-twin")
CLIP = ("--trial", "xyz", "--start", "0.5", "--duration", "6", "--magnify", "50", "--ghost", "0.35")


def inputs() -> dict[str, str]:
    """Sha256 of every file that decides what the pictures look like, by its path."""
    root = DOCS.parent
    paths = sorted(p for pattern in SOURCES for p in root.glob(pattern) if "__pycache__" not in p.parts)
    return {p.relative_to(root).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in paths}


def ladder(run: Path) -> str:
    """Bars of the position error on unseen motion, one predictive row a model."""
    rows = best_of_each(run_view(read(run)).steps)
    with drawing():
        drawn = figure(7.0, 0.32 * len(rows) + 0.5)
        ax = drawn.add_axes((0.14, 0.2, 0.76, 0.78))
        for y, row in enumerate(rows):
            mm, colour = row.main.position_rmse_component_mm, {"nominal": NOMINAL, "registration": OTHER}
            ax.barh(y, mm, 0.62, color=colour.get(row.model, ESTIMATE))
            ax.annotate(f"{mm:.2f}", (mm, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
        ax.set_yticks(range(len(rows)), [row.model for row in rows])
        ax.invert_yaxis()
        ax.grid(visible=False, axis="y")
        ax.tick_params(axis="y", length=0)
        ax.set_xlabel("error of the hand on unseen motion, RMSE per component [mm]")
        return svg(drawn, "ladder")


def screenshot(page: Path, out: Path, browser: str) -> None:
    """The first screen of a page, 1280 pixels wide."""
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1280,820"]
        subprocess.run([browser, *options, f"--screenshot={shot}", page.resolve().as_uri()], check=True, timeout=300)
        Image.open(shot).convert("RGB").save(out, optimize=True)


def recorded(folder: Path) -> Path:
    """A run folder of the recorded postures in tests/data: three quarters calibrated, one predicted, at random.

    The table has groups of four with the wrist near zero in the first: every fourth row would be a region of its own.
    """
    data = DOCS.parent / "tests" / "data" / "qualisys_2021-11-30_postures.csv"
    head, *rows = data.read_text(encoding="utf-8").splitlines()
    kept = set(np.random.default_rng(0).permutation(len(rows))[: len(rows) // 4])
    days = ([row for k, row in enumerate(rows) if (k in kept) == unseen] for unseen in (False, True))
    files = [folder / "day1.csv", folder / "day2.csv"]
    for path, lines in zip(files, days, strict=True):
        path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    mapping, dataset = str(DOCS / "mappings" / "qualisys_two_days.yaml"), str(folder / "dataset")
    for command in (["import", "csv", *map(str, files), "--map", mapping, "--out", dataset], ["process", dataset]):
        out = ["--out", str(folder / "run")] if command[0] == "process" else []
        subprocess.run([TIAGO_TWIN, *command, *out], check=True)
    return folder / "run"


def main(run: Path) -> int:
    """Write every picture."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        sys.exit("no Chromium is installed; on Debian: apt install chromium")
    (DOCS / "ladder.svg").write_text(ladder(run), encoding="utf-8")
    screenshot(run / "report.html", DOCS / "report.png", browser)
    with tempfile.TemporaryDirectory() as folder:
        screenshot(recorded(Path(folder)) / "report.html", DOCS / "report_real.png", browser)
    (DOCS / "pictures.json").write_text(json.dumps(inputs(), indent=1) + "\n", encoding="utf-8")
    subprocess.run([TIAGO_TWIN, "picture", run, "--clip", DOCS / "robot.gif", *CLIP], check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
