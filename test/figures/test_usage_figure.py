"""The figure of a valve's usage shows the packing in use."""

import numpy as np
import pytest

from valve_friction_ros.figures.usage_figure import usage_figure
from valve_friction_ros.usage import BINS, Usage, UsedDay, ValveUsage

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
    with pytest.raises(ValueError, match="not watched"):
        usage_figure(ValveUsage())
