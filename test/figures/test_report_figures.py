"""The figures of a report: for paper, each axis with its unit, and the data that they tell of."""

import numpy as np
import pytest

from valve_friction_ros.figures.report_figures import (
    comparison_figure,
    evidence_figure,
    noise_figures,
    record_figure,
    residual_figure,
    signature_loop_figure,
)
from valve_friction_ros.identification.published.sweep_drawing import chosen_region
from valve_friction_ros.model import Recording

MILLIMETRE = 1 / 25.4
PRINTABLE = 180.0  # mm between the margins of an A4 page


@pytest.fixture(scope="module")
def figures(record, result):
    comparison = result.stem
    return {
        "record": record_figure(record),
        "loop": signature_loop_figure(result),
        "sweep": evidence_figure(result.drawing),
        "comparison": comparison_figure(comparison),
        "residual": residual_figure(comparison),
        **dict(zip(("histogram", "correlation"), noise_figures(comparison), strict=True)),
    }


def lines(axes):
    return [np.asarray(line.get_xydata()).T for line in axes.lines]


@pytest.mark.parametrize("name", ["record", "loop", "sweep", "comparison", "residual"])
def test_every_axis_has_its_unit_and_the_width_fits(figures, name):
    figure = figures[name]
    assert 0.95 * PRINTABLE * MILLIMETRE < figure.get_figwidth() <= 1.01 * PRINTABLE * MILLIMETRE
    assert figure.axes
    for axes in figure.axes:
        assert "[" in axes.get_ylabel() or axes.get_ylabel() == "samples"
        shown = axes.get_subplotspec().is_last_row()
        assert ("[" in axes.get_xlabel()) == shown


@pytest.mark.parametrize("name", ["histogram", "correlation"])
def test_two_of_half_the_width_stand_beside_each_other(figures, name):
    figure = figures[name]
    assert 2 * figure.get_figwidth() < PRINTABLE * MILLIMETRE
    (axes,) = figure.axes
    assert "[" in axes.get_xlabel()


def test_the_loop_of_the_baseline_lies_below_that_of_now(record, result):
    healthy = Recording(0.01, record.pressure * 1.1, record.position)
    (axes,) = signature_loop_figure(result, healthy).axes
    before, now = axes.lines
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["baseline", "now"]
    np.testing.assert_allclose(before.get_xdata(), healthy.pressure / 1e3)
    np.testing.assert_allclose(now.get_xdata(), record.pressure / 1e3)
    assert before.get_color() != now.get_color()


def test_record_and_loop_show_what_was_measured(figures, record):
    pressure, stem = (lines(axes)[0] for axes in figures["record"].axes)
    np.testing.assert_allclose(pressure, [record.time, record.pressure / 1e3])
    np.testing.assert_allclose(stem, [record.time, record.position * 1e3])
    (loop,) = lines(figures["loop"].axes[0])
    np.testing.assert_allclose(loop, [record.pressure / 1e3, record.position * 1e3])


def test_the_sweep_marks_choice_and_region_in_every_panel(figures, result):
    threshold = result.estimate.threshold
    low, high = chosen_region(result.estimate.sweep, threshold)
    assert low <= threshold <= high
    for axes in figures["sweep"].axes:
        spans = [patch.get_extents() for patch in axes.patches]
        edges = [axes.transData.inverted().transform(span)[:, 0] for span in spans]
        assert any(np.allclose(edge, (low, high)) for edge in edges)
        assert any(threshold in np.asarray(line.get_xdata()) for line in axes.lines)


def test_comparison_and_residual_belong_together(figures, result):
    measured, simulated = lines(figures["comparison"].axes[0])
    assert len(figures["comparison"].legends) == 1
    residual = lines(figures["residual"].axes[0])[0]
    np.testing.assert_allclose(residual[1] / 1e3, simulated[1] - measured[1], atol=1e-9)
    assert np.sqrt(np.mean(residual[1] ** 2)) == pytest.approx(result.rms * 1e6)
    correlation = lines(figures["correlation"].axes[0])[0]
    assert correlation[1][0] == 1
