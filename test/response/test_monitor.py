"""Moves from streams: derived answers of lags, dead times and stuck stems; bounded memory."""

import math

import numpy as np
import pytest
from valve_streams import TRAVEL, feed, held, value_at

from valve_friction_ros.health import Level
from valve_friction_ros.response import Hunting, ResponseLimits, ResponseMonitor, found

RNG = np.random.default_rng(5)
SCHEDULE = [(20.0, 0.5), *((20.0, 0.5 + change) for change in (0.05, -0.05, 0.1, 0.02, 0.06, -0.1))]
SPAN = 1.3e5


def lagging(command, times, dead_time, lag):
    """The exact answer of a first-order lag behind a dead time to steps."""
    state, answer = command[1][0], np.empty(times.size)
    ends = np.append(command[0][1:], times[-1] + 1)
    for start, end, target in zip(command[0], ends, command[1], strict=True):
        inside = (times >= start + dead_time) & (times < end + dead_time)
        fallen = np.exp(-(times[inside] - start - dead_time) / lag)
        answer[inside] = target + (state - target) * fallen
        state = target + (state - target) * math.exp(-(end - start) / lag)
    answer[times < dead_time] = command[1][0]
    return answer


def answered(dead_time, lag, noise=1e-5, rate=100.0, offset=0.0):
    command = held(SCHEDULE)
    times = np.arange(0, 140.0, 1 / rate)
    stem = lagging(command, times, dead_time, lag)
    pressure = 8e4 + SPAN * stem + 20 * RNG.standard_normal(times.size)
    monitor = ResponseMonitor(TRAVEL)
    measured = stem + offset + noise * RNG.standard_normal(times.size)
    feed(monitor, command, (times, measured), (times, pressure))
    return monitor


@pytest.mark.parametrize(("dead_time", "lag"), [(0.2, 0.3), (1.0, 0.8)])
def test_the_figures_of_a_lag(dead_time, lag):
    summary = answered(dead_time, lag).summary
    assert len(summary.moves) == 6
    assert all(move.moved and move.settled and move.rested for move in summary.moves)
    # 0.1 % of the travel is the first movement that counts: of 2 % that is lag·ln(1/0.95).
    assert dead_time <= summary.dead_time.median <= dead_time + 0.06 * lag + 0.02
    assert summary.t63.median == pytest.approx(dead_time + lag, abs=0.03)
    assert summary.t86.median == pytest.approx(dead_time + 2 * lag, abs=0.04)
    assert summary.overshoot.median == pytest.approx(0.0, abs=0.01)
    assert summary.steady_deviation.median < 1e-3
    assert summary.by_size == ((0, 0), (0, 0), (0, 0), (2, 2), (4, 4), (0, 0)) or (
        sum(count for _, count in summary.by_size) == 6
    )


def test_deviation_in_time():
    monitor = answered(0.2, 0.3, offset=-0.02)
    sizes, signed = monitor.deviation()
    assert signed == pytest.approx(0.02, abs=0.002)
    assert 0.02 <= sizes.median < 0.03
    assert sizes.high < 0.06
    findings = found(monitor.summary, ResponseLimits(deviation=0.01), None)
    (finding,) = findings
    assert finding.level is Level.WARN
    assert "rests 2 %" in finding.message or "rests 2.0 %" in finding.message
    assert "calibration" in finding.message
    assert found(monitor.summary, ResponseLimits(), None) == []


def test_steps_that_the_stem_ignores_are_the_dead_band():
    changes = (0.003, 0.004, 0.05, 0.004, 0.05, 0.003)
    levels = 0.4 + np.cumsum([0.0, *changes])
    command = held([(20.0, level) for level in levels])
    times = np.arange(0, 139.0, 0.02)
    target = value_at(command, times)
    big = np.array([0.4, 0.4, 0.4, 0.457, 0.457, 0.511, 0.511])
    stem = big[np.searchsorted(command[0], times, side="right") - 1]
    pressure = 8e4 + SPAN * target
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, stem), (times, pressure))
    summary = monitor.summary
    assert [move.moved for move in summary.moves] == [abs(c) > 0.01 for c in changes]
    assert len(summary.ignored) == 4
    assert summary.largest_ignored == pytest.approx(0.004)
    assert summary.smallest_answered == pytest.approx(0.05)
    assert summary.by_size[0] == (0, 4)


def test_changes_that_are_no_moves_are_counted():
    times = np.arange(0, 60.0, 0.02)
    command = (times, 0.4 + 0.01 * np.maximum(times - 5, 0))
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, command[1]), (times, 8e4 + SPAN * command[1]))
    assert monitor.summary.moves == ()
    assert monitor.left_out > 10


def test_a_clock_that_goes_back_costs_the_move_only():
    monitor = answered(0.2, 0.3)
    before = monitor.summary.moves
    command = held([(20.0, 0.5), (20.0, 0.6)])
    times = np.arange(0, 40.0, 0.02)
    stem = lagging(command, times, 0.2, 0.3)
    feed(monitor, command, (times, stem), (times, 8e4 + SPAN * stem))
    assert monitor.summary.moves[: len(before)] == before
    assert len(monitor.summary.moves) == len(before) + 1


def swinging(shape):
    times = np.arange(0, 120.0, 0.05)
    phase = 2 * np.pi * times / 15.0
    triangle = 2 / np.pi * np.arcsin(np.sin(phase))
    stem = np.sign(np.sin(phase - np.pi / 2)) if shape == "square" else np.sin(phase)
    if shape == "decaying":
        stem = stem * np.exp(-times / 20)
    pressure = triangle if shape == "square" else np.sin(phase - 0.3)
    monitor = ResponseMonitor(TRAVEL)
    noisy = 0.5 + 0.01 * stem + 1e-4 * RNG.standard_normal(times.size)
    feed(monitor, held([(1.0, 0.5)]), (times, noisy), (times, 1e5 + 5e3 * pressure))
    return monitor


def test_a_square_stem_under_a_triangular_pressure_sticks():
    monitor = swinging("square")
    assert monitor.hunting.sticks
    assert monitor.hunting.period == pytest.approx(15.0, rel=0.05)
    assert monitor.hunting.amplitude == pytest.approx(0.02, rel=0.1)
    (finding,) = found(monitor.summary, ResponseLimits(), monitor.hunting)
    assert "hunts by 2" in finding.message
    assert "check the packing first" in finding.message


def test_a_stem_that_swings_with_its_pressure_is_not_called_sticky():
    monitor = swinging("sine")
    assert monitor.hunting is not None
    assert not monitor.hunting.sticks
    (finding,) = found(monitor.summary, ResponseLimits(), monitor.hunting)
    assert "friction is not seen to be the cause" in finding.message


def test_a_swing_that_has_died_away_is_no_hunting():
    assert swinging("decaying").hunting is None
    assert Hunting(1.0, 0.1, sticks=False) != Hunting(1.0, 0.1, sticks=True)


@pytest.mark.parametrize("lag", [0.0, 1.0, 2.5, 4.0])
def test_a_command_that_swings_within_its_noise_is_followed_and_not_hunted(lag):
    """Its swing of ±0.6 % is less than the change that noise of 0.3 % lets be seen."""
    times = np.arange(0, 150.0, 0.1)
    command = times, 0.5 + 0.006 * np.sin(times / 2) + 0.003 * RNG.standard_normal(times.size)
    stem = 0.5 + 0.006 * np.sin((times - lag) / 2) + 1e-4 * RNG.standard_normal(times.size)
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, stem), (times, 8e4 + SPAN * stem))
    assert monitor.hunting is None


def test_a_stem_that_hunts_under_a_noisy_command():
    times = np.arange(0, 150.0, 0.1)
    command = times, 0.5 + 0.003 * RNG.standard_normal(times.size)
    stem = 0.5 + 0.01 * np.sin(times / 2) + 1e-4 * RNG.standard_normal(times.size)
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, stem), (times, 8e4 + SPAN * stem))
    assert monitor.hunting.period == pytest.approx(4 * np.pi, rel=0.02)


@pytest.mark.parametrize("travel", [math.inf, 0.0, math.nan])
def test_the_travel_must_be_known(travel):
    with pytest.raises(ValueError, match="travel"):
        ResponseMonitor(travel)
