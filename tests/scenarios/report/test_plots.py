"""Plots say what they show: labels with units, and an artist for every datum."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.plots.boxes import Sample, error_boxes
from scenarios.plots.forest import Interval, intervals
from scenarios.plots.histogram import z_histogram
from scenarios.plots.hysteresis import BACK, FORTH, Flank, hysteresis, strokes
from scenarios.plots.slipping_base import Banded, banded, friction_use, loop
from scenarios.plots.style import ESTIMATE, MISSED, TRUTH, drawing, figure, svg
from scenarios.plots.trace import Line, error_traces, measured_beside, thinned

ROOT = Path(__file__).parents[3]


@pytest.fixture
def ax():
    with drawing():
        yield figure(4.0, 3.0).subplots()


def names(ax):
    return [label.get_text() for label in ax.get_yticklabels()]


def test_boxes_show_quartiles_median_and_root_mean_square_of_each_row(ax):
    values = np.arange(101.0)
    samples = [
        Sample("nominal, fixed", values, "grey"),
        Sample("model_2, measured", 0.1 * values, ESTIMATE, hollow=True),
    ]
    assert error_boxes(samples, "|error along x| [mm]", 0.5, ax) is ax
    assert names(ax) == ["nominal, fixed", "model_2, measured"]
    assert ax.get_xlabel() == "|error along x| [mm]"
    assert ax.yaxis_inverted(), "the first row is on top"
    boxes = [(p.get_x(), p.get_width()) for p in ax.patches]
    np.testing.assert_allclose(boxes, [(25.0, 50.0), (2.5, 5.0)])
    (dots,) = (line.get_xdata() for line in ax.lines if line.get_marker() == "o")
    np.testing.assert_allclose(dots, [np.sqrt((values**2).mean()), 0.1 * np.sqrt((values**2).mean())])
    (floor,) = (line for line in ax.lines if line.get_color() == TRUTH)
    np.testing.assert_allclose(floor.get_xdata(), 0.5)
    assert ax.get_xscale() == "log"
    low, high = ax.get_xlim()
    assert low < 0.5, "the floor is in sight"
    assert high > 95.0


def test_traces_have_a_line_a_row_and_a_zero(ax):
    t = np.linspace(0.0, 1.0, 50)
    lines = [Line("nominal", t, np.sin(t), "grey"), Line("model_2", t, np.cos(t), ESTIMATE)]
    assert error_traces(lines, "error along x [mm]", ax) is ax
    assert ax.get_ylabel() == "error along x [mm]"
    assert [line.get_label() for line in ax.lines][1:] == ["nominal", "model_2"]


def test_what_is_measured_is_dots_with_its_extremes_and_what_predicts_it_is_lines(ax):
    t = np.arange(5000.0)
    values = np.sin(0.01 * t)
    values[1234] = 9.0
    measured_beside(Line("measured", t, values, "black"), [Line("predicted", t, 0.0 * t, ESTIMATE)], "yaw [mrad]", ax)
    dots, line = ax.lines
    assert (dots.get_linestyle(), dots.get_marker(), line.get_linestyle()) == ("None", "o", "-")
    assert dots.get_ydata().max() == 9.0
    assert np.all(values[dots.get_xdata().astype(int)] == dots.get_ydata())
    assert len(dots.get_xdata()) < 500
    assert ax.get_ylabel() == "yaw [mrad]"


def test_both_directions_of_a_joint_have_dots_and_the_model_its_lines(ax):
    t = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    up = Flank("growing", FORTH, t, t, t + 1.0, t + 2.0)
    hysteresis((up, Flank("falling", BACK, t, t, t - 1.0, None)), ax)
    assert {line.get_label(): line.get_color() for line in ax.lines} == {
        "measured, growing": FORTH,
        "measured, falling": BACK,
        "model, growing": FORTH,
    }
    model = next(line for line in ax.lines if line.get_label().startswith("model"))
    np.testing.assert_array_equal(model.get_ydata(), [2.0, 2.1, 2.2, np.nan, 3.0, 3.1])


def test_a_line_ends_where_time_jumps_or_starts_again():
    t, x = np.array([0.0, 0.1, 0.5, 0.6, 0.0]), np.arange(5.0)
    np.testing.assert_array_equal(strokes(t, x)[0], [0.0, 1.0, np.nan, 2.0, 3.0, np.nan, 4.0])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("joint_chain", ("backlash.", "gear.&lt;joint&gt;.", "encoder.&lt;joint&gt;.motor.", "q_link")),
        ("frame_chain", ("frame.base.base", "frame.base.arm", "frame.tool.hand", "base_footprint")),
        ("wheeled_base", ("suspension.&lt;wheel&gt;.", "contact.&lt;wheel&gt;.", "base_footprint", "wrench")),
    ],
)
def test_diagrams_name_the_parameters(name, words):
    text = (ROOT / f"scenarios/report/{name}.svg").read_text(encoding="utf-8")
    assert [word for word in words if word not in text] == []


def test_thinning_keeps_every_extreme_and_the_gaps():
    rng = np.random.default_rng(0)
    t, values = np.arange(10_000.0), rng.normal(size=10_000)
    values[4321], values[6000:6200] = 50.0, np.nan
    kept_t, kept = thinned(t, values, 100)
    assert len(kept) <= 202
    assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(values), 50.0)
    assert np.isnan(kept).any()
    assert np.all(np.diff(kept_t) > 0)
    assert (kept_t[0], kept_t[-1]) == (0.0, 9999.0)
    np.testing.assert_array_equal(thinned(t[:150], values[:150], 100)[0], t[:150])


def test_intervals_that_miss_the_truth_are_distinguished(ax):
    found = [Interval("arm_1 rx", 0.1, 1.0), Interval("arm_2 offset  + 2", 3.0, 1.0)]
    assert [i.covers for i in found] == [True, False]
    assert intervals(found, "estimate − truth [mrad]", True, ax) is ax
    assert names(ax) == ["arm_1 rx", "arm_2 offset  + 2"]
    assert ax.get_xlabel() == "estimate − truth [mrad]"
    assert [line.get_color() for line in ax.lines] == [TRUTH, ESTIMATE, MISSED]


def test_without_a_truth_no_interval_misses(ax):
    intervals([Interval("arm_1 rx", 9.0, 1.0)], "estimate − nominal [mrad]", False, ax)
    assert ax.lines[-1].get_color() == ESTIMATE


def test_the_histogram_counts_all(ax):
    z = np.array([-9.0, -0.2, 0.1, 0.3, 7.0])
    assert z_histogram(z, ax) is ax
    heights = [p.get_height() for p in ax.patches]
    assert sum(heights) == len(z)
    assert (heights[0], heights[-1]) == (1, 1)
    assert ax.get_xlabel() == "(estimate − truth) / sigma [-]"


def test_svg_is_the_same_every_time_has_its_own_ids_and_no_reference_outside():
    def draw(name):
        with drawing():
            drawn = figure(3.0, 2.0)
            drawn.subplots().plot([0, 1], [1, 0])
        return svg(drawn, name)

    text = draw("errors")
    assert text == draw("errors")
    assert 'id="errors-' in text
    assert 'id="figure_1"' not in text
    assert "<metadata" not in text
    assert "<text" in text, "text is text"
    assert 'href="http' not in text


def test_the_frames_in_the_documents_are_those_of_the_report():
    documented, reported = ROOT / "docs/frames.svg", ROOT / "scenarios/report/frame_chain.svg"
    assert documented.read_bytes() == reported.read_bytes()


def test_a_slipping_base_is_shown_with_band_loop_and_friction(ax):
    t = np.linspace(0.0, 9.0, 500)
    axis = Banded(t, np.sin(t), 0.9 * np.sin(t), np.full(500, 0.1))
    assert banded(axis, "yaw [mrad]", ax) is ax
    (band,) = ax.patches
    np.testing.assert_allclose(band.get_xy()[0], [0.0, -0.196])
    assert ax.get_ylabel() == "yaw [mrad]"
    assert {line.get_label() for line in ax.lines} == {"measured", "predicted"}
    ax.clear()
    loop(5.0 * np.sin(t), axis, ax)
    np.testing.assert_allclose([ax.lines[1].get_xdata(), ax.lines[1].get_ydata()], [5.0 * np.sin(t), 0.9 * np.sin(t)])
    ax.clear()
    friction_use(t, np.outer(t / 9.0, [1.0, 0.5]), ("left", "right"), ax)
    assert names(ax) == ["left", "right"]
    assert ax.images[0].get_array().shape == (2, 500)
    assert ax.images[0].get_array().max() == 1.0
