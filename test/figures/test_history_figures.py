# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The figure of a history: what is drawn where."""

import dataclasses
import warnings
from itertools import pairwise

import matplotlib.dates
import numpy as np
import pytest
from histories import DAY, OTHER, START, VALVE, at_other_speeds, refused, success
from matplotlib.container import ErrorbarContainer

from valve_friction_ros.figures import trend_figure
from valve_friction_ros.figures.history_figures import report_trend_figure, usage_figure
from valve_friction_ros.health import Baseline
from valve_friction_ros.history import (
    MONTH,
    HistoryFile,
    KeptBaseline,
    ValveHistory,
    valve_histories,
)
from valve_friction_ros.identification import Verdict
from valve_friction_ros.usage import BINS, Usage, UsedDay, ValveUsage

BASELINE = Baseline(141.0, 1.0)
WEEKS = 20


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    """Drifting by 3 N a month; every fifth weak, and one refusal."""
    file = HistoryFile(tmp_path_factory.mktemp("history") / "history.sqlite")
    file.set_baseline(VALVE, KeptBaseline(BASELINE, START + 1, START))
    for week in range(WEEKS):
        friction = 150.0 + 3.0 * week * 7 * DAY / MONTH
        verdict = Verdict.WEAK if week % 5 == 0 else Verdict.IDENTIFIED
        entry = success(START + week * 7 * DAY, friction, 2.0, baseline=BASELINE, verdict=verdict)
        file.add(entry)
    file.add(refused(START + DAY, baseline=BASELINE))
    (found,) = valve_histories(file, file.valves(), 0, START + 1000 * DAY)
    return found


@pytest.fixture(scope="module")
def axes(history):
    (axes,) = trend_figure([history]).axes
    return axes


def test_frictions_at_another_speed_are_crosses(tmp_path):
    """The panel was empty while friction grew."""
    file = at_other_speeds(tmp_path / "history.sqlite")
    (found,) = valve_histories(file, file.valves(), 0, START + 1000 * DAY)
    (panel,) = trend_figure([found]).axes
    assert labelled(panel, "at another speed").get_ydata().tolist() == [350.0, 430.0, 550.0]


def labelled(axes, label):
    """Handle of the legend's entry of this name."""
    handles, labels = axes.get_legend_handles_labels()
    return handles[labels.index(label)]


def days(line):
    """Days since the start."""
    dates = matplotlib.dates.date2num(line.get_xdata())
    return dates - START / DAY


def test_the_usage_of_each_day_is_below(history):
    """Days outside the time axis are not drawn; two packings of one day are one bar."""
    first = START // DAY
    one = Usage(1.5, 10, 4, (1, *[0] * (BINS - 1)))
    renewal = (first + 2) * DAY
    days = [UsedDay(first + n, 0, one) for n in (-50, 0, 1, 2)]
    usage = ValveUsage.of([*days, UsedDay(first + 2, renewal, one)], renewal)
    figure = trend_figure([dataclasses.replace(history, usage=usage), history])
    friction, used, _ = figure.axes
    assert used.get_ylabel() == "travel [m/day]"
    assert used.get_xlim() == friction.get_xlim()
    assert [bar.get_height() for bar in used.patches] == [1.5, 1.5, 3.0]
    begins = [bar.get_x() for bar in used.patches]
    assert begins == [first, first + 1, first + 2]
    assert used.lines[0].get_label() == "packing renewed"
    before = dataclasses.replace(history, usage=ValveUsage.of(days[:1]))
    assert len(trend_figure([before]).axes) == 1


def test_units_and_dates(axes):
    axes.figure.draw_without_rendering()
    assert axes.get_ylabel() == "Coulomb friction $F_c$ [N]"
    assert axes.get_xlabel() == "time [UTC]; identified from 2026-09-21 to 2027-02-01"
    assert axes.get_title(loc="left") == "FV-101 (/fv_101/identifier)"
    told = axes.get_title(loc="right")
    assert told.startswith("+3.00 ± ")
    assert "worth maintenance expected 2027-06-1" in told
    ticks = [label.get_text() for label in axes.get_xticklabels()]
    assert "2027" in ticks


@pytest.mark.parametrize("verdict", [Verdict.IDENTIFIED, Verdict.WEAK])
def test_estimates_with_their_intervals(axes, history, verdict):
    drawn = labelled(axes, f"{verdict.value}, 95 % interval")
    assert isinstance(drawn, ErrorbarContainer)
    points, _, (bars,) = drawn
    expected = [one for one in history.entries if one.friction and one.friction.verdict is verdict]
    assert len(expected) == (4 if verdict is Verdict.WEAK else 16)
    values = [one.friction.value for one in expected]
    np.testing.assert_array_equal(points.get_ydata(), values)
    np.testing.assert_allclose(days(points), [(one.time - START) / DAY for one in expected])
    reach = [segment[:, 1] for segment in bars.get_segments()]
    np.testing.assert_allclose(reach, [(value - 2, value + 2) for value in values])
    is_hollow = points.get_markerfacecolor() == "white"
    assert is_hollow == (verdict is Verdict.WEAK)


@pytest.mark.parametrize(
    ("label", "level"),
    [
        ("baseline", 141.0),
        ("worth maintenance (warn_ratio)", 176.25),
        ("excess (error_ratio)", 282.0),
        ("may leak (low_ratio)", 70.5),
    ],
)
def test_limits(axes, label, level):
    assert set(labelled(axes, label).get_ydata()) == {level}


def test_trend_up_to_where_the_limit_is_surely_crossed(axes, history):
    trend, line = history.trend, labelled(axes, "trend, 95 % band")
    assert days(line)[0] == pytest.approx(0.0, abs=1e-6)
    assert days(line)[-1] == pytest.approx((trend.crossing.latest - START) / DAY)
    assert line.get_ydata()[0] == pytest.approx(150.0)
    mark = labelled(axes, "limit expected")
    assert mark.get_ydata() == [176.25]
    assert days(mark) == pytest.approx([8.75 * MONTH / DAY])


def test_refusal_and_baseline_are_marked(axes):
    assert days(labelled(axes, "refused")) == pytest.approx([1.0])
    assert labelled(axes, "baseline set").get_linestyle() == ":"


def test_a_bare_history():
    """One identification without baseline, tag or trend."""
    entry = success(valve=OTHER._replace(tag=""))
    bare = ValveHistory(entry.valve, (entry,), None, None)
    (axes,) = trend_figure([bare]).axes
    _, labels = axes.get_legend_handles_labels()
    assert labels == ["identified, 95 % interval"]
    assert axes.get_title(loc="left") == OTHER.name
    assert axes.get_title(loc="right") == ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        axes.figure.draw_without_rendering()
    begin, end = axes.get_xlim()
    assert (end - begin, (begin + end) / 2) == pytest.approx((2 / 24, START / DAY), rel=1e-9)


def test_a_tag_is_text_whatever_it_holds_and_stays_within_the_page(history):
    tag = r"cost $\foo{$ and $x^2$ of the long name of a valve; " * 6
    named = dataclasses.replace(history, valve=VALVE._replace(tag=tag))
    (axes,) = (figure := trend_figure([named])).axes
    figure.draw_without_rendering()
    title = axes.get_title(loc="left")
    assert title.startswith(r"cost $\foo{$ and $x^2$ of the long name")
    assert title.splitlines()[1].endswith(" …")
    left, right = axes._left_title, axes._right_title
    assert left.get_window_extent().x1 <= figure.bbox.x1
    assert right.get_text()
    assert title.splitlines()[2:] == []
    drift, lines = right.get_window_extent(), left.get_window_extent()
    assert drift.y1 <= lines.y0 + 0.4 * lines.height


def test_a_day_of_many_identifications_is_no_blob():
    """All are dots; one of each stretch of the axis has its interval, that of the middle value."""
    first = [success(START + minute * DAY // 1440, 150.0 + minute, 2.0) for minute in range(61)]
    last = success(START + 100 * DAY, 160.0, 2.0)
    dense = ValveHistory(VALVE, (*first, last), None, None)
    (axes,) = trend_figure([dense]).axes
    points, _, _ = labelled(axes, "identified, 95 % interval")
    assert points.get_ydata().tolist() == [180.0, 160.0]
    (dots,) = (line for line in axes.lines if line.get_marker() == ".")
    assert dots.get_ydata().size == 62
    assert dots.get_alpha() < 0.5


@pytest.mark.parametrize(("days_after", "is_marked"), [(10, True), (200, True), (1e5, False)])
def test_today_is_marked_where_it_is_near(history, days_after, is_marked):
    now = history.entries[-1].time + round(days_after * DAY)
    (axes,) = trend_figure([history], now).axes
    _, labels = axes.get_legend_handles_labels()
    assert ("today" in labels) == is_marked
    if is_marked:
        assert days(labelled(axes, "today")) == pytest.approx([(now - START) / DAY] * 2)
        low, high = axes.get_xlim()
        assert low < now / DAY < high


def test_all_valves_have_one_time_axis_and_one_legend(history):
    later = success(START + 300 * DAY, valve=OTHER)
    figure = trend_figure([history, ValveHistory(OTHER, (later,), None, None)])
    (legend,), panels = figure.legends, figure.axes
    labels = [text.get_text() for text in legend.get_texts()]
    assert len(labels) == len(set(labels))
    assert len({axes.get_xlim() for axes in panels}) == 1
    assert [bool(axes.get_xlabel()) for axes in panels] == [False, True]
    assert panels[1].get_xlabel().endswith("identified from 2026-09-21 to 2027-07-18")


@pytest.mark.parametrize("is_narrow", [False, True])
def test_a_report_has_the_same_panel_without_title(history, is_narrow):
    (axes,) = (figure := report_trend_figure(history, is_narrow=is_narrow)).axes
    figure.draw_without_rendering()
    assert axes.get_title(loc="left") == ""
    box, legend = figure.bbox, axes.get_legend().get_window_extent()
    assert box.x0 <= legend.x0 < legend.x1 <= box.x1 + 1
    assert box.y0 <= legend.y0 < legend.y1 <= box.y1 + 1
    labels = [label.get_window_extent() for label in axes.get_xticklabels()]
    shown = [one for one in labels if box.x0 <= one.x0 and one.x1 <= box.x1]
    assert len(shown) >= 2
    assert all(one.x1 < other.x0 for one, other in pairwise(shown))


TIMES = (1, 3, *[0] * (BINS - 3), 4)


def test_histogram_and_days():
    days = [UsedDay(day, 0, Usage(9.0, 1, 1, TIMES)) for day in range(50)]
    days += [UsedDay(50 + day, 7, Usage(1.0 + day, 1, 1, TIMES)) for day in range(3)]
    figure = usage_figure(ValveUsage.of(days, renewal=7))
    assert figure.get_figwidth() == pytest.approx(7.1)
    places, distances = figure.axes
    assert [bar.get_height() for bar in places.patches] == [12.5, 37.5, *[0] * (BINS - 3), 50]
    assert [bar.get_x() for bar in places.patches] == [5 * n for n in range(BINS)]
    assert [bar.get_height() for bar in distances.patches] == [1, 2, 3]
    narrow = usage_figure(ValveUsage.of(days, renewal=7), is_narrow=True)
    above, below = (axes.get_subplotspec() for axes in narrow.axes)
    assert (above.rowspan.start, below.rowspan.start) == (0, 1)
    for axes in figure.axes:
        assert "[" in axes.get_xlabel()
        assert "[" in axes.get_ylabel()


@pytest.mark.parametrize(("count", "shown"), [(1, 7), (3, 7), (20, 20)])
def test_at_least_a_week_is_on_the_axis(count, shown):
    days = [UsedDay(20_000 + day, 0, Usage(1.0, 1, 1, TIMES)) for day in range(count)]
    axes = usage_figure(ValveUsage.of(days)).axes[1]
    assert np.ptp(axes.get_xlim()) == pytest.approx(shown)
    assert axes.get_xlim()[1] == pytest.approx(20_000 + count - 0.5)


def test_nothing_to_draw():
    with pytest.raises(ValueError, match="not monitored"):
        usage_figure(ValveUsage())
