"""Every command and every Python block of a document runs, in its order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/tutorials.md", "docs/python.md")
LANGUAGES = {"bash": ["bash", "-euo", "pipefail", "-c"], "python": [sys.executable, "-c"]}

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(tmp_path):
    """An empty folder with the repository's data and documents, and the command where `make` puts it."""
    for name in ("tests", "docs", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(Path(sys.executable).parent)
    return tmp_path


def commands(page):
    """Blocks of a page, each with its language; targets of make have tests of their own."""
    for language, block in re.findall(r"```(bash|python)\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        lines = block if language == "python" else re.sub(r"^make .*\n", "", block, flags=re.MULTILINE)
        if lines.strip() and "def test_" not in lines:
            yield language, lines


@pytest.mark.parametrize("page", PAGES)
def test_every_line_of_a_page_runs(page, folder):
    bin_ = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{bin_}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": "Agg"}
    for language, block in commands(page):
        options = {"cwd": folder, "env": environment, "capture_output": True, "text": True, "timeout": 900}
        done = subprocess.run([*LANGUAGES[language], block], **options)
        assert done.returncode == 0, f"{block}\n{done.stdout[-500:]}\n{done.stderr[-2000:]}"
