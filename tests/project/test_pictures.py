"""The pictures of the documents were made from the sources as they are: `make pictures`."""

import json
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.slow
def test_pictures_are_of_the_present_sources(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    sys.modules.pop("pictures", None)
    import pictures

    made = json.loads((DOCS / "pictures.json").read_text(encoding="utf-8"))
    changed = [name for name, sha256 in pictures.inputs().items() if made.get(name) != sha256]
    assert not changed, f"run make pictures: {changed}"


def test_pictures_are_small():
    assert (DOCS / "robot.gif").stat().st_size <= 2e6
    assert max(path.stat().st_size for path in DOCS.glob("report*.png")) <= 3e5
