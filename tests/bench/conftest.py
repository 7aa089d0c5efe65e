"""What the benchmarks measured: printed, and kept as the figures of claims are."""

import math
from collections.abc import Callable

import pytest

from tests.acceptance import claims

Keep = Callable[[dict[str, float]], None]


@pytest.fixture
def keep() -> Keep:
    """Print figures and keep them; each must be a number."""

    def kept(figures: dict[str, float]) -> None:
        print()
        for name, value in figures.items():
            print(f"{name:52s} {value:10.3g}")
            claims.keep("bench/" + name.replace("_", " "), value)
        assert all(math.isfinite(value) for value in figures.values())

    return kept
