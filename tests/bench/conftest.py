"""What the benchmarks measured: printed, and kept in runs/bench.json beside what earlier ones found."""

import json
import math
import platform
from collections.abc import Callable
from pathlib import Path

import pytest

FILE = Path("runs/bench.json")
Keep = Callable[[dict[str, float]], None]


@pytest.fixture
def keep() -> Keep:
    """Print figures and merge them into runs/bench.json; each must be a number."""

    def kept(figures: dict[str, float]) -> None:
        FILE.parent.mkdir(exist_ok=True)
        before = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        content = before | {"machine": platform.machine(), "python": platform.python_version()} | figures
        FILE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        print()
        for name, value in figures.items():
            print(f"{name:52s} {value:10.3g}")
        assert all(math.isfinite(value) for value in figures.values())

    return kept
