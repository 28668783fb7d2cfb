"""Records that are too long to be identified in time: means take the place of their samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.streams import Samples, Snapshot

MOST = 1000
START = 1_700_000_000_000_000_000


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


def test_noise_is_averaged():
    noise = np.random.default_rng(1).normal(size=16 * MOST)
    found, _ = thinned(signal(16 * MOST, value=lambda _: noise), signal(16 * MOST))
    assert found.pressure.values.std() == pytest.approx(1 / 4, rel=0.1)
    np.testing.assert_allclose(found.pressure.values, noise.reshape(-1, 16).mean(axis=1))


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
