"""Postures left out of a real file in turn: what rows of the ladder predict there."""

import numpy as np
import pytest

from calibration.errors import NotEnoughData
from calibration.evaluation.marker_errors import PointRow
from scenarios.files.errors import ScenarioError
from scenarios.studies.cross_validation import HeldOut, at_random, by_regions, cross_validated, pooled
from tests.doubles.real_postures import ROOT, TABLE, TWO_DAYS, one_marker, real_rows

ROWS = ("registration", "model_2", "full")
GOALS = {"BL": 2.9, "all": 3.6}  # [mm] one and four points, set beforehand for other days of this robot
AFTER = {
    "a sixth at random": {"BL": 2.18, "all": 2.52},
    "a sixth by regions": {"BL": 2.14, "all": 2.59},
    "a third by regions": {"BL": 2.41, "all": 2.88},
}  # [mm] after the bundle

GAUSSIAN = 1.61  # 95 % quantile over rms of the length of a Gaussian error


def parts(kind: str, q: np.ndarray) -> list[np.ndarray]:
    """What is left out, as in docs/results/geometry.md."""
    n, kinds = (
        len(q),
        {
            "a sixth at random": (4, lambda s: at_random(n, 6, np.random.default_rng(s))),
            "a sixth by regions": (3, lambda s: by_regions(q, 6, np.random.default_rng(100 + s))),
            "a third by regions": (4, lambda s: by_regions(q, 3, np.random.default_rng(100 + s))),
        },
    )
    times, divided = kinds[kind]
    return [part for seed in range(times) for part in divided(seed)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["a sixth at random", "a sixth by regions", "a third by regions"])
def test_each_row_predicts_left_out_postures_of_a_real_robot_better_than_the_one_before(kind, claim):
    _, rows = real_rows()
    found = cross_validated(TABLE, TWO_DAYS, parts(kind, rows[:, 12:]))
    for marker, goal in GOALS.items():
        rms = {model: pooled(found, model, marker) for model in ROWS}
        points = "one point" if marker == "BL" else "four points"
        for model, found_mm in rms.items():
            claim(f"geometry/real/error/{kind}, {points}/{model}", found_mm.rmse_norm_mm)
        full = rms["full"]
        claim(f"geometry/real/inside/{kind}, {points}", full.inside)
        claim(f"geometry/real/inside/{kind}, {points}, of any other session", full.other_day_inside)
        assert full.rmse_norm_mm <= rms["model_2"].rmse_norm_mm <= rms["registration"].rmse_norm_mm
        assert full.rmse_norm_mm <= goal
        after = AFTER[kind][marker]
        assert full.rmse_norm_mm <= after + 0.02
        assert 0.92 <= full.inside <= 0.98
        assert full.band_95_mm <= 1.5 * GAUSSIAN * full.rmse_norm_mm


@pytest.mark.slow
def test_one_marker_alone_is_predicted_where_it_was_left_out(tmp_path, claim):
    _, rows = real_rows()
    found = cross_validated(TABLE, one_marker(tmp_path), parts("a sixth at random", rows[:, 12:]))
    rms = [pooled(found, model, "BL").rmse_norm_mm for model in ROWS]
    for model, mm in zip(ROWS, rms, strict=True):
        claim(f"geometry/real/error/a sixth at random, one marker fitted/{model}", mm)
    assert rms[2] <= rms[1] <= rms[0] and rms[2] <= GOALS["BL"]


def test_every_posture_is_left_out_once_and_slices_are_along_a_line():
    q = np.random.default_rng(0).normal(size=(37, 8)) * np.arange(1.0, 9.0)
    for divided in (at_random(37, 6, np.random.default_rng(1)), by_regions(q, 6, np.random.default_rng(1))):
        np.testing.assert_array_equal(np.sort(np.concatenate(divided)), np.arange(37))
        assert {len(part) for part in divided} == {6, 7}
    way = np.random.default_rng(1).normal(size=8) / q.std(axis=0)
    along = [q[part] @ way for part in divided]
    assert all(a.max() <= b.min() for a, b in zip(along[:-1], along[1:], strict=True))


def test_parts_are_pooled_by_their_number_of_postures():
    def one(n: int, rmse: float, inside: float) -> HeldOut:
        return HeldOut((PointRow("day2", "full", "all", n, rmse, 2.0 * rmse, 5.0, inside, 9.0, 1.0),), ())

    found = pooled((one(3, 1.0, 1.0), one(1, 3.0, 0.0)), "full", "all")
    assert (found.n, found.max_norm_mm, found.inside, found.other_day_band_95_mm) == (4, 6.0, 0.75, 9.0)
    assert found.rmse_norm_mm == pytest.approx(np.sqrt(3.0))


def test_a_part_is_predicted_by_the_fit_of_all_others():
    real_rows()
    some = [np.array([3, 30]), np.array([7, 8, 9])]
    found = cross_validated(TABLE, TWO_DAYS, some)
    assert [{(p.model, p.n) for p in one.points if p.marker == "all"} for one in found] == [
        {(model, 4 * len(part)) for model in ROWS} for part in some
    ]
    assert all(
        any("from 35 postures" in v.message or "from 34 postures" in v.message for v in f.verdicts) for f in found
    )
    assert pooled(found, "full", "all").rmse_norm_mm < 6.0


def test_what_was_not_left_out_and_tables_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(NotEnoughData, match="row 'model_3', marker 'all'"):
        pooled((HeldOut((), ()),), "model_3", "all")
    with pytest.raises(ScenarioError, match="no such file"):
        cross_validated(tmp_path / "none.csv", TWO_DAYS, [])


def test_a_mapping_of_one_file_is_refused():
    with pytest.raises(ScenarioError, match="one calibration and one validation needed"):
        cross_validated(TABLE, ROOT / "docs/mappings/qualisys_postures.yaml", [])
