"""Pages whose figures are made but not rendered, which takes half of a page's time."""

import pytest

from scenarios.report import page


@pytest.fixture
def undrawn(monkeypatch):
    monkeypatch.setattr(page, "svg", lambda figure, name: f'<svg id="{name}"></svg>\n')
