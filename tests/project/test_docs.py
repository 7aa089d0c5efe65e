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
MADE = ("docs/claims", "docs/reliability", "docs/results/", "docs/decisions/", "docs/reference/", "CHANGELOG", "mjcf/")
RESULT = r"\b\d+\.\d+ (?:mm|mrad|deg|s|us|MB|GB)\b|\b[\d.]+ times\b|\b[\d.]+ %|\b\d+ of \d+\b|\bR2 of [\d.]+\d"
DEFINED = {  # looks like a result and is a definition, an assumption, a bound or an instruction
    *("95 %", "5 %", "1 %", "7 times", "50 times", "12 of 18", "R2 of 0.95", "40 of 2"),
    *("0.1 mm", "1.35 mm", "0.1 mrad", "2.7 mrad", "0.1 s", "0.15 s", "0.5 s", "0.7 s"),
}


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


def test_no_page_by_hand_states_a_result_that_is_not_compared_with_the_kept_ones(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import evidence

    compared = [(page.resolve(), pattern) for page, pattern, _ in evidence.prose()]
    for name in (page for page in PAGES if not page.startswith(MADE)):
        text = (ROOT / name).read_text(encoding="utf-8")
        for pattern in (pattern for page, pattern in compared if page == ROOT / name):
            text = re.sub(pattern, "", text)
        text = re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)
        assert set(re.findall(RESULT, text)) <= DEFINED, name


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


def test_the_readme_is_short_and_has_three_doors():
    doors = ("**Calibrate your robot**", "**Test your calibration code**", "**Generate datasets**")
    places = [README.index(words) for words in ("## Two commands", "make demo", "`nominal` is", "ladder.svg", *doors)]
    assert len(README.splitlines()) <= 100 and places == sorted(places)


def test_every_page_is_found_from_the_readme_and_packages_come_from_this_folder():
    index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    found = {name for name in PAGES if re.fullmatch(r"docs/[a-z_]+\.md", name)} - {"docs/index.md"}
    assert found == {f"docs/{name}.md" for name in re.findall(r"\]\(([a-z_]+)\.md", index)}
    assert "](docs/README.md)" in README and "](docs/recording.md)" in README
    assert [name for name in PAGES if "install tiago" in (ROOT / name).read_text(encoding="utf-8")] == []


def test_phrases_that_readers_stumbled_over_are_gone():
    stumbled = (
        r"gears that give|play that gravity|told at once|whole or not at all, and|stand side by side|honest baseline|"
        r"data do not carry|none of the campaign's|is one draw|would tell,|rho is not identifiable, they|"
        r"no motion tells|[Rr]oot of all randomness\.\"|Processes of our own|"
        r"value instead of the scenario|tells the cost|zero included|as told in|run forward|would leave [\d.]+ mm of"
    )
    ours = (p for folder in ("scenarios", "calibration", "twin") for p in (ROOT / folder).rglob("*.*"))
    sources = (p for p in ours if p.suffix in (".py", ".html", ".yaml"))
    texts = {str(p): p.read_text(encoding="utf-8") for p in (*map(ROOT.joinpath, PAGES), *sources)}
    assert {name: found for name, text in texts.items() if (found := re.findall(stumbled, text))} == {}


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
