"""Plots say what they show: labels with units, and an artist for every datum."""

import numpy as np
import pytest

from scenarios.plots import (
    ESTIMATE,
    MISSED,
    TRUTH,
    Interval,
    Line,
    Sample,
    drawing,
    error_boxes,
    error_traces,
    figure,
    intervals,
    svg,
    z_histogram,
)
from scenarios.plots.trace import thinned


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
    dots = [line.get_xdata()[0] for line in ax.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(dots, [np.sqrt((values**2).mean()), 0.1 * np.sqrt((values**2).mean())])
    (floor,) = (line for line in ax.lines if line.get_color() == TRUTH)
    np.testing.assert_allclose(floor.get_xdata(), 0.5)


def test_traces_have_a_line_a_row_and_a_zero(ax):
    t = np.linspace(0.0, 1.0, 50)
    lines = [Line("nominal", t, np.sin(t), "grey"), Line("model_2", t, np.cos(t), ESTIMATE)]
    assert error_traces(lines, "error along x [mm]", ax) is ax
    assert ax.get_ylabel() == "error along x [mm]"
    assert [line.get_label() for line in ax.lines][1:] == ["nominal", "model_2"]


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


def test_intervals_that_miss_the_truth_are_told_apart(ax):
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
