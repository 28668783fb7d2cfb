# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Both signals of a valve: what is taken, what is rejected, what is refused because of it."""

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, Valve
from valve_friction_ros.streams import (
    Arrivals,
    Intake,
    Kind,
    RecordBuffer,
    Samples,
    Snapshot,
    rows_arrived,
)

MILLISECOND = 1_000_000
START = 1_700_000_000_000_000_000
NAMES = {"pressure": "actuator_pressure", "position": "stem_state"}
RANGE = "actuator_pressure outside the sensor's range 0 to 250000 Pa"


def fill(buffer, count, first=0, period=1):
    """Add `count` good samples of both signals from `first` ms on; all are taken."""
    for step in range(count):
        stamp = START + MILLISECOND * (first + period * step)
        assert buffer.add_pressure(stamp, 1e5 + step) is None
        assert buffer.add_position(stamp, 1e-6 * step) is None


def stamp(milliseconds):
    return START + MILLISECOND * milliseconds


@pytest.fixture
def buffer():
    return RecordBuffer(BENCH_VALVE, 1.0)


def refused(buffer):
    with pytest.raises(RefusalError) as refusal:
        buffer.snapshot().recording()
    return str(refusal.value)


class TestGoodSamples:
    def test_become_a_recording(self, buffer):
        fill(buffer, 500)
        record = buffer.snapshot().recording()
        np.testing.assert_array_equal(record.pressure, 1e5 + np.arange(500))
        np.testing.assert_array_equal(record.position, 1e-6 * np.arange(500))
        assert record.sample_period == 1e-3
        assert record.start_time == START / 1e9
        assert len(buffer) == 1000

    def test_a_snapshot_stays_as_it_is(self, buffer):
        fill(buffer, 500)
        snapshot = buffer.snapshot()
        buffer.add_pressure(stamp(500), math.nan)
        fill(buffer, 100, first=501)
        buffer.clear("of the test")
        assert len(snapshot.recording()) == 500

    @pytest.mark.parametrize("pressure", [-3125.0, 250000.0, 257812.5])
    def test_the_ends_of_the_range_are_in_it(self, buffer, pressure):
        assert buffer.add_pressure(START, pressure) is None

    def test_without_a_range_any_finite_pressure_is_one(self):
        buffer = RecordBuffer(Valve(1.0), 1.0)
        assert buffer.add_pressure(START, -1e300) is None
        assert str(buffer.add_pressure(START + 1, math.inf)) == "actuator_pressure is not finite"


BAD = [
    ("pressure", math.nan, "actuator_pressure is not finite"),
    ("pressure", math.inf, "actuator_pressure is not finite"),
    ("pressure", -math.inf, "actuator_pressure is not finite"),
    ("pressure", -3125.1, RANGE),
    ("pressure", 257812.6, RANGE),
    ("position", math.nan, "stem_state is not finite"),
    ("position", -math.inf, "stem_state is not finite"),
    ("position", None, "stem_state has no position for the joint"),
]


@pytest.mark.parametrize(("signal", "value", "cause"), BAD)
class TestBadSamples:
    def add(self, buffer, signal, at, value):
        return getattr(buffer, f"add_{signal}")(at, value)

    def test_refuse_the_window(self, buffer, signal, value, cause):
        fill(buffer, 500)
        assert str(self.add(buffer, signal, stamp(500), value)) == cause
        assert str(self.add(buffer, signal, stamp(501), value)) == cause
        fill(buffer, 100, first=502)
        assert len(buffer) == 1200
        assert refused(buffer) == (
            f"bad samples in the window: {cause} (2 samples); correct the source, then clear the "
            "buffer or wait until these samples have left it"
        )
        buffer.clear("of the test")
        fill(buffer, 500, first=602)
        assert len(buffer.snapshot().recording()) == 500

    def test_leave_with_the_window(self, buffer, signal, value, cause):
        fill(buffer, 5)
        self.add(buffer, signal, stamp(5), value)
        fill(buffer, 1000, first=6)  # the newest is exactly one window younger
        assert cause in refused(buffer)
        fill(buffer, 1, first=1006)
        assert buffer.snapshot().rejections == ()
        assert buffer.snapshot().recording().duration == 1.0


def test_of_repeated_stamps_the_first_stays(buffer):
    fill(buffer, 500)
    causes = [str(add(stamp(499), 7.0)) for add in (buffer.add_pressure, buffer.add_position)]
    assert causes == [f"{name} repeats a time stamp" for name in NAMES.values()]
    snapshot = buffer.snapshot()
    assert snapshot.pressure.values[-1] == 1e5 + 499
    assert snapshot.position.values[-1] == 1e-6 * 499
    message = refused(buffer)
    assert all(f"{cause} (1 samples)" in message for cause in causes)


class TestStampsThatGoBack:
    @pytest.mark.parametrize("signal", ["pressure", "position"])
    def test_clear_everything(self, buffer, signal):
        fill(buffer, 500)
        buffer.add_pressure(stamp(500), math.nan)
        cause = f"the time stamps of {NAMES[signal]} jumped back by 0.25 s"
        found = getattr(buffer, f"add_{signal}")(stamp(249), 1e-3)
        assert str(found) == f"the buffer was cleared: {cause}"
        assert len(buffer) == 0
        snapshot = buffer.snapshot()
        assert snapshot.rejections == ()
        assert str(snapshot.cleared_because) == cause


class TestStampsThatWereOvertaken:
    """A stamp that goes back by less than a sampling period costs its sample, and nothing else."""

    PERIOD = 4  # ms

    @pytest.fixture
    def buffer(self, buffer):
        fill(buffer, 200, period=self.PERIOD)
        return buffer

    @pytest.mark.parametrize("signal", ["pressure", "position"])
    @pytest.mark.parametrize("back", [1, 2, 4])
    def test_one_is_left_out_and_the_window_is_a_recording(self, buffer, signal, back):
        cause = "arrived out of order: its time stamp is slightly before the last one"
        cause = f"{NAMES[signal]} {cause}"
        last = 199 * self.PERIOD
        assert str(getattr(buffer, f"add_{signal}")(stamp(last - back), 7.0)) == cause
        fill(buffer, 10, first=last + self.PERIOD, period=self.PERIOD)
        assert buffer.counts == (210, 210)
        assert {str(one): n for one, n in buffer.rejected.items()} == {cause: 1}
        assert buffer.snapshot().cleared_because is None
        record = buffer.snapshot().recording()
        assert len(record) == 210
        assert 7.0 not in (*record.drive, *record.position)

    def test_further_back_the_clock_has_jumped(self, buffer):
        found = buffer.add_pressure(stamp(199 * self.PERIOD - 7), 1e5)
        assert str(found).endswith(" jumped back by 0.007 s")

    def test_a_block_without_them_is_what_the_watches_take(self, buffer):
        at = 200 * self.PERIOD + np.array([0, 4, 2, 8, 12, 11, 16])
        stamps, kinds = (START + MILLISECOND * at).astype(np.int64), np.zeros(7, np.uint8)
        whole = Arrivals(kinds, stamps, np.arange(7.0))
        left = buffer.in_order(whole)
        np.testing.assert_array_equal(left.values, [0, 1, 3, 4, 6])
        assert buffer.add_arrivals(left) == Intake()
        assert buffer.counts == (205, 200)
        assert sum(buffer.rejected.values()) == 2

    def test_in_the_first_block_of_all(self):
        buffer, at = RecordBuffer(BENCH_VALVE, 1.0), MILLISECOND * np.array([0, 4, 8, 6, 12])
        whole = Arrivals(np.full(5, Kind.POSITION, np.uint8), START + at, np.arange(5.0))
        np.testing.assert_array_equal(buffer.in_order(whole).values, [0, 1, 2, 4])

    def test_blocks_in_order_stay_as_they_are(self, buffer):
        for table in ([], [[0.0, 1e5, 0.0]], [[2e9, 1e5, 0.0], [2e9, 1e5, 0.0]]):
            whole = rows_arrived(np.reshape(table, (-1, 3)))
            assert buffer.in_order(whole) is whole


class TestTheCauseOfAClear:
    @pytest.mark.parametrize("period", [1, 7], ids=["divides the window", "does not"])
    def test_told_until_the_buffer_is_full_again(self, buffer, period):
        buffer.clear("of the test")
        needed = math.ceil(1000 / period)  # periods in a window
        fill(buffer, needed, period=period)
        assert buffer.snapshot().cleared_because == "of the test"
        fill(buffer, 1, first=needed * period)
        assert buffer.snapshot().cleared_because is None
        buffer.clear("of another")
        assert buffer.snapshot().cleared_because == "of another"


def test_rejections_are_bounded():
    """A dead sensor for hours costs no more memory than for seconds."""
    buffer = RecordBuffer(BENCH_VALVE, 3600.0)
    for step in range(10_500):
        buffer.add_pressure(stamp(step), math.nan)
    assert [rejection.stamp for rejection in buffer.snapshot().rejections] == [
        stamp(step) for step in range(500, 10_500)
    ]
    assert "actuator_pressure is not finite (10000 samples)" in refused(buffer)


def test_each_sample_is_counted_as_taken_or_by_the_cause_of_its_rejection(buffer):
    fill(buffer, 2500)
    for late in (1.0, 2.0):
        buffer.add_pressure(stamp(2500) + round(late), 1e9)
    buffer.add_arrivals(rows_arrived([[0.0, 1e5, 1e-3], [1.0, math.nan, 1e-3], [1.0, 1e5, 1e-3]]))
    assert buffer.taken == 5000 + 3
    assert {str(one): number for one, number in buffer.rejected.items()} == {
        RANGE: 2,
        "actuator_pressure went back in time": 1,
        "actuator_pressure is not finite": 1,
        "stem_state repeats a time stamp": 1,
    }


BLOCK = 500
WINDOW = 600.0
CHUNKS = 2 * 1024 * 16  # bytes by which the two signals may vary as their chunks come and go


def add(buffer, block):
    seconds = (block * BLOCK + np.arange(BLOCK)) / 1000
    buffer.add_arrivals(rows_arrived(np.column_stack([seconds, seconds + 1e5, seconds * 1e-6])))


@pytest.fixture(scope="module")
def sizes():
    """Sizes of the buffer after each block since its window is full, by itself and traced."""
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        buffer = RecordBuffer(BENCH_VALVE, WINDOW)
        full = round(WINDOW * 1000 / BLOCK) + 1
        for block in range(full):
            add(buffer, block)
        own, traced = np.zeros((2, full), np.int64)
        for number in range(full):
            add(buffer, full + number)
            own[number] = buffer.nbytes
            traced[number] = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert len(buffer) == 2 * 600_001
    return own, traced


def test_under_20_megabytes_and_constant_while_running(sizes):
    own, traced = sizes
    assert own.max() < traced.max() < 20e6
    assert np.ptp(own) <= CHUNKS
    assert np.ptp(traced) <= 2 * CHUNKS  # the list and the arrays around the chunks as well


MOST = 1000


def signal(count, period=1000, begin=START, value=lambda time: time):
    """A signal at even stamps, `period` ns apart; by default its value is its time since START."""
    stamps = begin + period * np.arange(count, dtype=np.int64)
    return Samples(stamps, value((stamps - START).astype(np.float64)))


def thinned(pressure, position):
    return Snapshot(pressure, position, (), None).thinned(MOST)


def test_what_is_short_enough_stays_to_the_last_bit():
    one = Snapshot(signal(MOST), signal(MOST, 700), (), None)
    found, count = one.thinned(MOST)
    assert found is one
    assert count == 1


@pytest.mark.parametrize(("count", "each"), [(MOST + 1, 2), (2 * MOST, 2), (9_999, 10)])
def test_each_so_many_samples_give_their_mean_at_their_mean_time(count, each):
    found, by = thinned(signal(count), signal(count))
    assert by == each
    for one in found.pressure, found.position:
        assert one.stamps.size == count // each
        middles = 1000 * (each * np.arange(one.stamps.size) + (each - 1) / 2)
        np.testing.assert_array_equal(one.stamps - START, middles)
        np.testing.assert_allclose(one.values, middles, rtol=1e-12)


def test_signals_with_the_same_stamps_keep_them_though_one_began_earlier():
    found, _ = thinned(signal(5003, begin=START - 3000), signal(5000))
    np.testing.assert_array_equal(found.pressure.stamps, found.position.stamps)


def test_only_the_long_signal_is_thinned():
    found, _ = thinned(signal(10 * MOST, 100), signal(MOST - 1, 1000))
    assert found.pressure.stamps.size <= MOST
    assert found.position.stamps.size == MOST - 1


def test_no_mean_spans_a_pause():
    """Of a signal that is away for a second; a value from there would be invented."""
    before, after = signal(3005), signal(3000, begin=START + 1_000_000_000)
    found, each = thinned(Samples.joined(before, after), Samples.joined(before, after))
    assert each == 7
    stamps = found.position.stamps
    is_before = stamps <= before.stamps[-1]
    assert (is_before | (stamps >= after.stamps[0])).all()
    assert is_before.sum() == 3005 // 7
    np.testing.assert_allclose(found.position.values, stamps - START, rtol=1e-12)


@given(
    st.lists(st.integers(1, 10_000_000), min_size=1, max_size=60),
    st.integers(1, 200),
    st.integers(1, 50),
)
def test_never_more_than_the_most_and_always_increasing(pauses, repeats, most):
    stamps = START + np.cumsum(np.tile(np.array(pauses, np.int64), repeats))
    one = Samples(stamps, np.zeros(stamps.size))
    found, _ = Snapshot(one, one, (), None).thinned(most)
    for part in found.pressure, found.position:
        assert part.stamps.size <= most
        assert (np.diff(part.stamps) > 0).all()


@pytest.mark.parametrize("empty", [0, 1])
def test_an_empty_signal_is_left_to_who_refuses_it(empty):
    signals = [signal(2 * MOST), signal(0)]
    found, count = thinned(signals[empty], signals[1 - empty])
    assert count == 1
    assert {found.pressure.stamps.size, found.position.stamps.size} == {0, 2 * MOST}
