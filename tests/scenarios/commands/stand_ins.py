"""Stand-ins for the engines behind the command line, and the one scenario they know."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from threadpoolctl import threadpool_info

from calibration.options import Options

ROW = {
    "model": "registration",
    "trials": "dynamic",
    "base": "fixed",
    "encoder": "motor",
    "position_rmse_component_mm": 4.5678,
    "position_rmse_norm_mm": 7.9,
    "orientation_rmse_deg": 1.25,
}

YAML = "name: small\ndescription: A small example\nseed: 3\ntwin:\n  gap: 0.01\n"


class Twin(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    gap: Annotated[float, Field(ge=0, le=0.05)]


class Scenario(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str
    description: str
    seed: Annotated[int, Field(ge=0)]
    twin: Twin
    calibration: Options = Options(terms="tensor")

    def quick(self) -> "Scenario":
        return self.model_copy(update={"description": "short"})


def blas_threads() -> tuple[int, ...]:
    """Threads of each loaded library of linear algebra."""
    return tuple(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")


@dataclass
class Engines:
    """Stand-ins; `fail` raises in a step, `calls` keeps what they were given."""

    fail: dict[str, BaseException] = field(default_factory=dict)
    calls: dict[str, tuple] = field(default_factory=dict)
    calibrated: bool = True

    def step(self, name: str, *arguments: object) -> None:
        self.calls[name] = arguments
        if name in self.fail:
            raise self.fail[name]

    def record(self, config, seed, out, progress):
        (out / "dataset").mkdir()
        (out / "dataset" / "dataset.json").write_text(f"{config.gap} {seed}")
        (out / "truth").mkdir()
        progress("trial around_x", 0.5)
        self.step("record", config, seed)

    def load(self, dataset):
        return Path(dataset)

    def calibrate(self, dataset, stages=None, progress=None, options=None, plan_next=False, cross_validate=False):
        self.step("calibrate", dataset, stages)
        self.calls["options"] = (options,)
        self.calls["blas"] = blas_threads()
        return self.load_estimate(dataset)

    def load_estimate(self, path, dataset=None):
        verdict = SimpleNamespace(stage="clocks", verdict="ok", message="0.1 ms")
        return SimpleNamespace(calibrated=self.calibrated, verdicts=[verdict], extent="calibrated")

    def save_estimate(self, estimate, folder):
        self.saves("estimate.json", {"main": "model_2"})(folder)

    def evaluate(self, estimate, dataset, progress=None):
        self.step("evaluate", dataset)

        def save_predictions(folder):
            (folder / "predictions").mkdir()

        save = self.saves("evaluation.json", {"rows": [{**ROW, "against": "mocap"}]})
        return SimpleNamespace(save=save, save_predictions=save_predictions)

    def score(self, estimate, evaluation, truth_dir):
        self.step("score", truth_dir)
        row = {**ROW, "model": "floor", "against": "truth"}
        return SimpleNamespace(save=self.saves("score.json", {"rows": [row]}))

    def report(self, run_dir, progress):
        self.step("report", run_dir)
        (Path(run_dir) / "report.html").write_text("<html>")

    def refusal(self, run_dir):
        (Path(run_dir) / "report.html").write_text("<html>not calibrated")

    @staticmethod
    def saves(name, content=None):
        def save(folder):
            folder.mkdir(exist_ok=True)
            (folder / name).write_text(json.dumps(content))

        return save


def here() -> dict[str, str]:
    """Every file below the current folder with its text."""
    return {str(path): path.read_text() for path in sorted(Path().rglob("*")) if path.is_file()}
