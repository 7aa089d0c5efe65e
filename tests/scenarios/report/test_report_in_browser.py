"""The report as a browser shows it: nothing overflows, and the first screen answers the questions."""

import html
import json
import re
import shutil
import subprocess
from functools import cache

import pytest

from calibration.verdict import Verdict
from scenarios.report import write
from tests.doubles.run_folder import SCENARIO, write_dataset, write_estimate, write_evaluation, write_score

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
MEASURE = """
const frame = document.querySelector("iframe"), page = frame.contentDocument, width = page.documentElement.clientWidth;
const low = selector => Math.max(...[...page.querySelectorAll(selector)].map(e => e.getBoundingClientRect().bottom));
const first = {badge: low(".badge"), sentence: low(".sentence"), shares: low(".shares"), next: low(".next"),
  plot: low(".verdict .drawing")};
const shown = c => [c, page.querySelector("." + c).innerText];
const text = Object.fromEntries(["badge", "sentence", "shares", "next li"].map(shown));
const luminance = e => { const c = frame.contentWindow.getComputedStyle(e); return [c.color, c.backgroundColor]; };
const broken = [...page.images].filter(i => !i.naturalWidth).length;
const asked = frame.contentWindow.performance.getEntriesByType("resource").map(e => e.name);
const outside = asked.filter(n => !n.startsWith("data:"));
page.querySelectorAll("details").forEach(d => d.open = true);
const inside = e => e.closest("svg, .scroll, .drawing, pre");
const wide = e => e.getBoundingClientRect().right > width + 1;
const over = [...page.querySelectorAll("body *")].filter(e => !inside(e) && wide(e));
const cut = [...page.querySelectorAll(".scroll")].filter(e => e.scrollWidth > e.clientWidth + 1);
const numbers = [...page.querySelectorAll('[aria-label^="Ladder"] td:not(.text):nth-of-type(4)')];
const hidden = numbers.filter(e => e.getBoundingClientRect().right > width).length;
document.title = JSON.stringify({width, numbers: numbers.length, hidden, first, text,
  page: page.documentElement.scrollWidth, broken, outside,
  body: luminance(page.body), over: over.map(e => e.outerHTML.slice(0, 80)), cut: cut.map(e => e.ariaLabel)});
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed"),
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write_evaluation(folder)
    write_score(folder)
    write_dataset(folder / "dataset")
    write_estimate(folder / "estimate", Verdict("geometry", "warning", "arm_3 never moved"))
    (folder / "scenario.yaml").write_text(SCENARIO)
    write(folder)
    return folder


@cache
def measured(run, width, scheme="light"):
    """What a browser with a window so wide makes of the page."""
    outer = run / f"outer_{width}.html"
    frame = f'<iframe src="report.html" style="width:{width}px;height:900px;border:0"></iframe>'
    outer.write_text(f"<body>{frame}<script>onload = () => {{{MEASURE}}}</script></body>")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--dump-dom"]
    dark = ["--blink-settings=preferredColorScheme=0"] if scheme == "dark" else []
    options = ["--allow-file-access-from-files", "--window-size=1600,1000", *dark, outer.as_uri()]
    done = subprocess.run([*command, *options], capture_output=True, text=True, timeout=120)
    return json.loads(html.unescape(re.search(r"<title>(.*?)</title>", done.stdout)[1]))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_overflows_is_broken_or_comes_from_elsewhere(run, width, scheme):
    found = measured(run, width, scheme)
    assert (found["width"], found["page"], found["over"]) == (width, width, [])
    assert (found["broken"], found["outside"]) == (0, [])


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_is_dark_on_light_or_light_on_dark(run, scheme):
    text, paper = (
        sum(map(int, re.findall(r"\d+", colour)[:3])) / 765 for colour in measured(run, 1280, scheme)["body"]
    )
    assert (text > 0.8 and paper < 0.2) if scheme == "dark" else (text < 0.2 and paper > 0.8)


@pytest.mark.parametrize("width", [390, 1280])
def test_no_table_is_cut(run, width):
    assert measured(run, width)["cut"] == []


def test_errors_of_all_rows_are_seen_on_a_phone_without_scrolling(run):
    found = measured(run, 390)
    assert found["numbers"] > 10 and found["hidden"] == 0


def test_the_first_screen_answers(run):
    found = measured(run, 1280)["first"]
    assert {name: bottom < 900 for name, bottom in found.items()} == dict.fromkeys(found, True)


def test_it_says_whether_how_well_of_what_and_what_next(run):
    text = measured(run, 1280)["text"]
    assert text["badge"] in ("calibrated", "not calibrated")
    assert re.search(r"unseen .*: [\d.]+\smm per component", text["sentence"])
    assert re.search(r"base [\d.]+\smm|joints.* [\d.]+\smm", text["shares"])
    assert re.search(r"−[\d.]+\smm ", text["next li"])
