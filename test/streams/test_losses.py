"""Messages that never arrived, by the numbers that publishers give them."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.streams import LossCounter


def counted(*looks, period=0.1):
    """The losses after some looks at the stream, `period` s apart."""
    counter, now = LossCounter(), 0.0
    for now, numbers in zip(itertools.count(0.0, period), looks):
        counter.take(numbers, now)
    return counter.losses(now)


def test_nothing_is_lost():
    losses = counted(range(1, 100), [], range(100, 110))
    assert (losses.lost, losses.share, losses.silence) == (0, 0.0, float("inf"))


def test_a_stream_that_is_met_late_has_lost_nothing():
    assert counted(range(5000, 5100)).lost == 0


@given(st.sets(st.integers(1, 400), max_size=300), st.integers(1, 60))
def test_each_that_is_missing_is_counted(missing, size):
    """By any looks; those before the first and behind the last cannot be known."""
    sent = [one for one in range(402) if one not in missing]
    looks = [sent[begin : begin + size] for begin in range(0, len(sent), size)]
    losses = counted(*looks, period=0.01)
    assert losses.lost == losses.recently_lost == len(missing)
    assert losses.share == pytest.approx(len(missing) / 402 if missing else 0.0)


@given(st.lists(st.booleans(), max_size=200))
def test_publishers_are_told_apart(turns):
    """One that has published for long, and a new one, in any order."""
    old, new = itertools.count(70_000), itertools.count(1)
    assert counted([next(old)], [next(new if turn else old) for turn in turns]).lost == 0


def test_one_that_was_there_before_is_no_loss_of_another():
    assert counted([1, 2, 3], [500_000, 500_001], [4, 5]).lost == 0


def test_a_publisher_that_begins_anew():
    assert counted([900, 901], [1, 2], [3, 5]).lost == 1


def test_the_share_is_of_the_last_minute():
    counter = LossCounter()
    counter.take(range(100), 0.0)
    counter.take(range(200, 300), 1.0)
    assert counter.losses(1.0).share == pytest.approx(1 / 3)
    assert counter.losses(31.0).silence == pytest.approx(30.0)
    for second in range(2, 120):
        counter.take(range(100 * second + 100, 100 * second + 200), float(second))
    losses = counter.losses(120.0)
    assert (losses.lost, losses.recently_lost) == (100, 0)
    assert losses.share == 0.0


def test_few_publishers_are_held():
    counter = LossCounter()
    for first in range(10**9, 10**5, -(10**7)):
        counter.take([first], 0.0)
    assert len(counter._publishers) == 16
    assert counter.losses(0.0).lost == 0
    assert np.isinf(counter.losses(0.0).silence)
