"""Patterns become corners: every level, rate and hold as it was asked for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.planning.pressure_band import PressureBand
from valve_friction_ros.planning.stroke_test import SHAPES, Pattern, stroke_test

BAND = PressureBand(8e4, 1.2e5, 2e4)  # 2 s for a stroke at the largest rate


def test_two_full_cycles_corner_by_corner():
    test = stroke_test(Pattern(("full",), (1.0, 0.5), 1.0), BAND, 25.0)
    times = [0, 1, 2, 3, 5, 6, 8, 9, 13, 14, 18, 19, 20, 21]
    levels = [10, 10, 8, 8, 12, 12, 8, 8, 12, 12, 8, 8, 10, 10]
    np.testing.assert_allclose(test.times, times)
    np.testing.assert_allclose(test.pressures, np.array(levels) * 1e4)
    assert (test.cycles, test.duration) == (2, 21.0)
    assert test.largest_rate == pytest.approx(2e4)


def test_no_test_where_a_kind_of_cycle_has_no_room():
    assert stroke_test(Pattern(("full",), (1.0, 0.5), 1.0), BAND, 20.9) is None
    assert stroke_test(Pattern(("full",), (1.0, 0.5), 1.0), BAND, 21.0) is not None


@given(
    shapes=st.lists(st.sampled_from(sorted(SHAPES)), min_size=1, max_size=2),
    speeds=st.lists(st.floats(0.05, 1.0), min_size=1, max_size=3),
    hold=st.floats(0.0, 5.0),
    duration=st.floats(5.0, 600.0),
)
def test_limits_hold_for_every_pattern(shapes, speeds, hold, duration):
    test = stroke_test(Pattern(tuple(shapes), tuple(speeds), hold), BAND, duration)
    if test is None:
        return
    assert test.duration <= duration * (1 + 1e-9)
    assert test.pressures.min() == pytest.approx(BAND.low)
    assert test.pressures.max() == pytest.approx(BAND.high)
    assert test.largest_rate <= BAND.rate * (1 + 1e-9)
    assert test.pressures[0] == test.pressures[-1] == pytest.approx(1e5)
    assert (np.diff(test.times) > 0).all()
    assert test.cycles >= 2
    signal = test.excitation.sample(test.times)
    np.testing.assert_allclose(signal, test.pressures)


@pytest.mark.parametrize(
    ("shapes", "speeds", "hold"),
    [
        ((), (1.0,), 0.0),
        (("round",), (1.0,), 0.0),
        (("full",), (0.0,), 0.0),
        (("full",), (1.1,), 0.0),
        (("full",), (), 0.0),
        (("full",), (1.0,), -1.0),
    ],
)
def test_what_is_no_pattern(shapes, speeds, hold):
    with pytest.raises(ValueError, match=r"shapes|speeds|hold"):
        Pattern(shapes, speeds, hold)
