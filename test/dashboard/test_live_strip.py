"""Signals thinned for a screen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.dashboard.live_strip import LiveStrip, envelope

SECOND = 1_000_000_000


@given(count=st.integers(0, 3000), columns=st.integers(1, 80), seed=st.integers(0, 2**32 - 1))
def test_each_column_keeps_its_extremes(count, columns, seed):
    random = np.random.default_rng(seed)
    times = np.sort(-random.uniform(0, 10, count))
    values = random.standard_normal(count)
    thinned = envelope(times, values, columns, 10.0)
    assert thinned.times.size <= max(2 * columns, 0) or thinned.times.size == count
    assert (np.diff(thinned.times) >= 0).all()
    assert set(thinned.values) <= set(values)
    column = np.clip(((times + 10) * columns / 10).astype(int), 0, columns - 1)
    kept = np.clip(((thinned.times + 10) * columns / 10).astype(int), 0, columns - 1)
    for one in np.unique(column):
        assert thinned.values[kept == one].max() == values[column == one].max()
        assert thinned.values[kept == one].min() == values[column == one].min()


def test_a_spike_of_one_sample_is_seen():
    """60 s at 1 kHz on 500 columns: each takes 120 samples, and none is lost."""
    strip = LiveStrip(60.0)
    stamps = np.arange(60_000, dtype=np.int64) * 1_000_000
    values = np.zeros(60_000)
    values[31_234] = 7.0
    strip.add(0, stamps, values)
    pressure, stem = strip.strips(500)
    assert pressure.values.max() == 7.0
    assert pressure.times.size <= 1000
    assert pressure.times[-1] == 0.0
    assert stem.times.size == 0


def test_only_the_last_seconds_are_kept():
    strip = LiveStrip(10.0)
    for begin in range(0, 40, 5):
        stamps = (begin + np.arange(500) / 100) * SECOND
        strip.add(1, stamps.astype(np.int64), np.full(500, float(begin)))
    stem = strip.strips(10_000)[1]
    assert stem.times[0] == pytest.approx(-10.0)
    assert set(stem.values) == {25.0, 30.0, 35.0}


def test_a_bag_that_begins_again_empties_the_signal():
    strip = LiveStrip(60.0)
    strip.add(0, np.array([50, 51]) * SECOND, np.array([1.0, 1.0]))
    strip.add(0, np.array([10, 11]) * SECOND, np.array([2.0, 2.0]))
    assert set(strip.strips(100)[0].values) == {2.0}


def test_the_loop_is_stem_over_pressure():
    strip = LiveStrip(60.0)
    time = np.arange(0, 20, 0.01)
    stamps = (time * SECOND).astype(np.int64)
    strip.add(0, stamps, 1e5 + 1e4 * time)
    strip.add(1, stamps[::3] + 2_000_000, 1e-3 * (time[::3] + 0.002))  # slower, and a little later
    loop = strip.loop(300)
    assert 100 < loop.times.size <= 300
    np.testing.assert_allclose(loop.values, 1e-3 * (loop.times - 1e5) / 1e4, atol=1e-6)
    assert LiveStrip(60.0).loop(300).times.size == 0
