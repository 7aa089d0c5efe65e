import threading

import numpy as np
import pytest

from calibration.numerics.side_by_side import on_cores, side_by_side


def _sum(seed: int, n: int) -> float:
    return float(np.random.default_rng(seed).normal(size=(n, n)).sum())


@pytest.mark.parametrize("cores", [1, 3])
def test_values_and_their_order_are_those_of_one_core(cores):
    sizes = [300, 3, 200, 5, 100]
    with on_cores(cores):
        found = side_by_side(_sum, range(5), sizes)
    assert found == [_sum(k, n) for k, n in enumerate(sizes)]


def test_parts_are_computed_at_the_same_time_only_where_cores_are_allowed():
    meeting = threading.Barrier(2, timeout=5.0)
    with on_cores(2):
        side_by_side(lambda _: meeting.wait(), range(2))
    assert set(side_by_side(lambda _: threading.get_ident(), range(2))) == {threading.get_ident()}


def test_an_error_is_that_of_the_first_part_that_fails():
    def part(k: int) -> None:
        if k > 1:
            raise ValueError(str(k))

    with on_cores(2), pytest.raises(ValueError, match="2"):
        side_by_side(part, range(5))
