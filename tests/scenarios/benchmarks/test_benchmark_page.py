"""Every command of docs/benchmark.md is run, in its order, on one robot of task `all`."""

import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from scenarios.benchmarks import baselines, frozen, make, scoring
from scenarios.benchmarks.tasks import TASKS
from scenarios.commands.main import app
from tests.bench import bench_page

PAGE = Path(__file__).parents[3] / "docs/benchmark.md"
PEER = Path(__file__).parents[3] / ".venv-peer/bin/python"


def lines() -> list[list[str]]:
    """Commands of the page, each once."""
    blocks = re.findall(r"```bash\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    found = dict.fromkeys(line.partition("#")[0].strip() for block in blocks for line in block.splitlines())
    return [line.split() for line in found if line != "make peer"]


@pytest.mark.slow
def test_every_command_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if PEER.is_file():
        (tmp_path / ".venv-peer").symlink_to(PEER.parents[1])
    monkeypatch.setitem(frozen.TIERS, "quick", 1)
    for module in (make, baselines, scoring):
        monkeypatch.setattr(module, "TASKS", TASKS[-1:])
    monkeypatch.setattr(bench_page, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(bench_page, "KEPT", tmp_path / "kept.json")
    own, *later = sorted(lines(), key=lambda line: "runs/mine" in line)  # an entry of one's own comes last
    for line in (own, *later):
        if "runs/mine" in line:
            shutil.copytree("runs/ours", "runs/mine")
        if "tests.bench.bench_page" in line:
            bench_page.write(Path(line[-1]))
        elif line[1] == "peer":
            assert not {"--estimate", "--truth", "--out"} - set(line), "carried out by test_peer"
        elif PEER.is_file() or "--peer" not in line:
            arguments = [x for x in line[1:] if PEER.is_file() or x != "runs/figaroh"]
            done = CliRunner().invoke(app, arguments, catch_exceptions=False)
            assert done.exit_code == 0, (line, done.output)
    assert "| nominal |" in bench_page.PAGE.read_text() and Path("runs/scores/scores.md").is_file()
