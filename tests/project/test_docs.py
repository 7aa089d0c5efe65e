"""What the documents say can be done can be done."""

import json
import re
import tomllib
from pathlib import Path
from textwrap import dedent

import pytest
from ruamel.yaml import YAML

from scenarios.commands.main import app
from tests.acceptance import claims
from tests.bench import bench_page, joints_page, peer_page
from tests.hostile import page as hostile_page

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FOUND = (path for pattern in ("*.md", "docs/**/*.md", "mjcf/*.md") for path in ROOT.glob(pattern))
PAGES = sorted(path.relative_to(ROOT).as_posix() for path in FOUND)


def blocks(text: str, language: str) -> list[str]:
    """Code blocks of a language."""
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def targets() -> set[str]:
    """Targets of the Makefile."""
    return set(re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))


def commands() -> set[str]:
    """Commands of tiago-twin."""
    return {str(command.name or command.callback.__name__) for command in app.registered_commands if command.callback}


def test_every_make_target_that_is_written_down_exists():
    written = set(re.findall(r"(?:^|`)make ([a-z-]+)", README, re.MULTILINE))
    assert {"demo", "test", "check", "slow"} <= written <= targets()


def test_make_help_names_every_target():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert set(re.findall(r'@echo "make ([a-z-]+)', makefile)) == targets() - {"help"}


def test_every_command_that_is_written_down_exists_and_the_other_way_round():
    table = set(re.findall(r"^\| `([a-z]+)[ `]", (ROOT / "docs/commands.md").read_text(encoding="utf-8"), re.MULTILINE))
    assert table & commands() == commands()
    used = {
        line.split("tiago-twin ")[1].split()[0]
        for line in "".join(blocks(README, "bash")).splitlines()
        if "-twin " in line
    }
    assert used - {"--help"} <= commands()


@pytest.mark.parametrize("name", PAGES)
def test_python_in_the_documents_compiles(name):
    for block in blocks((ROOT / name).read_text(encoding="utf-8"), "python"):
        compile(dedent(block), name, "exec")


@pytest.mark.parametrize("name", PAGES)
def test_links_within_the_project_lead_somewhere(name):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (ROOT / name).read_text(encoding="utf-8")):
        assert (ROOT / name).parent.joinpath(link).exists(), link


def test_figures_in_prose_are_those_of_the_kept_results(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import evidence

    for page, pattern, phrase in evidence.prose():
        assert set(re.findall(pattern, page.read_text(encoding="utf-8"))) == {phrase}, f"{page.name}: run make pictures"


def test_generated_pages_show_the_kept_results(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import evidence

    results = ROOT / "docs/results"
    kept = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in results.glob("*.json")}
    pages = dict(claims.pages(kept["claims"]))
    pages[results / "base.md"] = evidence.base_page(kept["runs"])
    pages[results / "ladder.md"] = evidence.ladder(kept["runs"][evidence.DEFAULT])
    makers = bench_page, joints_page, peer_page, hostile_page
    pages |= {maker.PAGE: maker.page(kept[maker.KEPT.stem]) for maker in makers}
    assert {*pages} >= {*results.glob("*.md")} - {results / "README.md"}
    for page, text in pages.items():
        assert page.read_text(encoding="utf-8") == text, f"{page.name} is not of its results"


def test_every_page_of_results_is_listed_with_what_makes_it():
    table = (ROOT / "docs/results/README.md").read_text(encoding="utf-8")
    pages = {path.name for path in ROOT.glob("docs/results/*.md")} - {"README.md"}
    assert pages == set(re.findall(r"\(([a-z_0-9]+\.md)\)", table))


def test_decisions_and_changelog_stay_short():
    records = [*ROOT.glob("docs/decisions/*.md"), ROOT / "CHANGELOG.md"]
    assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in records) <= 500


def test_requirements_are_exact_pins_without_a_host():
    lines = (ROOT / "requirements.txt").read_text(encoding="utf-8").splitlines()
    assert [
        line
        for line in lines
        if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+(; python_version < \"3\.\d+\")?", line)
    ] == []


def test_the_citation_names_this_version_and_the_three_sources():
    citation = YAML(typ="safe", pure=True).load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (citation["version"], citation["license"]) == (project["version"], project["license"])
    assert [reference["year"] for reference in citation["references"]] == [2024, 2022, 2023]
