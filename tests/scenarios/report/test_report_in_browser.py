"""The report as a browser shows it: nothing overflows, and the first screen answers the questions."""

import html
import json
import re
import shutil
import subprocess

import pytest

from calibration.verdict import Verdict
from scenarios.report import write
from tests.doubles.run_folder import SCENARIO, write_dataset, write_estimate, write_evaluation, write_score

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
MEASURE = """
const frame = document.querySelector("iframe"), page = frame.contentDocument, width = page.documentElement.clientWidth;
const low = selector => Math.max(...[...page.querySelectorAll(selector)].map(e => e.getBoundingClientRect().bottom));
const first = {badge: low(".badge"), sentence: low(".sentence"), next: low(".next"), plot: low(".verdict .drawing")};
page.querySelectorAll("details").forEach(d => d.open = true);
const inside = e => e.closest("svg, .scroll, .drawing, pre");
const wide = e => e.getBoundingClientRect().right > width + 1;
const over = [...page.querySelectorAll("body *")].filter(e => !inside(e) && wide(e));
const cut = [...page.querySelectorAll(".scroll")].filter(e => e.scrollWidth > e.clientWidth + 1);
document.title = JSON.stringify({width, page: page.documentElement.scrollWidth, first,
  over: over.map(e => e.outerHTML.slice(0, 80)), cut: cut.map(e => e.ariaLabel)});
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


def measured(run, width):
    """What a browser with a window so wide makes of the page."""
    outer = run / f"outer_{width}.html"
    frame = f'<iframe src="report.html" style="width:{width}px;height:900px;border:0"></iframe>'
    outer.write_text(f"<body>{frame}<script>onload = () => {{{MEASURE}}}</script></body>")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--dump-dom"]
    options = ["--allow-file-access-from-files", "--window-size=1600,1000", outer.as_uri()]
    done = subprocess.run([*command, *options], capture_output=True, text=True, timeout=120)
    return json.loads(html.unescape(re.search(r"<title>(.*?)</title>", done.stdout)[1]))


@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_overflows(run, width):
    found = measured(run, width)
    assert (found["width"], found["page"], found["over"]) == (width, width, [])


def test_no_table_is_cut_on_a_laptop(run):
    assert measured(run, 1280)["cut"] == []


def test_the_first_screen_answers(run):
    found = measured(run, 1280)["first"]
    assert {name: bottom < 900 for name, bottom in found.items()} == dict.fromkeys(found, True)
