# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Signals thinned for a screen."""

import numpy as np
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


def test_a_bag_that_begins_again_empties_the_signal():
    strip = LiveStrip(60.0)
    strip.add(0, np.array([50, 51]) * SECOND, np.array([1.0, 1.0]))
    strip.add(0, np.array([10, 11]) * SECOND, np.array([2.0, 2.0]))
    assert set(strip.strips(100)[0].values) == {2.0}


class Clock:
    now = 1000.0

    def __call__(self):
        return self.now


def test_the_axis_goes_on_when_the_samples_stop():
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    assert strip.note() == "No samples have been received yet."
    for signal in (0, 1):
        strip.add(signal, np.array([1, 2, 3]) * SECOND, np.array([1.0, 2.0, 3.0]))
    clock.now += 1.0
    assert strip.note() == ""
    assert strip.strips(100)[0].times.tolist() == [-2.0, -1.0, 0.0]
    clock.now += 9.0
    assert strip.note() == "no sample for 10 s"
    assert strip.strips(100)[1].times.tolist() == [-12.0, -11.0, -10.0]
    clock.now += 49.0
    assert strip.strips(100)[0].times.tolist() == [-60.0, -59.0]
    clock.now += 60.0
    assert strip.strips(100)[0].times.size == 0


def test_a_signal_that_stops_alone_is_named():
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    strip.add(0, np.array([1]) * SECOND, np.array([1.0]))
    assert strip.note() == "no stem"
    strip.add(1, np.array([1]) * SECOND, np.array([1.0]))
    clock.now += 7.0
    strip.add(1, np.array([8]) * SECOND, np.array([1.0]))
    assert strip.note() == "no pressure for 7 s"
    strip.trouble = "no such topic"
    assert strip.note() == "no such topic"


def test_nothing_is_drawn_anew_without_samples():
    """While samples come each counts; then the axis goes on each second, until all has left."""
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    none = strip.revision
    strip.add(0, np.array([1]) * SECOND, np.array([1.0]))
    seen = [strip.revision]
    assert seen[0] != none
    for _ in range(500):
        clock.now += 0.2
        seen.append(strip.revision)
    assert seen == sorted(seen)
    assert len(set(seen[:6])) == 1
    assert 55 <= len(set(seen)) <= 62
    assert len(set(seen[-190:])) == 1
    strip.add(0, np.array([101]) * SECOND, np.array([1.0]))
    assert strip.revision != seen[-1]


@given(sizes=st.lists(st.integers(1, 400), max_size=40), most=st.integers(1, 700))
def test_the_newest_samples_are_kept_whatever_the_packets(sizes, most):
    strip, sent = LiveStrip(1.0, most), 0
    for size in sizes:
        numbers = np.arange(sent, sent + size)
        strip.add(0, numbers * 2_000_000, numbers.astype(float))  # 500 Hz
        sent += size
    kept = strip.strips(10_000)[0].values
    assert kept.tolist() == list(range(max(0, sent - min(most, 501)), sent))


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
