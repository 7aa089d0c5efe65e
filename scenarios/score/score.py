"""Judge an estimate by the truth: parameters with their intervals, and every row of the ladder against true hand poses.

The truth is read here and nowhere else. The row `floor` is the error left with the true parameters and joint angles,
through the same measurements: T_lab_B measured, all that follows it true.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import calibration.evaluation
from calibration import Estimate, Evaluation
from calibration.evaluation import Budget, Row, TrialErrors, headline, trial_errors
from calibration.inference import Model
from calibration.prediction import BASELINE, PredictedTrial, Prediction
from calibration.stages.suspension import Source
from scenarios.files.errors import ScenarioError
from scenarios.score.parameters import ModelScore, ParameterScore, judge_estimate, with_holding
from scenarios.score.slip import SlipScore, slip_scores
from twin import truth
from twin.truth import Parameter, TruthTrial

FLOOR = "floor"
_SAME_TIME, _SAME_PLACE = 1e-3, 2e-3  # [s]; [m] drilling and noise of a body of markers are a tenth of it


@dataclass(frozen=True)
class BaseScore:
    """R2 of the base's roll and pitch as predicted from one source of the wrench, over n samples."""

    source: Source
    n: int
    roll_r2: float
    pitch_r2: float


@dataclass(frozen=True)
class Score(ParameterScore):
    """An estimate judged; coverage and NEES are the main model's.

    Attributes:
        rows: The ladder against the truth, floor included.
        skill: Of each row: (registration - row) / (registration - floor) in position RMSE per component [-].
        base: The base's roll and pitch by source of the wrench.
        slip: The slipping base alone, by trial and source.
        models: Every model by itself, the main one first.
        main: Model that is delivered; empty where there is none.
        budget: What its error consists of; None where it was not taken apart.
    """

    rows: tuple[Row, ...]
    skill: tuple[float | None, ...]
    base: tuple[BaseScore, ...] = ()
    slip: tuple[SlipScore, ...] = ()
    models: tuple[ModelScore, ...] = ()
    main: str = ""
    budget: Budget | None = None

    def content(self) -> dict[str, object]:
        """As in score.json."""
        rows = [r.entry() | {"skill": s} for r, s in zip(self.rows, self.skill, strict=True)]
        n, covered = (sum(getattr(score, name) for _, score in self.models) for name in ("n_judged", "n_covered"))
        return super().content() | {
            "models": {name: score.coverage() for name, score in self.models},
            "every_model": {"coverage_95": covered / n if n else None, "n_covered": covered, "n_judged": n},
            **self._headline(dict(zip(self.rows, rows, strict=True))),
            "budget": None if self.budget is None else self.budget.entry(),
            "rows": rows,
            "base": [asdict(b) for b in self.base],
            "slip": [one.entry() for one in self.slip],
        }

    def _headline(self, entries: Mapping[Row, object]) -> dict[str, object]:
        """The row that is delivered and the rows beside it; the floor is none of them."""
        found = headline([row for row in self.rows if row.model != FLOOR], self.main)
        return {} if found is None else {"main": entries[found.main], "beside": [entries[r] for r in found.beside]}


def score(estimate: Estimate | None, evaluation: Evaluation, truth_folder: Path) -> Score:
    """Judge an estimate, if there is one, and the predictions that were evaluated by the truth.

    Raises:
        ScenarioError: The truth is missing or of other trials.
        NotCalibrated: The estimate must not be used.
    """
    estimate = estimate or Estimate("calibrated", (), (), (Model("", ()),), "")
    estimated = {p.name for p in estimate.parameters}
    parameters, models = judge_estimate(estimate, _read_parameters(truth_folder / "truth.json", estimated))
    pairs = [(p, _read_trial(truth_folder / "trials" / f"{p.trial_id}.nc")) for p in evaluation.predicted]
    T_base_body = _derived(truth_folder)["T_base_base"]
    _check_same_run(pairs, T_base_body, truth_folder)
    rows = tuple(calibration.evaluation.ladder(list(_errors(pairs, T_base_body)), "truth"))
    main = {f.name: getattr(models[0][1], f.name) for f in fields(ParameterScore)} | {"parameters": parameters}
    skill = tuple(_skill(row, rows) for row in rows)
    return Score(
        **main,
        rows=rows,
        skill=skill,
        base=base_scores(pairs),
        slip=tuple(slip_scores(pairs)),
        models=models,
        main=evaluation.main,
        budget=_budget(pairs, truth_folder),
    )


def _budget(pairs: Iterable[tuple[PredictedTrial, TruthTrial]], truth_folder: Path) -> Budget | None:
    """The delivered row's error taken apart by the true base and joint angles; nothing of it is noise."""
    T_base_body, found = _derived(truth_folder)["T_base_base"], []
    for trial, true in pairs:
        names = trial.delivered.joints if trial.delivered else ()
        q = true.q_link_true[:, [true.joint.index(name) for name in names]]
        found.append((trial, true.hand_pose, true.base_pose @ T_base_body, q))
    return Budget.against(found)


def _read_parameters(path: Path, estimated: Collection[str]) -> tuple[Parameter, ...]:
    """Every parameter of the truth, and of what follows from them the stiffness and damping that were estimated."""
    try:
        derived = _derived(path.parent)
        elements = ((m, i, j) for m in "KC" if m in derived for i in range(6) for j in range(i, 6))
        found = (Parameter(f"suspension.{m}.{i + 1}{j + 1}", "", float(derived[m][i, j])) for m, i, j in elements)
        own = with_holding(truth.read_parameters(path))
        return (*own, *(p for p in found if p.name in estimated and np.isfinite(p.value)))
    except FileNotFoundError as error:
        raise ScenarioError(f"{path}: no such file; --truth names a run's truth folder") from error
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise ScenarioError(f"{path}: not a truth.json ({error}); make the run again") from error


def _errors(pairs: Iterable[tuple[PredictedTrial, TruthTrial]], T_base_body: np.ndarray) -> Iterator[TrialErrors]:
    """Errors of every prediction, and of the floor, against the true hand pose."""
    floors = []
    for trial, true in pairs:
        for p in (*trial.rows, _floor(trial, true, T_base_body)):
            found = trial_errors(p, true.hand_pose, trial.dwells)
            if p.model == FLOOR:
                floors.append(found)
            else:
                yield found
    yield from floors


def _read_trial(path: Path) -> TruthTrial:
    if not path.is_file():
        raise ScenarioError(f"{path}: no such file; --truth must be of the same run as the dataset")
    return truth.read_trial(path)


def _check_same_run(
    pairs: Iterable[tuple[PredictedTrial, TruthTrial]], T_base_body: np.ndarray, truth_folder: Path
) -> None:
    """Reject a truth with other times than the recordings, or whose base is not where its markers were measured."""
    for trial, true in pairs:
        same = len(trial.t) == len(true.t_mocap) and np.allclose(trial.t, true.t_mocap, rtol=0.0, atol=_SAME_TIME)
        if same and len(trial.T_lab_B):
            d = trial.T_lab_B[:, :3, 3] - (true.base_pose @ T_base_body)[:, :3, 3]
            same = bool(np.nanmedian(np.linalg.norm(d, axis=1)) < _SAME_PLACE)
        if not same:
            raise ScenarioError(
                f"{truth_folder}: trial {trial.trial_id!r} was not recorded in that run: its times or the place of its "
                "base are others; --truth must be of the same run as the dataset"
            )


def _derived(truth_folder: Path) -> dict[str, np.ndarray]:
    content = json.loads((truth_folder / "truth.json").read_text(encoding="utf-8"))["derived"]
    return {name: np.array(values, dtype=float) for name, values in content.items() if values is not None}


def _floor(trial: PredictedTrial, true: TruthTrial, T_base_body: np.ndarray) -> Prediction:
    """T_lab_B measured, T_B_hand true (n, 4, 4)."""
    T_B_hand = np.linalg.solve(true.base_pose @ T_base_body, true.hand_pose)
    return Prediction(FLOOR, "measured", "link", trial.trial_id, trial.kind, trial.t, trial.T_lab_B @ T_B_hand)


def _skill(row: Row, rows: tuple[Row, ...]) -> float | None:
    """1 at the floor, 0 at the registration-only baseline with the same source of base motion."""
    like = {r.model: r.metrics.position_rmse_component_mm for r in rows if (r.trials, r.base) == (row.trials, row.base)}
    floor = next(
        (r.metrics.position_rmse_component_mm for r in rows if (r.model, r.trials) == (FLOOR, row.trials)), None
    )
    start = like.get(BASELINE)
    if floor is None or start is None or start == floor:
        return None
    return (start - row.metrics.position_rmse_component_mm) / (start - floor)


def base_scores(trials: Iterable[tuple[PredictedTrial, TruthTrial]]) -> tuple[BaseScore, ...]:
    """One for each source of the wrench that the suspension was tried with; none without a suspension or swings.

        R2_a = 1 - sum (x_hat - x)_a^2 / sum (x - mean x)_a^2        x = log(R(0)' R(t)), all trials together

    R of the true base, and as predicted from the first second at rest and a wrench: no marker later than that.
    """
    pairs: dict[Source, list[tuple[np.ndarray, np.ndarray]]] = {}
    for trial, true in trials:
        base = trial.base
        if trial.kind == "swing" and base is not None and base.rest is not None:
            for source, x in base.predicted:
                pairs.setdefault(source, []).append((_turned(true.base_pose), _turned(base.rest.poses(x))))
    return tuple(_base_score(source, found) for source, found in pairs.items())


def _base_score(source: Source, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> BaseScore:
    true, found = (np.concatenate(x) for x in zip(*pairs, strict=True))
    left = ((found - true) ** 2).sum(axis=0) / ((true - true.mean(axis=0)) ** 2).sum(axis=0)
    return BaseScore(source, len(true), *(float(1.0 - x) for x in left[:2]))


def _turned(T: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_matrix(T[0, :3, :3].T @ T[:, :3, :3]).as_rotvec())
