"""The report: one file that says what a run found, from saved results, whatever of them there is."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from calibration import Evaluation
from calibration.errors import InputError
from calibration.evaluation.ladder import ladder
from calibration.verdict import Verdict
from scenarios.commands import main
from scenarios.files.errors import ScenarioError
from scenarios.report import write, write_refusal
from scenarios.report.results import figures
from scenarios.report.results.formatting import cell, count, decimals, error, fixed, readable, significant
from scenarios.report.results.headline import Notice, headline, to_record
from scenarios.report.results.ladder import Step, headline_model
from scenarios.report.results.ladder import ladder as ordered
from scenarios.report.results.run_results import read
from scenarios.report.results.section import run_view
from scenarios.report.sections import SECTIONS
from tests.doubles.html_page import Page
from tests.doubles.run_folder import (
    PIXEL,
    SCENARIO,
    traces,
    write_dataset,
    write_estimate,
    write_evaluation,
    write_score,
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run folder with everything in it."""
    run = tmp_path_factory.mktemp("run")
    write_evaluation(run)
    write_score(run)
    write_dataset(run / "dataset")
    write_estimate(
        run / "estimate", Verdict("clocks", "ok", "fine"), Verdict("geometry", "warning", "arm_3 never moved")
    )
    (run / "scenario.yaml").write_text(SCENARIO)
    (run / "figures").mkdir()
    (run / "figures/twin.png").write_bytes(PIXEL)
    write(run)
    return run


@pytest.fixture
def run(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "run"))


@pytest.fixture
def plain(monkeypatch):
    """Pages without figures are written faster."""
    for name in ("overview", "boxes", "traces", "forest", "z_scores"):
        monkeypatch.setattr(figures, name, lambda *_: None)


def test_the_page_is_one_file_that_refers_to_nothing_else(whole):
    page = Page(whole / "report.html")
    outside = [link for link in page.links if not link.startswith(("#", "data:"))]
    assert outside == ["https://doi.org/10.1109/Humanoids58906.2024.10769790"]
    assert not {"script", "iframe", "link", "object"} & {tag for tag, _ in page.tags}
    assert "@import" not in (whole / "report.html").read_text()
    assert set(re.findall(r"url\(([^)]*)\)", (whole / "report.html").read_text())) <= {f"#{i}" for i in page.ids}
    assert len(page.ids) == len(set(page.ids))
    assert (whole / "report.html").stat().st_size < 2e6


def test_the_same_results_give_the_same_bytes_wherever_they_are(whole, run):
    first = {path.name: path.read_bytes() for path in (whole / "report.html", *(whole / "figures").iterdir())}
    write(run)  # over the copied page and figures
    assert {path.name: path.read_bytes() for path in (run / "report.html", *(run / "figures").iterdir())} == first
    assert str(run) not in (run / "report.html").read_text()


def test_tables_and_figures_are_numbered_in_their_order(whole):
    text = Page(whole / "report.html").text
    for kind in ("Table", "Figure"):
        found = [int(k) for k in re.findall(rf"{kind} (\d+)\. ", text)]
        assert found == list(range(1, len(found) + 1))
        assert len(found) >= 7
    assert "table 0" not in text, "a reference to a table without a caption"


def test_the_page_can_be_read_without_seeing(whole):
    page = Page(whole / "report.html")
    assert dict(page.tags)["html"]["lang"] == "en"
    assert all(found.get("alt") for tag, found in page.tags if tag == "img")
    assert all(found.get("aria-label") for _, found in page.tags if found.get("role") in ("img", "region"))
    assert all("scope" in found for tag, found in page.tags if tag == "th")


def test_the_verdict_comes_first_with_the_figures_of_the_rows(whole):
    text = Page(whole / "report.html").text
    rows = {(r.model, r.base, r.trials): r for r in read(whole).evaluation.rows}
    nominal, ours = (rows[model, "fixed", "dynamic"] for model in ("nominal", "model_2"))
    verdict = text[text.index("calibrated") : text.index("of the stages, and what")]
    assert error(nominal.position_rmse_component_mm) in verdict
    for digits in (ours.position_rmse_component_mm, ours.position_rmse_norm_mm, ours.orientation_rmse_deg):
        assert error(digits) in verdict
    assert "motion of the base" in verdict, "what the error consists of"
    findings = text[text.index("of the stages, and what") : text.index("Each row predicts")]
    for row in (rows["registration", "fixed", "dynamic"], rows["model_2", "measured", "dynamic"]):
        assert error(row.position_rmse_component_mm) in findings
    assert "Warning, geometry: arm_3 never moved" in findings
    assert "simulated robot" in text
    assert "no bias is removed" in text
    assert "A small <example>" in text, "text is escaped"


def test_the_shares_of_the_error_add_up_in_squares(whole):
    view = run_view(read(whole))
    found = headline(view.results, view.steps)
    total = sum(share.size**2 for share in found.shares) ** 0.5
    np.testing.assert_allclose(total, view.headline.main.position_rmse_component_mm)


def test_next_steps_are_ranked_by_what_they_gain(whole):
    view = run_view(read(whole))
    first = headline(view.results, view.steps).next_steps[0]
    best = min(s.main.position_rmse_component_mm for s in view.steps if s.kind == "oracle: base")
    np.testing.assert_allclose(first.gain, view.headline.main.position_rmse_component_mm - best)
    assert "measure the base" in first.text


def test_without_gains_stages_without_data_say_what_to_record():
    ask = [Notice("missing", s, f"no {s}: {why}") for s, why in (("clocks", "no time"), ("joints", "x; record both"))]
    assert [step.text for step in to_record(ask)] == ["for joints: record both"]


def test_a_fit_of_postures_says_its_error_and_what_to_record(tmp_path):
    error = "full: hand error at left-out postures 2 mm rms (95 % interval 1 to 3), model_2 4 mm; 37 postures"
    next_ = "to record next: twice as many postures would leave 1 mm"
    missing = Verdict("joints", "missing", "no joints: x; record link readings")
    write_estimate(tmp_path, Verdict("geometry", "ok", error), Verdict("geometry", "ok", next_), missing)
    write(tmp_path)
    shown = Page(tmp_path / "report.html").text
    for text in (
        "(95 % interval 1 to 3).",
        "Beside it: model_2 4 mm",
        "leave 1 mm.",
        "for joints: record link readings.",
    ):
        assert text in shown


def test_sections_are_numbered_and_named_by_the_page_alone(whole):
    view = run_view(read(whole))
    names = [name for section in SECTIONS for name in section(view).figures()]
    assert len(names) == len(set(names))
    page = Page(whole / "report.html")
    shown = [section for section in SECTIONS if section.title and section(view).context() is not None]
    links = [link for link in page.links if link.startswith("#") and link[1:] in page.ids]
    assert {f"#{section.template.removesuffix('.html')}" for section in shown} <= set(links)


def test_the_ladder_has_every_row_in_order_with_its_kind(whole):
    steps = ordered(read(whole), "dynamic")
    models = ["nominal", "nominal", "registration", "registration", "model_2", "model_2", "gauss", "gauss", "floor"]
    assert [s.model for s in steps] == models
    assert [s.base for s in steps][:4] == ["fixed", "measured", "fixed", "measured"]
    assert [s.kind for s in steps][:2] == ["predictive", "oracle: base"]
    assert Step("m", "measured", "link", "dynamic", None, None).kind == "oracle: base and encoder"
    assert steps[-1].kind == "floor"
    text = Page(whole / "report.html").text
    for step in steps:
        for row in filter(None, (step.mocap, step.truth)):
            assert cell(row.position_p95_norm_mm) in text


def test_parameters_stand_beside_their_truth_with_what_was_left_out(whole):
    text = Page(whole / "report.html").text
    assert re.search(r"\d+ of 31 intervals of 95 % contain the truth", text)
    assert "−1 geometry.turn.rz" in text, "terms of a combination"
    assert "Not estimated: 1 of link masses." in text
    assert {p.name for p in (whole / "figures").iterdir()} == {
        "errors.svg",
        "headline.svg",
        "joint.svg",
        "parameters.svg",
        "residuals.svg",
        "traces.svg",
        "twin.png",
        "wheels.svg",
        "z_scores.svg",
    }


def test_the_page_says_what_was_recorded_and_how_to_make_it_again(whole):
    text = Page(whole / "report.html").text
    assert "xyz validation swing 2.0" in text
    assert "0.437 kg on hand" in text
    assert "robot 3.9000 1.00 12.0 1.0 0.50" in text, "the clock with its standard deviations"
    assert "tiago-twin run scenario.yaml" in text
    assert "mujoco 4.0.0" in text
    assert re.search(r"sha256 [0-9a-f]{64}", text)


@pytest.mark.parametrize(
    ("missing", "gone"),
    [
        ("score.json", "against the truth"),
        ("figures", "The twin, seed"),
        ("estimate", "Messages of the stages"),
        ("dataset", "sigma 0.100 mm per axis"),
        ("scenario.yaml", "seed 7"),
    ],
)
def test_what_is_missing_is_left_out(run, plain, missing, gone):
    assert gone in Page(run / "report.html").text
    shutil.rmtree(run / missing) if (run / missing).is_dir() else (run / missing).unlink()
    write(run)
    text = Page(run / "report.html").text
    assert gone not in text
    assert "Held-out error of the hand, dynamic trials" in text


def test_without_samples_there_are_tables_alone(run, undrawn):
    (run / "evaluation.nc").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "Distribution of the errors" not in text
    assert "Held-out error of the hand, dynamic trials" in text
    assert not (run / "figures/errors.svg").exists()


def test_real_data_are_not_called_a_twin(run, undrawn):
    (run / "score.json").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "simulated robot" not in text
    assert "No truth is known" in text
    assert "Departures from nominal" in text
    assert not (run / "figures/z_scores.svg").exists(), "a figure of an earlier report"


def test_a_calibration_that_does_not_help_is_said_to_be_one(run, plain):
    write_evaluation(run, models={"nominal": 5.0, "registration": 4.0, "model_2": 9.0})
    (run / "score.json").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "no better than fitting the marker frames alone" in text
    assert "not calibrated" in text


def test_intervals_that_are_too_narrow_are_reported(run, plain):
    score = json.loads((run / "score.json").read_text())
    for parameter in score["parameters"][:20]:
        parameter["estimate"] += 0.1
    (run / "score.json").write_text(json.dumps(score))
    write(run)
    assert "Warning, uncertainty: the 95 % intervals are too narrow" in Page(run / "report.html").text


def test_what_the_evaluation_says_of_its_trials_comes_first(run, plain):
    content = json.loads((run / "evaluation.json").read_text())
    content["verdicts"] = [{"stage": "evaluation", "verdict": "warning", "message": "base moved during xyz"}]
    (run / "evaluation.json").write_text(json.dumps(content))
    write(run)
    assert "Warning, evaluation: base moved during xyz" in Page(run / "report.html").text


def test_static_trials_alone_are_enough(run, plain):
    found = [t for t in traces() if t.kind == "static"]
    Evaluation(tuple(ladder(found, "mocap")), tuple(found)).save(run)
    (run / "score.json").unlink()
    write(run)
    assert "Error of the hand on unseen static trials" in Page(run / "report.html").text


def test_the_headline_is_the_main_model_where_it_was_evaluated(whole):
    results = read(whole)
    assert headline_model(results, ordered(results, "dynamic")) == "model_2"


@pytest.mark.parametrize(
    ("file", "content", "said"),
    [
        ("evaluation.json", "{", "broken JSON"),
        ("evaluation.json", '{"rows": [{"model": 3}]}', "rows.0.model"),
        ("score.json", "{}", "rows: Field required"),
        ("scenario.yaml", "a: [", "not YAML"),
        ("evaluation.nc", "not netCDF", "evaluation.nc"),
    ],
)
def test_what_cannot_be_read_is_named(run, file, content, said):
    before = (run / "report.html").read_bytes()
    (run / file).write_text(content)
    with pytest.raises((ScenarioError, InputError), match=re.escape(said)):
        write(run)
    assert (run / "report.html").read_bytes() == before


def test_neither_evaluation_nor_estimate_is_named(run):
    (run / "evaluation.json").unlink()
    (run / "estimate" / "estimate.json").unlink()
    with pytest.raises(ScenarioError, match=r"contains no evaluation\.json"):
        write(run)


def test_the_command_writes_the_report(run, plain):
    (run / "report.html").unlink()
    with pytest.raises(SystemExit) as left:
        main.main(["report", str(run)])
    assert left.value.code == 0
    assert (run / "report.html").is_file()


def test_numbers_have_the_digits_that_mean_something():
    assert (significant(12.345), significant(0.001234), significant(1234567.0)) == ("12.3", "0.00123", "1.23e6")
    assert (significant(9.999), significant(-0.5, 2), significant(0.0), significant(None)) == (
        "10.0",
        "−0.50",
        "0",
        "–",
    )
    assert (fixed(-1234.5, 1), fixed(float("nan"), 2), count(10398)) == ("−1\u202f234.5", "–", "10\u202f398")
    assert (fixed(-1e-4, 2), fixed(-0.006, 2)) == ("0.00", "−0.01")
    assert (error(23.012), error(3.0549), error(0.957), error(0.0061)) == ("23.0", "3.05", "0.96", "0.01")
    assert (cell(3.0549), cell(0.0061), cell(0.0), cell(None)) == ("3.05", "0.006", "0.00", "–")
    assert [decimals(s) for s in (0.0996, 0.17, 1.04, 26.0, 0.0, None)] == [2, 2, 1, 0, 3, 3]
    assert readable("clock.robot.drift", "-") == (1e6, "ppm")
    assert readable("gear.arm_1_joint.compliance", "rad/(N.m)") == (1.0, "rad/(N.m)")


def test_a_refused_run_has_a_report_that_says_why(run):
    for name in ("evaluation.json", "evaluation.nc", "score.json"):
        (run / name).unlink()
    (run / "refused.txt").write_text("6 postures; record <7> more\n")
    write_refusal(run)
    text = Page(run / "report.html").text
    assert "not calibrated" in text
    assert "6 postures; record <7> more" in text
    assert "Warning, geometry: arm_3 never moved" in text
    assert "xyz validation swing 2.0" in text


def test_nothing_is_written_through_a_link(run, plain, tmp_path):
    (tmp_path / "mine").write_text("mine")
    (run / "report.html.part").symlink_to(tmp_path / "mine")
    write(run)
    assert (tmp_path / "mine").read_text() == "mine"
    assert not [path for path in run.iterdir() if path.name.startswith(".")]


def test_rows_with_the_base_measured_are_shown_where_nothing_is_predictive(tmp_path, undrawn):
    write_evaluation(tmp_path, bases=("measured",))
    write(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "base measured" in page and (tmp_path / "figures" / "headline.svg").is_file()
    assert "measure the base while" not in page
    assert "and the measured base, since nothing was recorded" in " ".join(page.split())
