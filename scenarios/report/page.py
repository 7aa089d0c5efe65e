"""report.html and the figures beside it: the same results give the same bytes, wherever the run folder is."""

import base64
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from scenarios.files.errors import ScenarioError
from scenarios.files.output_folder import one_file
from scenarios.plots.style import svg
from scenarios.report.labels import labelled
from scenarios.report.results import formatting
from scenarios.report.results.run_results import read
from scenarios.report.results.section import Drawn, RunView, Section, run_view
from scenarios.report.sections import SECTIONS, UNEVALUATED

_HERE = Path(__file__).parent
_FILTERS = ("fixed", "significant", "count", "cell", "decimals")


@dataclass(frozen=True)
class Drawing:
    """A figure as the page shows it and as a file of its own."""

    inline: str
    file: str


@dataclass(frozen=True)
class Numbers:
    """Numbers of figures, or of tables, from 1 in the order of their captions.

    Attributes:
        before: Numbers of an earlier pass over the same page, for references to what comes later.
        found: Numbers of this pass.
    """

    before: Mapping[str, int] = field(default_factory=dict)
    found: dict[str, int] = field(default_factory=dict)

    def caption(self, name: str) -> int:
        """The number in the caption of `name`."""
        return self.found.setdefault(name, len(self.found) + 1)

    def of(self, name: str) -> int:
        """The number of `name` where it is referred to."""
        return self.before.get(name, 0)


def write(run_dir: Path | str, progress: Callable[[str, float], None] = lambda section, share: None) -> None:
    """Write RUN/report.html and RUN/figures/*.svg from what is saved in RUN.

    Raises:
        ScenarioError: There is neither evaluation nor estimate, or a file cannot be read.
        InputError: The dataset or the estimate cannot be read.
    """
    run = Path(run_dir)
    view = run_view(read(run))
    sections = [section(view) for section in (SECTIONS if view.steps else UNEVALUATED)]
    drawings: dict[str, Drawing | None] = {}
    for k, one in enumerate(sections):
        progress(one.title, (1 + k) / (2 + len(sections)))
        drawings |= {name: _drawing(name, drawn) for name, drawn in one.figures().items()}
    page = render(view, sections, {name: drawing for name, drawing in drawings.items() if drawing is not None})
    folder = run / "figures"
    if folder.is_symlink():
        raise ScenarioError(f"{folder}: is a link; remove it, pages are not written through links")
    folder.mkdir(exist_ok=True)
    for name, drawing in drawings.items():
        if drawing is not None:
            _write(folder / f"{name}.svg", drawing.file)
        else:
            (folder / f"{name}.svg").unlink(missing_ok=True)
    write_page(run, page)


def render(view: RunView, sections: Iterable[Section], drawings: Mapping[str, Drawing]) -> str:
    """The page: rendered twice, so that a caption's number is known where an earlier section refers to it."""
    templates = environment()
    shown = [(section, values) for section in sections if (values := section.context()) is not None]
    seed = view.results.scenario.seed
    shared = {
        "view": view,
        "results": view.results,
        "drawings": drawings,
        "seeded": "" if seed is None else f", seed {seed}",
        "split": view.steps[0].trials if view.steps else "",
        "n": (view.headline or view.steps[0]).main.n if view.steps else 0,
    }
    figure, table = Numbers(), Numbers()
    for _ in range(2):
        figure, table = Numbers(figure.found), Numbers(table.found)
        numbers = {"figure": figure, "table": table}
        parts = [(s, templates.get_template(s.template).render(**shared, **numbers, **v)) for s, v in shown]
    style = (_HERE / "report.css").read_text(encoding="utf-8")
    return labelled(templates.get_template("page.html").render(**shared, parts=parts, style=style))


@cache
def environment() -> Environment:
    """The templates of the report with our formats of numbers."""
    found = Environment(
        loader=FileSystemLoader([_HERE, _HERE / "sections"]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters |= {name: getattr(formatting, name) for name in _FILTERS}
    found.filters["png"] = lambda data: "data:image/png;base64," + base64.b64encode(data).decode("ascii")
    return found


def write_page(run: Path, page: str) -> None:
    """Write RUN/report.html whole."""
    _write(run / "report.html", page)


def _write(path: Path, text: str) -> None:
    with one_file(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def _drawing(name: str, drawn: Drawn) -> Drawing | None:
    if drawn is None:
        return None
    text = drawn.read_text(encoding="utf-8") if isinstance(drawn, Path) else svg(drawn, name)
    return Drawing(text[text.index("<svg") :].strip(), text)
