"""Every row of the tables of hostile cases: refused or done, with the words expected, within its bounds."""

import shutil

import numpy as np
import pytest

from tests.hostile.findings import FINDINGS, unshown
from tests.hostile.page import tables
from tests.hostile.rows.case import Case, judged
from tests.hostile.rows.child import forked
from tests.hostile.rows.laboratory import copied, make

ROWS = [
    pytest.param(case, id=f"{group}: {case.name}", marks=[pytest.mark.slow] if case.slow or k % 2 else [])
    for group, cases in tables()
    for k, case in enumerate(cases)
]


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory):
    return make(tmp_path_factory.mktemp("hostile") / "laboratory")


@pytest.mark.parametrize("case", ROWS)
def test_a_hostile_case_ends_as_its_row_says(laboratory, tmp_path, case: Case):
    folder = copied(laboratory, tmp_path / "at")
    found = judged(case, folder)
    shutil.rmtree(folder, ignore_errors=True)
    assert not found.wrong, f"{found.wrong}\n{found.outcome.output[-3000:]}"


def test_the_memory_of_a_command_is_its_own():
    held = np.ones(2**24)
    assert forked(lambda: None).memory < 0.5 * held.nbytes
    assert forked(lambda: print(np.ones(len(held)).sum())).memory > 0.9 * held.nbytes


def test_every_finding_of_use_is_a_row_a_test_or_argued():
    assert not list(unshown(FINDINGS))
