"""Stamps that cannot be: they are told, and no kept move goes for them."""

import pytest
from service import SECOND, START

from valve_friction_ros.evidence import Move, stamp_problem

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
