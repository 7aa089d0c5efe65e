"""Four wrong postures among many, drawn many times: named, and what is predicted elsewhere as without them.

    change = | rms error at postures held out, of the fit with wrong ones - of the fit without |

The real robot is predicted at six of its 37 postures, markers as they were measured; matched robots at 200 new ones,
markers as they are.
"""

import re

import numpy as np
import pytest

import mjcf
from calibration.errors import NotCalibrated
from calibration.robot.chain import chain_of_frames
from calibration.stages.geometry.from_arrays import fit_chain
from scenarios.studies.cross_validation import held_out
from tests.calibration.stages.geometry.test_from_arrays import LAB, X
from tests.calibration.stages.geometry.test_montecarlo import BELIEVED, POSTURES, drawn, measured
from tests.doubles import rigid_robot
from tests.doubles.real_postures import KINDS, TWO_DAYS, one_marker, real_rows, spoilt, spoilt_rows, written

DRAWS = 50
WRONG, HELD = 4, 6
CHANGE = 0.1  # [mm] largest believable median
EXPECTED = 1.0  # of the random errors that are expected: 2 mrad a joint, 0.5 mm and 1 mrad of the hand


def named(said) -> list[set[int]]:
    """Numbers of the postures that were left out, by each row that left any out."""
    reported = (v.message for v in said if "contradict the others" in v.message)
    return [set(map(int, re.findall(r"day1 (\d+)", text))) for text in reported]


def real_draw(folder, table, mapping, kind, seed):
    """Changes [mm] of `model_2` and `full`, the wrong rows, and what each row of the ladder named."""
    head, rows = table
    rng = np.random.default_rng([seed, 7])
    order = rng.permutation(len(rows))
    held, rest = np.sort(order[:HELD]), np.sort(order[HELD:])
    wrong = np.sort(rng.choice(len(rest), WRONG, replace=False))
    spoiling = spoilt_rows(rows, rest[wrong], kind, rng)
    after = written(folder / "day2.csv", head, rows[held])

    def found(some, of):
        return held_out((written(folder / "day1.csv", head, of[some]), after), mapping)

    both = found(rest, spoiling), found(np.delete(rest, wrong), rows)
    rms = [{p.model: p.rmse_norm_mm for p in one.points if p.marker == "all"} for one in both]
    return [abs(rms[0][m] - rms[1][m]) for m in ("model_2", "full")], set(wrong.tolist()), named(both[0].verdicts)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seen", ["four markers", "one marker"])
def test_four_wrong_rows_of_a_real_file_are_named_and_change_nothing(tmp_path, seen, kind, claim):
    table, mapping = real_rows(), TWO_DAYS if seen == "four markers" else one_marker(tmp_path)
    change, missed = [], []
    for seed in range(DRAWS):
        try:
            by, wrong, reported = real_draw(tmp_path, table, mapping, kind, seed)
        except NotCalibrated as refused:
            print(f"draw {seed}: {refused}")
            by, wrong, reported = [np.inf, np.inf], set(), []
        change.append(by)
        missed.append(not reported or any(not wrong <= one for one in reported))
    keep(claim, f"real, {seen}, {kind}", change, missed)
    assert (np.median(change, axis=0) <= CHANGE).all()
    # 20 mm of one marker is nine times what `full` leaves, but 31 points are three equations a parameter: a size
    # of the random errors takes a wrong row for its own in some draws.
    assert not any(missed) or (seen, kind) == ("one marker", 0.02)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("m", [4, 1])
def test_four_wrong_postures_of_a_known_robot_are_named_and_change_nothing(m, kind, claim):
    chain = chain_of_frames(mjcf.urdf(), rigid_robot.JOINTS, "base_footprint", "gripper_grasping_frame")
    change, missed = [], []
    for seed in range(DRAWS):
        rng = np.random.default_rng([seed, 37])
        truth, reading, q = drawn(chain, rng)
        seen = measured(truth, q[:POSTURES], rng, EXPECTED)
        true = rigid_robot.positions(LAB @ rigid_robot.hand_in_base(truth, q[POSTURES:]), X[:m])
        wrong = np.sort(rng.choice(POSTURES, WRONG, replace=False))
        rest = np.delete(np.arange(POSTURES), wrong)
        rms, fits = [], []
        for rows, p in ((np.arange(POSTURES), spoilt(seen, wrong, kind, rng)), (rest, seen[rest])):
            fits.append(fit_chain(chain, reading[rows], p[:, :m], BELIEVED))
            rms.append(1e3 * np.sqrt(((fits[-1].predict(reading[POSTURES:]) - true) ** 2).sum(axis=2).mean()))
        change.append([abs(rms[0] - rms[1])])
        missed.append(not set(wrong.tolist()) <= set(fits[0].left_out))
    keep(claim, f"matched, {m} markers, {kind}", change, missed)
    assert (np.median(change, axis=0) <= CHANGE).all()
    assert not any(missed)


def keep(claim, name, change, missed):
    """Changes [mm], the last row's; share of draws in which all four are named."""
    last = np.array(change)[:, -1]
    claim(f"geometry/wrong/change/{name}, median", np.median(last))
    claim(f"geometry/wrong/change/{name}, largest", last.max())
    claim(f"geometry/wrong/named/{name}", 1.0 - np.mean(missed))
