"""Stamps that cannot be: they are told, and no kept move goes for them."""

import pytest
from service import SECOND, START

from valve_friction_ros.evidence import Move, lies_behind_those_ahead, stamp_problem

DAY = 86_400 * SECOND


def problem(begin, last=START, now=START):
    return stamp_problem(Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0, 10.0, 1e-3), last, now)


@pytest.mark.parametrize(
    ("begin", "last", "now"),
    [
        (START, START, START),
        (START, None, START),
        (START + 400 * DAY, START, START + 400 * DAY),  # a long rest
        (START, START - DAY, START + 900 * DAY),  # a recording that is played
        (START + 400 * DAY, START + 400 * DAY, START),  # a clock that is behind
        (START, None, 0),  # a clock that is not set
        (60 * SECOND, None, START),  # a simulation that begins at zero
    ],
)
def test_what_is_believed(begin, last, now):
    assert problem(begin, last, now) == ""


def test_back():
    assert problem(START - SECOND) == "before those that are kept"
    assert "before" in problem(0)


def test_ahead():
    for last in (START, None):
        assert "a day ahead of the clock" in problem(START + 70 * 365 * DAY, last)


@pytest.mark.parametrize(
    ("delay", "ahead", "now", "expected"),
    [
        (0, 60, START, True),
        (9, 60, START, True),
        (11, 60, START, False),  # who is behind may be the sensor
        (-2, 60, START, False),
        (0, 0, START, False),  # it passes by itself
        (0, 60, 10**17, False),  # a clock that is not set
    ],
)
def test_a_clock_that_was_ahead(delay, ahead, now, expected):
    """Minutes by which the move is behind the clock, and the kept ones ahead of it."""
    end = now - delay * 60 * SECOND
    move = Move(end - SECOND, end, 1e-3, 2e-3, 500.0, 10.0, 1e-3)
    assert lies_behind_those_ahead(move, now + ahead * 60 * SECOND, now) is expected
