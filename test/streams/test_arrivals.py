"""Samples by the block: the same as one by one, and tables of them."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import (
    Arrivals,
    Intake,
    Kind,
    RecordBuffer,
    SampleFault,
    Signal,
    rows_arrived,
)

START = 1_700_000_000  # s
FAULTS = {
    "without a position": SampleFault.NO_JOINT,
    "overtaken": SampleFault.OVERTAKEN,
    "went back": SampleFault.BACK,
    "repeats a stamp": SampleFault.REPEATED,
    "not finite": SampleFault.NOT_FINITE,
    "outside": SampleFault.OUT_OF_RANGE,
}


def arrivals(samples):
    kinds, stamps, values = zip(*samples, strict=True) if samples else ((), (), ())
    return Arrivals(np.array(kinds, np.uint8), np.array(stamps, np.int64), np.array(values, float))


def add_one_by_one(buffer, samples):
    """The readable form of `RecordBuffer.add_arrivals`."""
    rejected, cleared = Counter(), []
    for kind, stamp, value in samples:
        if kind == Kind.PRESSURE:
            problem = buffer.add_pressure(stamp, value)
        else:
            problem = buffer.add_position(stamp, None if kind == Kind.NO_POSITION else value)
        if problem is not None:
            signal = Signal.PRESSURE if kind == Kind.PRESSURE else Signal.POSITION
            fault = next(fault for words, fault in FAULTS.items() if words in problem)
            rejected[signal, fault] += 1
            if fault is SampleFault.BACK:
                cleared.append(problem)
    return Intake(rejected, cleared[0] if cleared else None)


@st.composite
def streams(draw):
    """Blocks of both signals, most of them good; stamps may repeat or go back."""
    steps = st.one_of(st.integers(1, 3), st.integers(1, 3), st.sampled_from([0, -2]))
    values = {
        Kind.PRESSURE: st.one_of(
            st.floats(0, 250e3), st.sampled_from([math.nan, math.inf, -1.0, 250e3 + 1])
        ),
        Kind.POSITION: st.one_of(
            st.floats(0, 0.03), st.sampled_from([math.nan, -math.inf, 1e308, -11.0])
        ),
        Kind.NO_POSITION: st.just(math.nan),
    }
    good = {Kind.PRESSURE: st.floats(0, 250e3), Kind.POSITION: st.floats(0, 0.03)}
    clocks = {False: 0, True: 0}
    blocks = []
    for _ in range(draw(st.integers(1, 5))):
        is_good = draw(st.booleans())
        block = []
        for _ in range(draw(st.integers(0, 12))):
            kind = draw(st.sampled_from(list(good if is_good else values)))
            clock = kind == Kind.PRESSURE
            clocks[clock] += draw(st.integers(1, 3) if is_good else steps)
            value = draw((good if is_good else values)[kind])
            block.append((kind, START * 10**9 + clocks[clock] * 10**8, value))
        blocks.append(block)
    return blocks


@given(blocks=streams())
def test_a_block_is_what_its_samples_are(blocks):
    whole, single = (RecordBuffer(BENCH_VALVE, 1.0) for _ in range(2))
    for block in blocks:
        assert whole.add_arrivals(arrivals(block)) == add_one_by_one(single, block)
        assert len(whole) == len(single)
        found, expected = whole.snapshot(), single.snapshot()
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_array_equal(one.stamps, other.stamps)
            np.testing.assert_array_equal(one.values, other.values)
        assert found[2:] == expected[2:]


def table(stamps, pressure=1e5, position=0.01):
    return np.column_stack(np.broadcast_arrays(stamps, pressure, position))


class TestTables:
    def test_rows_become_pairs(self):
        kinds, stamps, values = rows_arrived([[0.001, 1e5, 0.01], [0.002, 2e5, 0.02]])
        assert kinds.tolist() == [Kind.PRESSURE, Kind.POSITION] * 2
        assert stamps.tolist() == [1_000_000, 1_000_000, 2_000_000, 2_000_000]
        assert values.tolist() == [1e5, 0.01, 2e5, 0.02]

    @given(st.lists(st.integers(0, 2_000_000_000 * 10**6), min_size=1, max_size=20))
    def test_whole_microseconds_come_back(self, microseconds):
        """Up to the year 2033; 0.24 µs is what floats of this size tell apart."""
        seconds = np.array([value / 1e6 for value in microseconds])
        expected = [1000 * value for value in microseconds]
        assert rows_arrived(table(seconds)).stamps[::2].tolist() == expected

    @given(st.lists(st.integers(-8_000_000 * 10**9, 8_000_000 * 10**9), min_size=1, max_size=20))
    def test_nanoseconds_of_small_times_come_back(self, nanoseconds):
        seconds = np.array([value / 1e9 for value in nanoseconds])
        assert rows_arrived(table(seconds)).stamps[::2].tolist() == nanoseconds

    def test_none_is_none(self):
        assert rows_arrived(np.empty((0, 3))).stamps.size == 0

    @pytest.mark.parametrize(
        ("shape", "told"),
        [((4, 2), "(4, 2)"), ((4, 4), "(4, 4)"), ((3,), "(3,)"), ((1, 4, 3), "(1, 4, 3)")],
    )
    def test_other_shapes_are_refused(self, shape, told):
        with pytest.raises(ValueError, match="the shape is") as refusal:
            rows_arrived(np.zeros(shape))
        assert str(refusal.value) == f"the shape is {told}, not (n, 3)"

    def test_other_columns_are_refused(self):
        with pytest.raises(ValueError, match="time,position,pressure") as refusal:
            rows_arrived(np.zeros((4, 3)), ["time", "position", "pressure"])
        assert "not 'time,pressure,position'" in str(refusal.value)

    @pytest.mark.parametrize("time", [math.nan, math.inf, -math.inf, 1e10])
    def test_impossible_times_are_refused(self, time):
        with pytest.raises(ValueError, match="a time is not finite"):
            rows_arrived(table(np.array([0.0, time])))
