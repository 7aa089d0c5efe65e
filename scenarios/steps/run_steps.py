"""The steps of a campaign, each from a scenario or from files to files.

    simulate: a scenario -> dataset/, truth/        calibrate: dataset/ -> estimate/
    evaluate: estimate/, dataset/ -> evaluation.json, and score.json with truth/        report: all of it -> report.html

Only dataset/ crosses from the simulation to the calibration. What a step writes is there whole or not at all.
Importing this module is cheap: the engines are imported by the step that needs them.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

from scenarios.files import output_folder as folder
from scenarios.files.errors import ScenarioError
from scenarios.steps.threads import every_core, import_ahead, one_blas_thread
from scenarios.steps.versions import versions

if TYPE_CHECKING:
    from calibration import Dataset, Estimate, Evaluation
    from calibration.options import Options
    from scenarios.files.scenario import Scenario
    from scenarios.score.score import Score

Progress = Callable[[str, str, float], None]
"""Called with the step, what it is at, and the fraction of the step that is done [-]."""

_POSES = (".csv", ".nc")  # predicted poses instead of an estimate


@dataclass(frozen=True)
class RunResult:
    """A run that was written.

    Attributes:
        folder: The run folder.
        scenario: What was run, as resolved.
        estimate: What the calibration found.
        evaluation: Its held-out error against the recordings.
        score: Its error against the truth.
    """

    folder: Path
    scenario: "Scenario"
    estimate: "Estimate"
    evaluation: "Evaluation"
    score: "Score"


def silent(step: str, at: str, fraction: float) -> None:
    """Show no progress."""


def load(name_or_path: str | Path, overrides: Sequence[str] = ()) -> "Scenario":
    """Read a scenario, one of ours by its name or any by its path; `path.to.field=value` overrides its values.

    A run's scenario.yaml is a scenario: the versions noted in it are read and not used.

    Raises:
        ScenarioError: There is none, or something in it is wrong; all findings at once.
    """
    from scenarios.files import extends, registry, yaml_file

    path = registry.find(name_or_path)  # an unknown name is refused before the engines are imported
    from scenarios.files.scenario import Scenario

    path, extending = extends.resolve(path)
    return yaml_file.read(path, Scenario, [*extending, *overrides], {"versions": dict[str, str]})


def run(scenario: "Scenario", out: Path | str, *, quick: bool = False, progress: Progress = silent) -> RunResult:
    """Simulate, calibrate, evaluate and report into the run folder `out`.

    Args:
        scenario: What to run.
        out: The run folder; an earlier run there is replaced once this one is complete.
        quick: Run the scenario's short variant.
        progress: Called with how far each step is.

    Raises:
        ScenarioError: `out` must not be overwritten.
        TwinError: The simulation failed.
        NotEnoughData, NotCalibrated, NumericalFailure: No usable result; the folder keeps recordings and reasons.
    """
    from calibration.errors import NotCalibrated, NotEnoughData, NumericalFailure

    scenario = scenario.quick() if quick else scenario
    refused: NotCalibrated | NotEnoughData | NumericalFailure | None = None
    with folder.replacing(out, folder.RUN) as new, every_core(), ThreadPoolExecutor(1) as beside:
        beside.submit(import_ahead)
        _simulate(scenario, new, progress)
        drawn = beside.submit(_draw, scenario, new)  # the calibration leaves more of the cores idle
        try:
            estimate = _calibrate(
                new / "dataset", new / "estimate", None, scenario.calibration, progress, cross_validate=True
            )
            evaluation, score = _evaluate(new / "estimate", new / "dataset", new, new / "truth", progress)
            drawn.result()
            _report(new, progress)
        except (NotCalibrated, NotEnoughData, NumericalFailure) as error:
            refused = error
            drawn.result()
            _refuse(new, error, progress)
    if refused is not None:
        refused.add_note(f"The recordings are kept, with a report of why: {Path(out) / 'report.html'}")
        raise refused
    return RunResult(Path(out), scenario, estimate, evaluation, cast("Score", score))


def simulate(scenario: "Scenario", out: Path | str, progress: Progress = silent) -> None:
    """Write dataset/, truth/ and scenario.yaml into the run folder `out`."""
    with folder.replacing(out, folder.SIMULATED) as new, one_blas_thread(), ThreadPoolExecutor(1) as beside:
        drawn = beside.submit(_draw, scenario, new)
        _simulate(scenario, new, progress)
        drawn.result()


def calibrate(
    dataset: Path | str,
    out: Path | str,
    stages: Sequence[str] | None = None,
    progress: Progress = silent,
    options: "Options | None" = None,
    plan_next: bool = False,
) -> "Estimate":
    """Write the estimate folder `out` from a dataset folder alone.

    The estimate says itself whether it may be used; it is written either way.

    Args:
        dataset: A dataset folder, the twin's or a real one.
        out: The estimate folder; an earlier one there is replaced.
        stages: Only these; None runs every stage.
        progress: Called with how far it is.
        options: What is chosen; None: the defaults.
        plan_next: Whether to search for what to record next.

    Raises:
        ScenarioError: `out` must not be overwritten, or a stage does not exist.
        CalibrationError: The dataset cannot be read, or does not allow a result.
    """
    from calibration.pipeline import STAGES

    unknown = [name for name in stages or () if name not in STAGES]
    if unknown:
        raise ScenarioError(f"--stages: no stage {', '.join(map(repr, unknown))}; the stages are {', '.join(STAGES)}")
    folder.settle_inputs(dataset)
    with folder.replacing(out, folder.ESTIMATE) as new, every_core():
        return _calibrate(Path(dataset), new, stages, options, progress, plan_next, cross_validate=stages is None)


def options(**chosen: str | None) -> "Options":
    """Options of a calibration from the command line's words; those that are None stay at their defaults.

    Raises:
        ScenarioError: A word is not one of those possible.
    """
    from pydantic import TypeAdapter, ValidationError

    from calibration.options import Options

    given = {name: value for name, value in chosen.items() if value is not None}
    try:
        return TypeAdapter(Options).validate_python(given)
    except ValidationError as error:
        lines = [f"--{e['loc'][0]}: {e['msg']} (got {e['input']!r})" for e in error.errors()]
        raise ScenarioError("\n".join(lines)) from error


def evaluate(
    estimate: Path | str,
    dataset: Path | str,
    out: Path | str,
    truth: Path | str | None = None,
    progress: Progress = silent,
    zeros: Path | str | None = None,
) -> tuple["Evaluation", "Score | None"]:
    """Write evaluation.json into the folder `out`, and score.json where a truth is given; the rest of `out` stays.

    `estimate` is an estimate folder, an estimate.json, a URDF with its `zeros`, or predicted poses (.csv, .nc).
    """
    folder.settle_inputs(estimate, dataset)
    with folder.updating(out, folder.EVALUATION, "evaluation.json") as new, every_core():
        return _evaluate(Path(estimate), Path(dataset), new, truth, progress, zeros)


def report(run_folder: Path | str, progress: Progress = silent) -> Path:
    """Write report.html of a run folder from what is saved there; return its path.

    Raises:
        ScenarioError: The folder holds no evaluation, or a file that cannot be read.
    """
    folder.settle_inputs(run_folder)
    _report(Path(run_folder), progress)
    return Path(run_folder) / "report.html"


def _simulate(scenario: "Scenario", out: Path, progress: Progress) -> None:
    import twin
    from scenarios.files import yaml_file

    progress("simulate", "", 0.0)
    yaml_file.write(out / "scenario.yaml", scenario, beside={"versions": versions()})
    twin.record(scenario.twin, scenario.seed, out, lambda at, fraction: progress("simulate", at, fraction))


def _draw(scenario: "Scenario", out: Path) -> None:
    from twin.rendering import picture

    picture(scenario.twin, scenario.seed, out / "figures" / "twin.png")


def _calibrate(
    dataset: Path,
    out: Path,
    stages: Sequence[str] | None,
    options: "Options | None",
    progress: Progress,
    plan_next: bool = False,
    cross_validate: bool = False,
) -> "Estimate":
    import calibration

    progress("calibrate", "", 0.0)
    estimate = calibration.calibrate(
        calibration.load(dataset),
        stages,
        lambda at, share: progress("calibrate", at, share),
        options,
        plan_next,
        cross_validate,
    )
    calibration.save_estimate(estimate, out)
    return estimate


def evaluated(
    estimate: Path, dataset: "Dataset", zeros: Path | str | None = None, progress: Progress = silent
) -> tuple["Estimate | None", "Evaluation"]:
    """An estimate, None for predicted poses, and its evaluation.

    Raises:
        InputError: It cannot be read, or is not of this dataset.
        NotCalibrated: It must not be used.
    """
    import calibration
    from calibration.breakdown import Breakdowns
    from calibration.evaluation import read_submission

    progress("evaluate", "", 0.0)
    found = None if estimate.suffix.lower() in _POSES else calibration.load_estimate(estimate, zeros)
    with Breakdowns("evaluation"):
        return found, calibration.evaluate(
            read_submission(estimate) if found is None else found,
            dataset,
            lambda at, fraction: progress("evaluate", at, fraction),
        )


def _evaluate(
    estimate: Path,
    dataset: Path,
    out: Path,
    truth: Path | str | None,
    progress: Progress,
    zeros: Path | str | None = None,
) -> tuple["Evaluation", "Score | None"]:
    import calibration
    from scenarios.score.score import score

    share = 1.0 if truth is None else 0.8
    scaled: Progress = lambda step, at, fraction: progress(step, at, share * fraction)  # noqa: E731
    found, evaluation = evaluated(estimate, calibration.load(dataset), zeros, scaled)
    with ThreadPoolExecutor(1) as beside:
        saved = [beside.submit(save, out) for save in (evaluation.save, evaluation.save_predictions)]
        progress("evaluate", "writing" if truth is None else "against the truth", share)
        scored = None if truth is None else score(found, evaluation, Path(truth))
        _ = [job.result() for job in saved]
    if scored is not None:
        scored.save(out)
    return evaluation, scored


def _refuse(run_folder: Path, why: Exception, progress: Progress) -> None:
    from scenarios import report as page

    progress("report", "", 0.0)
    (run_folder / page.REASON).write_text(f"{why}\n", encoding="utf-8")
    page.write_refusal(run_folder)


def _report(run_folder: Path, progress: Progress) -> None:
    from scenarios import report as page

    progress("report", "", 0.0)
    is_refused = (run_folder / page.REASON).is_file() and not (run_folder / "evaluation.json").is_file()
    (page.write_refusal if is_refused else partial(page.write, progress=partial(progress, "report")))(run_folder)
