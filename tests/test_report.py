"""The report: one file that says what a run found, from saved results, whatever of them there is."""

import base64
import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from calibration import Estimate, Evaluation, save_estimate
from calibration.clock import Clock
from calibration.errors import InputError
from calibration.estimate import Model, Parameter
from calibration.evaluate import Trace, ladder
from calibration.identifiability import Combination
from calibration.metrics import PoseErrors
from calibration.recording import Trial, write_trial
from calibration.schema import Description
from calibration.verdict import Verdict
from scenarios import cli
from scenarios.errors import ScenarioError
from scenarios.report import figures, write
from scenarios.report.ladder import Step, headline_model
from scenarios.report.ladder import ladder as ordered
from scenarios.report.numbers import cell, count, decimals, error, fixed, readable, significant
from scenarios.report.results import read

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
SCENARIO = """name: small
description: A small <example>
seed: 7
twin: {gap: 0.01}
versions: {python: 3.11.7, mujoco: 4.0.0}
"""
URDF = """<robot name="two"><link name="base"/><link name="hand"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""
MODELS = {"registration": 12.0, "model_2": 3.0, "nominal": 13.0, "gauss": 5.0}
VOID = {"meta", "img", "br", "link", "hr", "col", "input"}


def errors(scale_mm, n, seed):
    rng = np.random.default_rng(seed)
    return PoseErrors(1e-3 * scale_mm * rng.normal(size=(n, 3)), 2e-3 * scale_mm * rng.normal(size=(n, 3)))


def traces(models=MODELS, bases=("measured", "fixed")):
    for model, scale in models.items():
        for base in bases:
            for trial, kind, n in (("xyz", "swing", 300), ("others", "static", 9)):
                found = errors(scale if base == "fixed" else 0.7 * scale, n, len(model))
                yield Trace(model, base, "motor", trial, kind, 0.01 * np.arange(n), found, found)


def write_evaluation(run, **options):
    found = list(traces(**options))
    Evaluation(tuple(ladder(found, "mocap")), tuple(found)).save(run)


def write_score(run):
    rows = json.loads((run / "evaluation.json").read_text())["rows"]
    rows = [row | {"against": "truth", "skill": 0.8} for row in rows]
    rows.append(rows[0] | {"model": "floor", "base": "measured", "encoder": "link", "skill": 1.0})
    rng = np.random.default_rng(1)
    judged = {"sigma": 1e-3, "truth": 2e-3, "unit": "rad"}
    z = rng.normal(size=30)
    parameters = [
        judged | {"name": f"geometry.arm_{i}_joint.rx", "estimate": 2e-3 + 1e-3 * x, "z": x, "status": "estimated"}
        for i, x in enumerate(z)
    ]
    parameters.append({"name": "link.arm_1_link.mass", "unit": "-", "truth": 0.1, "status": "not_estimated"})
    combination = judged | {"name": "encoder.turn.motor.offset", "estimate": 9e-3, "z": 7.0, "status": "combined"}
    score = {
        "schema": 1,
        "parameters": parameters,
        "combinations": [combination],
        "nees": 31.5,
        "dof": 31,
        "rows": rows,
    }
    (run / "score.json").write_text(json.dumps(score))


def write_dataset(folder):
    (folder / "trials").mkdir(parents=True)
    n = 200
    t = 0.01 * np.arange(n)
    q = np.zeros((n, 1))
    trial = Trial(
        id="xyz",
        joint=("turn",),
        t_robot=t,
        q_motor=q,
        q_link=q,
        v_motor=q,
        effort=q,
        q_command=q,
        marker=("m1",),
        marker_body=("gripper",),
        t_mocap=t,
        marker_position=np.zeros((n, 1, 3)),
    )
    sha256 = write_trial(folder / "trials/xyz.nc", trial)
    tolerances = (
        "joint_translation joint_rotation encoder_offset joint_play body_translation body_rotation link_mass link_com"
    )
    description = Description(
        robot="two",
        base_frame="base",
        tool_frame="hand",
        joints=[{"name": "turn", "encoders": ["motor", "link"], "rate": 100.0}],
        bodies=[{"name": "gripper", "link": "hand", "markers": [{"name": "m1", "xyz": (0.0, 0.0, 0.0)}]}],
        payload={"link": "hand", "mass": 0.437, "com": (0.0, 0.0, 0.0), "tolerance": 0.02},
        sigmas={"marker": 1e-4, "encoder": 1e-5, "plate_force": 1.0, "plate_moment": 0.3},
        tolerances=dict.fromkeys(tolerances.split(), 1e-3),
        trials=[
            {"id": "xyz", "role": "validation", "kind": "swing", "motion": "xyz", "file": "trials/xyz.nc"}
            | {"sha256": sha256}
        ],
    )
    (folder / "dataset.json").write_text(description.model_dump_json())
    (folder / "nominal.urdf").write_text(URDF)


def write_estimate(folder, *verdicts):
    parameters = (
        Parameter("encoder.turn.motor.offset", "rad", 0.0, 9e-3, 1e-3, "combined"),
        Parameter("geometry.turn.rz", "rad", 0.0, 1e-3, 1e-3, "combined"),
        Parameter("geometry.turn.x", "m", 0.0, 1e-3, 1e-4, "estimated"),
    )
    combination = Combination("encoder.turn.motor.offset", np.array([1.0, -1.0, 0.0]), 8e-3, 1e-3)
    clock = Clock("robot", 3.9, 1.2e-5, np.diag([1e-6, 1e-12]), 300.0, 5e-4)
    model = Model("model_2", parameters, (combination,), np.diag([1e-6, 1e-6, 1e-8]))
    save_estimate(Estimate("calibrated", verdicts, (clock,), (model,), "model_2"), folder)


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
    for name in ("boxes", "traces", "forest", "z_scores"):
        monkeypatch.setattr(figures, name, lambda *_: None)


class Page(HTMLParser):
    """Checks that tags are balanced; keeps tags, references, ids and text."""

    def __init__(self, path):
        super().__init__()
        self.open, self.tags, self.links, self.ids, self.words = [], [], [], [], []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        assert self.open == []

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.tags.append((tag, found))
        self.links += [v for k, v in attributes if k in ("href", "src", "xlink:href", "data", "action")]
        self.ids += [found["id"]] if "id" in found else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.words.append(data)


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
    write(run)
    write(run)
    assert {path.name: path.read_bytes() for path in (run / "report.html", *(run / "figures").iterdir())} == first
    assert str(run) not in (run / "report.html").read_text()


def test_tables_and_figures_are_numbered_in_their_order(whole):
    text = Page(whole / "report.html").text
    for kind, n in (("Table", 7), ("Figure", 7)):
        assert [int(k) for k in re.findall(rf"{kind} (\d+)\. ", text)] == list(range(1, n + 1))


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
    verdict = text[text.index("Verdict") : text.index("What these figures are")]
    for row in (nominal, ours, rows["registration", "fixed", "dynamic"], rows["model_2", "measured", "dynamic"]):
        assert error(row.position_rmse_component_mm) in verdict
        assert error(row.position_rmse_norm_mm) in verdict
        assert error(row.orientation_rmse_deg) in verdict
    assert "Warning, geometry: arm_3 never moved" in verdict
    assert "synthetic twin" in text
    assert "no bias is removed" in text
    assert "A small <example>" in text, "text is escaped"


def test_the_ladder_has_every_row_in_order_with_its_kind(whole):
    steps = ordered(read(whole), "dynamic")
    models = ["nominal", "nominal", "model_2", "model_2", "registration", "registration", "gauss", "gauss", "floor"]
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
    assert re.search(r"\d+ of 31 intervals of 95 % hold the truth", text)
    assert "−1 geometry.turn.rz" in text, "terms of a combination"
    assert "Not estimated: 1 of link masses." in text
    assert {p.name for p in (whole / "figures").iterdir()} == {
        "errors.svg",
        "joint.svg",
        "parameters.svg",
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
        ("estimate", "What each stage said"),
        ("dataset", "What was recorded"),
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


def test_without_samples_there_are_tables_alone(run):
    (run / "evaluation.nc").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "Distribution of the errors" not in text
    assert "Held-out error of the hand, dynamic trials" in text
    assert not (run / "figures/errors.svg").exists()


def test_real_data_are_not_called_a_twin(run):
    (run / "score.json").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "All figures are of a synthetic twin" not in text
    assert "No truth is known" in text
    assert "Departures from nominal" in text
    assert not (run / "figures/z_scores.svg").exists(), "a figure of an earlier report"


def test_a_calibration_that_does_not_help_is_said_to_be_one(run, plain):
    write_evaluation(run, models={"nominal": 5.0, "registration": 4.0, "model_2": 9.0})
    (run / "score.json").unlink()
    write(run)
    text = Page(run / "report.html").text
    assert "no better than fitting the marker frames alone" in text
    assert "down from" not in text


def test_intervals_that_are_too_narrow_are_told(run, plain):
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
    assert "On held-out static trials" in Page(run / "report.html").text


def test_the_headline_is_the_main_model_where_it_was_evaluated(whole):
    results = read(whole)
    assert headline_model(results, ordered(results, "dynamic")) == "model_2"


@pytest.mark.parametrize(
    ("file", "content", "said"),
    [
        ("evaluation.json", None, "holds no evaluation.json"),
        ("evaluation.json", "{", "broken JSON"),
        ("evaluation.json", '{"rows": [{"model": 3}]}', "rows.0.model"),
        ("score.json", "{}", "rows: Field required"),
        ("scenario.yaml", "a: [", "broken YAML"),
        ("evaluation.nc", "not netCDF", "evaluation.nc"),
    ],
)
def test_what_cannot_be_read_is_named(run, file, content, said):
    before = (run / "report.html").read_bytes()
    (run / file).unlink() if content is None else (run / file).write_text(content)
    with pytest.raises((ScenarioError, InputError), match=re.escape(said)):
        write(run)
    assert (run / "report.html").read_bytes() == before


def test_the_command_writes_the_report(run, plain):
    (run / "report.html").unlink()
    with pytest.raises(SystemExit) as left:
        cli.main(["report", str(run)])
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
