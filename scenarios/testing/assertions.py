"""What a calibration must do, as assertions for test suites; `scenarios.pytest_plugin` gives them and runs as fixtures.

improves     RMSE(model) <= (1 - by) RMSE(over)             of the hand's position on trials no stage has seen
covers       n_covered >= F^-1(0.001; n_judged, 0.95)       F binomial: 95 % intervals that hold 95 % of the truths
"""

from typing import TYPE_CHECKING

from scenarios.steps import RunResult

if TYPE_CHECKING:
    from calibration.evaluation import Evaluation, Trials
    from scenarios.score.score import Score

_RARE = 0.001  # how often intervals that are right fail the test


def assert_improves(  # noqa: PLR0913  a row of the ladder has so many names
    result: "RunResult | Evaluation",
    model: str = "",
    over: str = "nominal",
    *,
    by: float = 0.0,
    trials: "Trials" = "dynamic",
    base: str = "fixed",
    encoder: str = "motor",
) -> None:
    """Fail unless a model's error of the hand's position is less than that of another.

    Args:
        result: A run, or an evaluation.
        model: Its row of the ladder; "": the main model of a run.
        over: The row it must be better than, read with the motor encoders on a base that does not move.
        by: Share of that row's RMSE that must be gone [-].
        trials: Of which trials.
        base: Where the row has the base from: fixed, plate, dynamics, measured.
        encoder: Which encoder the row reads.

    Raises:
        AssertionError: It is not.
        NotEnoughData: There is no such row.
    """
    evaluation = result.evaluation if isinstance(result, RunResult) else result
    name = model or (result.estimate.main if isinstance(result, RunResult) else "")
    found = evaluation.row(name, trials, base, encoder).metrics.position_rmse_norm_mm
    before = evaluation.row(over, trials).metrics.position_rmse_norm_mm
    if not found <= (1.0 - by) * before:
        raise AssertionError(
            f"{name} ({trials}, base {base}, {encoder} encoders): {found:.2f} mm, {over}: {before:.2f} mm; "
            f"{1.0 - found / before:.0%} better, at least {by:.0%} asked"
        )


def assert_covers(result: "RunResult | Score", at_least: float | None = None) -> None:
    """Fail unless 95 % intervals hold the true values.

    Args:
        result: A run, or a score.
        at_least: Share of the judged parameters and combinations that must lie inside; None: what one in a thousand
            sets of right intervals falls short of.

    Raises:
        AssertionError: Too many lie outside, or nothing could be judged.
    """
    from scipy.stats import binom

    score = result.score if isinstance(result, RunResult) else result
    n, inside = score.n_judged, score.n_covered
    least = binom.ppf(_RARE, n, 0.95) if at_least is None else at_least * n
    if n == 0 or inside < least:
        outside = [p.name for p in score.parameters if p.z is not None and abs(p.z) > 2.0]
        worst = f"; outside: {', '.join(outside[:10])}" if outside else ""
        raise AssertionError(f"{inside} of {n} intervals of 95 % hold the truth, at least {least:.0f} asked{worst}")
