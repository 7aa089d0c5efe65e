"""Rests of readings and markers, and what an import makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from calibration import load
from calibration.errors import InputErrors
from calibration.formats.exporter import export_trials
from calibration.formats.mapping.channels import Recorded
from calibration.formats.mapping.rests import noise_of, offset_between, rests
from scenarios.steps import import_export
from tests.doubles import rigid_robot

T = np.arange(0.0, 20.0, 0.01)


def stepping(moves: list[tuple[float, float]], size: float = 0.3) -> np.ndarray:
    """A position that moves by `size` smoothly over each interval."""
    s = [np.clip((T - a) / (b - a), 0.0, 1.0) for a, b in moves]
    return sum(size * x**2 * (3.0 - 2.0 * x) for x in s)[:, None]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 5e-4])
def test_rests_between_motions_are_found_whatever_the_noise(noise):
    x = stepping([(2.0, 4.0), (6.0, 8.0), (10.0, 12.0)]) + noise * np.random.default_rng(0).normal(size=(len(T), 1))
    found = rests(T, x)
    assert len(found) == 3
    np.testing.assert_allclose(found[:, 0], [4.0, 8.0, 12.0], atol=0.15)
    np.testing.assert_allclose(found[:2, 1], [6.0, 10.0], atol=0.15)


def test_the_rest_a_recording_begins_with_is_not_counted():
    assert len(rests(T[:600], stepping([(3.0, 6.0)])[:600])) == 0


def test_slow_motion_is_no_rest():
    assert len(rests(T, np.stack([0.02 * T, np.sin(T)], axis=1))) == 0


def test_noise_is_that_of_the_samples_and_not_of_the_motion():
    x = np.sin(T)[:, None] + 1e-4 * np.random.default_rng(1).normal(size=(len(T), 3))
    np.testing.assert_allclose(noise_of(x), 1e-4, rtol=0.1)


def test_an_exchanged_label_of_a_body_is_no_motion():
    shape = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    x = shape + stepping([(2.0, 4.0)])[:, None] * [1.0, 0.0, 0.0]  # one axis of three moves
    x[900:1000, [0, 1]] = x[900:1000, [1, 0]]
    assert len(rests(T, x, np.zeros(4, dtype=int))) == 1 and len(rests(T, x)) > 1


def test_clocks_are_distinguished_by_rests_of_all_trials():
    a = [np.array([[4.0, 6.0], [8.0, 10.0], [12.5, 14.0]]), np.array([[31.0, 33.0]])]
    assert offset_between(a, [x - 3.9 for x in a]) == pytest.approx(3.9)
    assert np.isnan(offset_between([np.zeros((0, 2))], [a[0]]))


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A campaign as CSV and its dataset; the mapping states no dwells."""
    folder = tmp_path_factory.mktemp("exported")
    source = load(rigid_robot.campaign(folder / "source", rigid_robot.defects(1), n_postures=14))
    mapping, _ = export_trials("csv", source, folder)
    for file in folder.glob("*.dwells.csv"):
        file.unlink()
    trials = tuple(t.model_copy(update={"dwells": None}) for t in mapping.trials)
    tables = tuple(t for t in mapping.csv if t.dwells is None)
    return folder, source, mapping.model_copy(update={"trials": trials, "csv": tables})


def imported(exported, mapping):
    folder, *_ = exported
    (folder / "lab.yaml").write_text(mapping.model_dump_json())
    files = sorted(folder.glob("*.csv"))
    return import_export.import_files("csv", files, folder / "lab.yaml", folder / "dataset"), load(folder / "dataset")


def test_dwells_nobody_stated_are_found_across_clocks(exported):
    _, source, mapping = exported
    notes, dataset = imported(exported, mapping)
    assert any("postures: 13 rests" in n and "`dwells` overrides them" in n for n in notes), [
        n for n in notes if "rests" in n
    ]
    for (_, found), (_, true) in zip(dataset.trials("calibration"), source.trials("calibration"), strict=True):
        first = 1 if len(true.dwell_start) else 0  # the arm begins in its first posture: no motion leads to it
        np.testing.assert_allclose(found.dwell_start, true.dwell_start[first:], atol=0.15)
        np.testing.assert_allclose(found.dwell_stop, true.dwell_stop[first:], atol=0.15)


def test_stated_dwells_are_taken(exported):
    mapping = exported[2]
    first = mapping.trials[0].model_copy(update={"dwells": ((14.0, 14.8),)})
    _, dataset = imported(exported, mapping.model_copy(update={"trials": (first, *mapping.trials[1:])}))
    trial = next(t for _, t in dataset.trials("calibration", "static"))
    np.testing.assert_array_equal(trial.dwell_start, [14.0])


def test_a_static_trial_without_rest_is_refused_with_what_to_do(exported):
    mapping = exported[2]
    moving = {"kind": "static", "part": (0.0, 9.0)}  # the rest at the end cut off
    sweeps = [t.model_copy(update=moving) if t.kind == "sweep" else t for t in mapping.trials]
    with pytest.raises(InputErrors) as info:
        imported(exported, mapping.model_copy(update={"trials": tuple(sweeps)}))
    said = str(info.value)
    assert all(f"trial sweep{j} is declared static" in said for j in (1, 2, 4)) and "dwells: [[start, stop]" in said


def test_part_of_nothing_rests():
    assert replace(Recorded("x")).timed() is not None and len(rests(T[:5], np.zeros((5, 1)))) == 0
