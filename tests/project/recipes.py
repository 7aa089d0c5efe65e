"""The recipes of CONTRIBUTING.md, carried out in a copy of the packages."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def recipe(name: str) -> str:
    """The fenced block that follows the recipe's mark."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (block,) = re.findall(rf"<!-- recipe: {name} -->\n```\w+\n(.*?)```", text, flags=re.DOTALL)
    return str(block)


def copied(tree: Path, *packages: str) -> Path:
    """A folder with a copy of the packages whose code a recipe edits."""
    for package in packages:
        shutil.copytree(ROOT / package, tree / package)  # with what numba compiled: modules keep their times
    return tree


def insert(path: Path, before: str, text: str) -> None:
    """Insert text before what the file has once."""
    old = path.read_text(encoding="utf-8")
    assert old.count(before) == 1, (path, before)
    path.write_text(old.replace(before, text + before), encoding="utf-8")


def run_script(tree: Path, script: str, *arguments: str) -> None:
    """Run a script in a folder with its copies of packages, everything else from here."""
    environment = {"PYTHONPATH": f"{tree}:{ROOT}", "MPLBACKEND": "agg", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
