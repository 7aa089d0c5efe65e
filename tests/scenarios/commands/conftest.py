"""The command with small fakes for engines."""

import importlib
import sys
from types import ModuleType

import pytest

import calibration
import twin
import twin.rendering
from scenarios.commands import console, main
from scenarios.files import registry
from tests.scenarios.commands.stand_ins import YAML, Engines, Scenario


def picture(config, seed, path):
    """A file where a picture of the robot would be, in a folder of its own."""
    path.parent.mkdir()
    path.write_text("picture")


@pytest.fixture
def engines(monkeypatch, tmp_path):
    """Replace every engine, offer one scenario `small`, and work in an empty folder."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    fakes = Engines()
    for package, name in (
        (twin, "record"),
        *((calibration, name) for name in ("load", "calibrate", "save_estimate", "load_estimate", "evaluate")),
    ):
        monkeypatch.setattr(package, name, getattr(fakes, name), raising=False)
    for name, content in (
        ("files.scenario", {"Scenario": Scenario}),
        ("score.score", {"score": fakes.score}),
        ("report", {"write": fakes.report, "write_refusal": fakes.refusal, "REASON": "refused.txt"}),
    ):
        module = ModuleType(f"scenarios.{name}")
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        package, _, leaf = module.__name__.rpartition(".")
        monkeypatch.setattr(importlib.import_module(package), leaf, module, raising=False)
    monkeypatch.setattr(twin.rendering, "picture", picture)
    end = ["Calibrated.", "Report: {}"]
    monkeypatch.setattr(console, "summary", lambda run: [line.format(run / "report.html") for line in end])
    (tmp_path / "known").mkdir()
    (tmp_path / "known" / "small.yaml").write_text(YAML)
    monkeypatch.setattr(registry, "HERE", tmp_path / "known")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return fakes


@pytest.fixture
def tiago_twin(capsys):
    """Run the command in this process; return exit code, stdout and stderr."""

    def command(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as info:
            main.main(arguments)
        return int(info.value.code or 0), *capsys.readouterr()

    return command
