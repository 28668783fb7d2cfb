"""The buffer of one signal: what it keeps, and how much."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.streams import nanoseconds
from valve_friction_ros.streams.samples import SampleBuffer, Samples

START = 1_700_000_000_000_000_000  # ns, where float seconds are 238 ns apart


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        (0.0, 0),
        (1e-3, 1_000_000),
        (0.1 + 0.2, 300_000_000),
        (1 / 3, 333_333_333),
        (-0.5, -(10**9) // 2),
    ],
)
def test_nanoseconds_are_the_nearest(seconds, expected):
    assert nanoseconds(seconds) == expected
    assert isinstance(nanoseconds(seconds), int)


def test_empty():
    buffer = SampleBuffer(1.0)
    stamps, values = buffer.samples()
    assert len(buffer) == stamps.size == values.size == 0
    assert buffer.last_stamp is None


def test_returns_what_was_put_in():
    buffer = SampleBuffer(1.0)
    for step in range(5):
        buffer.append(START + step, 0.1 * step)
    stamps, values = buffer.samples()
    np.testing.assert_array_equal(stamps, START + np.arange(5))
    np.testing.assert_array_equal(values, 0.1 * np.arange(5))
    assert stamps.dtype == np.int64
    assert values.dtype == np.float64
    assert buffer.last_stamp == START + 4


def test_the_window_holds_its_ends():
    """A sample exactly one window old is in; one nanosecond older is out."""
    buffer = SampleBuffer(1.0)
    for stamp in (START - 1, START, START + 500, START + 10**9):
        buffer.append(stamp, 1.0)
    np.testing.assert_array_equal(buffer.samples().stamps, [START, START + 500, START + 10**9])


def test_samples_are_a_copy():
    buffer = SampleBuffer(1.0)
    buffer.append(START, 1.0)
    before = buffer.samples()
    buffer.append(START + 1, 2.0)
    before.values[0] = 9.0
    assert before.stamps.size == 1
    assert buffer.samples().values.tolist() == [1.0, 2.0]


def test_clear():
    buffer = SampleBuffer(1.0)
    buffer.append(START, 1.0)
    buffer.clear()
    assert len(buffer) == 0
    assert buffer.last_stamp is None
    buffer.append(0, 2.0)  # earlier than what was there before
    assert buffer.samples().values.tolist() == [2.0]


@given(
    pauses=st.lists(st.integers(1, 400_000_000), min_size=1, max_size=200),
    window=st.integers(1, 10**9),
)
def test_keeps_the_last_window_and_little_more(pauses, window):
    """Nothing within the window is lost, and nothing older than 1.1 windows stays in memory."""
    buffer = SampleBuffer(window / 1e9)
    stamps = START + np.cumsum(pauses)
    for stamp in stamps.tolist():
        buffer.append(stamp, float(stamp - START))
        assert len(buffer) <= np.count_nonzero((stamps >= stamp - 1.1 * window) & (stamps <= stamp))
    expected = stamps[stamps >= stamps[-1] - window]
    found = buffer.samples()
    np.testing.assert_array_equal(found.stamps, expected)
    np.testing.assert_array_equal(found.values, (expected - START).astype(float))


@given(
    pauses=st.lists(st.integers(1, 8_000_000), min_size=1, max_size=60),
    repeats=st.integers(1, 80),
    block=st.integers(1, 3000),
    window=st.integers(1, 3 * 10**9),
)
def test_blocks_are_what_their_samples_are(pauses, repeats, block, window):
    """Chunks whose stamps fit 32 bits and chunks whose stamps do not, cut anywhere."""
    stamps = START + np.cumsum(pauses * repeats)
    values = np.sqrt(np.arange(stamps.size))
    buffer = SampleBuffer(window / 1e9)
    for begin in range(0, stamps.size, block):
        part = slice(begin, begin + block)
        buffer.extend(Samples(stamps[part], values[part]))
        last = stamps[part][-1]
        assert buffer.last_stamp == last
        assert len(buffer) == np.count_nonzero((stamps >= last - window) & (stamps <= last))
    inside = stamps >= stamps[-1] - window
    np.testing.assert_array_equal(buffer.samples().stamps, stamps[inside])
    np.testing.assert_array_equal(buffer.samples().values, values[inside])


@pytest.mark.parametrize("period", [1, 4_194_304, 5_000_000, 10**10])
def test_single_samples_and_blocks_make_the_same(period):
    """5 ms: a chunk lasts longer than 32 bits of nanoseconds."""
    stamps = START + period * np.arange(5000)
    values = np.cos(np.arange(5000.0))
    whole, single = (SampleBuffer(3000 * period / 1e9) for _ in range(2))
    whole.extend(Samples(stamps, values))
    for stamp, value in zip(stamps.tolist(), values.tolist(), strict=True):
        single.append(stamp, value)
    for buffer in (whole, single):
        np.testing.assert_array_equal(buffer.samples().stamps, stamps[-3001:])
        np.testing.assert_array_equal(buffer.samples().values, values[-3001:])


def test_even_stamps_take_no_memory():
    """One stamp that is 1 ns late costs its chunk of 1024 samples their 4 bytes each."""
    stamps, values = START + 1_000_000 * np.arange(4096), np.zeros(4096)
    uneven = stamps.copy()
    uneven[2000] += 1
    sizes = []
    for some in (stamps, uneven):
        buffer = SampleBuffer(10.0)
        buffer.extend(Samples(some, values))
        np.testing.assert_array_equal(buffer.samples().stamps, some)
        sizes.append(buffer.nbytes)
    opened = 1024 * 16
    assert sizes == [opened + 8 * 4096, opened + 8 * 4096 + 4 * 1024]
