"""A stem that ignores its command is an alarm, and its positioner is not blamed for it."""

from dataclasses import replace

import numpy as np
import pytest
from valve_streams import TRAVEL, feed, held, value_at

from valve_friction_ros.response import (
    Cause,
    ResponseLimits,
    ResponseMonitor,
    found,
    summarised,
)

SPAN = 1.3e5
NOISE = np.random.default_rng(17)


def answers(levels, stem_of, pressure_of):
    """The moves of a stem whose command goes from level to level every 20 s."""
    command = held([(20.0, level) for level in levels])
    times = np.arange(0, 20.0 * len(levels), 0.05)
    wanted = value_at(command, times)
    stem = stem_of(wanted) + 1e-5 * NOISE.standard_normal(times.size)
    pressure = 8e4 + SPAN * pressure_of(wanted) + 20 * NOISE.standard_normal(times.size)
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, stem), (times, pressure))
    return monitor.summary.moves


def follows(wanted):
    return wanted


def stands(wanted):
    return np.full(wanted.shape, 0.4)


LEVELS = (0.5, 0.55) * 6
SEIZED = answers(LEVELS, stands, follows)
NO_LIMITS = ResponseLimits()
STARVED = answers(LEVELS, stands, stands)
HEALTHY = answers(LEVELS, follows, follows)


def messages(moves, limits=NO_LIMITS, dead_band=np.nan):
    return [one.message for one in found(summarised(moves), limits, None, dead_band)]


def test_the_causes_that_the_pressure_leaves():
    (seized,) = messages(SEIZED)
    assert "ignored 5 of the latest 5 steps of its command of 5 %" in seized
    assert "the pressure answers: the stem is stuck, or its position sensor" in seized
    (starved,) = messages(STARVED)
    assert "does not reach the actuator" in starved
    (mixed,) = messages([*SEIZED[:3], *STARVED[:2]])
    assert "is stuck, its position sensor has stopped, or the pressure" in mixed
    assert messages(HEALTHY) == []


@pytest.mark.parametrize("answered", range(10))
def test_one_answer_is_no_acquittal(answered):
    moves = [HEALTHY[k] if k == answered else SEIZED[k] for k in range(10)]
    (told,) = messages(moves)
    assert f"ignored {4 if answered >= 5 else 5} of the latest 5" in told


def test_two_answers_end_it():
    assert len(messages([*HEALTHY[:6], *SEIZED])) == 1
    assert messages([*SEIZED, *HEALTHY[:2]]) == []
    assert messages(SEIZED[:4]) == []


def resized(moves, size):
    return [replace(m, change=np.sign(m.change) * size) for m in moves]


@pytest.mark.parametrize(
    ("size", "dead_band", "alarms"),
    [
        (0.019, np.nan, False),  # within twice the dead band of a good valve
        (0.03, np.nan, False),  # where steps of 5 % were answered
        (0.05, np.nan, True),
        (0.05, 0.06, False),
        (0.07, 0.06, True),
        (0.03, 0.01, True),
    ],
)
def test_only_large_steps_must_be_answered(size, dead_band, alarms):
    moves = [*HEALTHY, *resized(SEIZED, size)]
    assert bool(messages(moves, dead_band=dead_band)) is alarms


def test_a_stem_on_its_seat_may_ignore_a_few_percent():
    seated = [replace(m, at_stop=True) for m in SEIZED]
    assert messages(seated) == []
    assert len(messages(resized(seated, 0.12))) == 1


def test_what_is_ignored_is_late():
    """Two quick answers of ten hid that the stem stood for as long as it was asked."""
    told = messages([*HEALTHY[:2], *SEIZED[:8]], ResponseLimits(dead_time=1.0))
    (late,) = (one for one in told if "begins to move" in one)
    assert "of 10 moves" in late
    held_for = np.median([m.held for m in SEIZED[:8]])
    assert f"{held_for:.2g} s after" in late


@pytest.mark.parametrize("moves", [SEIZED, [HEALTHY[0], *SEIZED[1:]]])
def test_a_positioner_is_not_blamed_for_a_stem_that_stands(moves):
    assert summarised(moves).cause("deviation") is Cause.UNKNOWN
    told = messages(moves, ResponseLimits(deviation=0.01))
    assert any("rests" in one for one in told)
    assert not any("calibration" in one for one in told)
