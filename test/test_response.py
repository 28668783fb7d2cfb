# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The answer to the command in service, on streams as they would arrive."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from benchmark.positioner import case_of, simulated, steps
from valve_friction_ros.health import Level
from valve_friction_ros.response import (
    AnswerCause,
    ResponseLimits,
    ResponseMonitor,
    response_findings,
    summarised,
)
from valve_friction_ros.response.moves import CommandHolds
from valve_friction_ros.streams import Arrivals, Kind, Samples

START = 1_700_000_000_000_000_000
TRAVEL = 0.028575


def stamps(times):
    return START + np.round(np.asarray(times) * 1e9).astype(np.int64)


def feed(monitor, command, stem, pressure):
    """Hand on pairs of times (s) and values (share of the travel, Pa), half a second at a time."""
    kinds = [(Kind.POSITION, stem, TRAVEL), (Kind.PRESSURE, pressure, 1.0)]
    at = np.concatenate([stamps(times) for _, (times, _), _ in kinds])
    of = np.concatenate([np.full(len(times), kind, np.uint8) for kind, (times, _), _ in kinds])
    values = np.concatenate([scale * np.asarray(each) for _, (_, each), scale in kinds])
    order = np.argsort(at, kind="stable")
    told, given = stamps(command[0]), TRAVEL * np.asarray(command[1])
    edges = np.arange(at.min(), at.max() + 1e9, 500_000_000)
    cuts = np.searchsorted(at[order], edges), np.searchsorted(told, edges)
    for a, b, c, d in zip(cuts[0][:-1], cuts[0][1:], cuts[1][:-1], cuts[1][1:], strict=True):
        part = order[a:b]
        monitor.take(Samples(told[c:d], given[c:d]), Arrivals(of[part], at[part], values[part]))


def held(schedule):
    """Return the times and values of a command that is published only when it changes."""
    times = np.cumsum([0.0, *(seconds for seconds, _ in schedule[:-1])])
    return times, np.array([value for _, value in schedule])


def value_at(command, times):
    return command[1][np.searchsorted(command[0], times, side="right") - 1]


SECOND = 1_000_000_000


def changes(times, values, blocks=1):
    holds = CommandHolds(1.0)
    found = []
    for at, each in zip(
        np.array_split(np.asarray(times), blocks), np.array_split(values, blocks), strict=True
    ):
        found += holds.take(Samples(np.round(at * 1e9).astype(np.int64), each))
    return found + holds.advance(10_000 * SECOND)


@given(
    st.lists(
        st.tuples(st.floats(1.0, 100.0), st.sampled_from([-0.1, -0.02, 0.003, 0.05])),
        min_size=1,
        max_size=8,
    )
)
def test_a_command_that_is_published_when_it_changes(moves):
    times = np.cumsum([seconds for seconds, _ in moves])
    levels = 0.5 + np.cumsum([0.0, *(change for _, change in moves)])
    found = changes(np.array([0.0, *times]), levels)
    assert [one.is_step for one in found] == [True] * len(moves)
    assert [one.stamp for one in found] == [round(time * 1e9) for time in times]
    np.testing.assert_allclose([one.after for one in found], levels[1:])
    np.testing.assert_allclose([one.before for one in found], levels[:-1])
    np.testing.assert_allclose([one.held for one in found], [seconds for seconds, _ in moves])


@pytest.mark.parametrize("blocks", [1, 7, 400])
@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_a_sampled_command_with_noise(blocks, noise):
    times = np.arange(4000) / 100
    values = np.where(times < 20, 0.4, 0.45)
    values = values + noise * np.random.default_rng(1).standard_normal(times.size)
    (found,) = (one for one in changes(times, values, blocks) if one.held >= 5.0)
    assert found.is_step
    assert found.stamp == 20 * SECOND
    assert found.held == pytest.approx(20.0, abs=0.32)  # until the noise is known
    assert found.after - found.before == pytest.approx(0.05, abs=3 * noise + 1e-12)


@pytest.mark.parametrize("rate", [0.001, 0.01])
def test_a_ramp_is_no_step(rate):
    times = np.arange(6000) / 100
    found = changes(times, 0.3 + rate * np.maximum(times - 5, 0))
    assert found
    assert not any(one.is_step and one.held >= 1.0 for one in found[1:])
    assert not found[0].is_step


def test_a_jump_in_three_samples_is_one_step():
    times = np.arange(2000) / 50
    values = np.interp(times, [10.0, 10.06], [0.2, 0.3])
    (found,) = changes(times, values)
    assert found.after == pytest.approx(0.3)


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


def answered(dead_time, lag, offset=0.0):
    command = held(SCHEDULE)
    times = np.arange(0, 140.0, 0.01)
    stem = lagging(command, times, dead_time, lag)
    pressure = 8e4 + SPAN * stem + 20 * RNG.standard_normal(times.size)
    measured = stem + offset + 1e-5 * RNG.standard_normal(times.size)
    return follow(command, times, measured, pressure)


def test_deviation_in_time():
    monitor = answered(0.2, 0.3, offset=-0.02)
    sizes, signed = monitor.deviation()
    assert signed == pytest.approx(0.02, abs=0.002)
    assert 0.02 <= sizes.median < 0.03
    assert sizes.high < 0.06
    (finding,) = response_findings(monitor.summary, ResponseLimits(deviation=0.01), None)
    assert finding.level is Level.WARN
    assert "settles 2 %" in finding.message or "settles 2.0 %" in finding.message
    assert "calibration" in finding.message
    assert response_findings(monitor.summary, ResponseLimits(), None) == []


def test_steps_that_the_stem_ignores_are_the_dead_band():
    changes = (0.003, 0.004, 0.05, 0.004, 0.05, 0.003)
    levels = 0.4 + np.cumsum([0.0, *changes])
    command = held([(20.0, level) for level in levels])
    times = np.arange(0, 139.0, 0.02)
    target = value_at(command, times)
    big = np.array([0.4, 0.4, 0.4, 0.457, 0.457, 0.511, 0.511])
    stem = big[np.searchsorted(command[0], times, side="right") - 1]
    summary = follow(command, times, stem, 8e4 + SPAN * target).summary
    assert [move.moved for move in summary.moves] == [abs(c) > 0.01 for c in changes]
    assert len(summary.ignored) == 4
    assert summary.largest_ignored == pytest.approx(0.004)
    assert summary.smallest_answered == pytest.approx(0.05)
    assert summary.by_size[0] == (0, 4)


def test_changes_that_are_no_moves_are_counted():
    times = np.arange(0, 60.0, 0.02)
    command = (times, 0.4 + 0.01 * np.maximum(times - 5, 0))
    monitor = follow(command, times, command[1], 8e4 + SPAN * command[1])
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


def follow(command, times, stem, pressure):
    """A monitor that was fed these."""
    monitor = ResponseMonitor(TRAVEL)
    feed(monitor, command, (times, stem), (times, pressure))
    return monitor


def swinging(shape):
    times = np.arange(0, 120.0, 0.05)
    phase = 2 * np.pi * times / 15.0
    triangle = 2 / np.pi * np.arcsin(np.sin(phase))
    stem = np.sign(np.sin(phase - np.pi / 2)) if shape == "square" else np.sin(phase)
    if shape == "decaying":
        stem = stem * np.exp(-times / 20)
    pressure = triangle if shape == "square" else np.sin(phase - 0.3)
    noisy = 0.5 + 0.01 * stem + 1e-4 * RNG.standard_normal(times.size)
    return follow(held([(1.0, 0.5)]), times, noisy, 1e5 + 5e3 * pressure)


@pytest.mark.parametrize(
    ("shape", "sticks", "words"),
    [
        ("square", True, "check the packing first"),
        ("sine", False, "no sign that friction is the cause"),
    ],
)
def test_a_square_stem_under_a_triangular_pressure_sticks(shape, sticks, words):
    """One that swings with its pressure is not called sticky."""
    monitor = swinging(shape)
    assert monitor.hunting.sticks is sticks
    assert monitor.hunting.period == pytest.approx(15.0, rel=0.05)
    assert monitor.hunting.amplitude == pytest.approx(0.02, rel=0.1)
    (finding,) = response_findings(monitor.summary, ResponseLimits(), monitor.hunting)
    assert "hunts by 2" in finding.message or "hunts by 1.9" in finding.message
    assert words in finding.message


def test_a_swing_that_has_died_away_is_no_hunting():
    assert swinging("decaying").hunting is None


@pytest.mark.parametrize("lag", [0.0, 1.0, 2.5, 4.0])
def test_a_command_that_swings_within_its_noise_is_followed_and_not_hunted(lag):
    """Its swing of ±0.6 % is less than the change that noise of 0.3 % lets be seen."""
    times = np.arange(0, 150.0, 0.1)
    command = times, 0.5 + 0.006 * np.sin(times / 2) + 0.003 * RNG.standard_normal(times.size)
    stem = 0.5 + 0.006 * np.sin((times - lag) / 2) + 1e-4 * RNG.standard_normal(times.size)
    assert follow(command, times, stem, 8e4 + SPAN * stem).hunting is None


def test_a_stem_that_hunts_under_a_noisy_command():
    times = np.arange(0, 150.0, 0.1)
    command = times, 0.5 + 0.003 * RNG.standard_normal(times.size)
    stem = 0.5 + 0.01 * np.sin(times / 2) + 1e-4 * RNG.standard_normal(times.size)
    monitor = follow(command, times, stem, 8e4 + SPAN * stem)
    assert monitor.hunting.period == pytest.approx(4 * np.pi, rel=0.02)


@pytest.mark.parametrize("travel", [math.inf, 0.0, math.nan])
def test_the_travel_must_be_known(travel):
    with pytest.raises(ValueError, match="travel"):
        ResponseMonitor(travel)


POSITIONER = {AnswerCause.LATE, AnswerCause.SLOW, AnswerCause.SETTING}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "which", "cause"),
    [
        ("healthy", "dead_time", None),
        ("sticky", "dead_time", None),
        ("late", "dead_time", AnswerCause.LATE),
        ("slow", "t86", None),
        ("setting", "deviation", None),
    ],
)
def test_one_case_of_each_fault(fault, which, cause):
    """No side is blamed wrongly; one case guards the rule, shares need many drawn ones."""
    case = case_of(fault, 1000)
    record = simulated(case, 1000, steps(np.random.default_rng([1000, 3]), 30, 0.1))
    monitor = ResponseMonitor(TRAVEL)
    feed(
        monitor,
        (record.command_stamps, record.command),
        (record.stamps, record.position),
        (record.pressure_stamps, record.pressure),
    )
    assert len(monitor.summary.moves) >= 12
    told = {one: monitor.summary.cause(one) for one in ("dead_time", "t86", "deviation")}
    wrong = POSITIONER if fault == "sticky" else {AnswerCause.FRICTION}
    assert not set(told.values()) & wrong
    assert cause is None or told[which] is cause


NOISE = np.random.default_rng(17)


def answers(levels, stem_of, pressure_of):
    """The moves of a stem whose command goes from level to level every 20 s."""
    command = held([(20.0, level) for level in levels])
    times = np.arange(0, 20.0 * len(levels), 0.05)
    wanted = value_at(command, times)
    stem = stem_of(wanted) + 1e-5 * NOISE.standard_normal(times.size)
    pressure = 8e4 + SPAN * pressure_of(wanted) + 20 * NOISE.standard_normal(times.size)
    return follow(command, times, stem, pressure).summary.moves


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
    return [one.message for one in response_findings(summarised(moves), limits, None, dead_band)]


def test_the_causes_that_the_pressure_leaves():
    (seized,) = messages(SEIZED)
    assert "ignored 5 of the latest 5 command steps of 5 %" in seized
    assert "the pressure responds: the stem is stuck or its position sensor" in seized
    (starved,) = messages(STARVED)
    assert "the actuator pressure does not respond either" in starved
    (mixed,) = messages([*SEIZED[:3], *STARVED[:2]])
    assert "is stuck, its position sensor has failed, or the pressure" in mixed
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
    (late,) = (one for one in told if "starts to move" in one)
    assert "of 10 moves" in late
    held_for = np.median([m.held for m in SEIZED[:8]])
    assert f"{held_for:.2g} s after" in late


@pytest.mark.parametrize("moves", [SEIZED, [HEALTHY[0], *SEIZED[1:]]])
def test_a_positioner_is_not_blamed_for_a_stem_that_stands(moves):
    assert summarised(moves).cause("deviation") is AnswerCause.UNKNOWN
    told = messages(moves, ResponseLimits(deviation=0.01))
    assert any("settles" in one for one in told)
    assert not any("calibration" in one for one in told)


DEAD_TIME, STEP, BEGIN, END = 0.4, 0.1, 20.0, 70.0
PLANTS = {
    "first order": ([1.0], [0.8, 1.0]),
    "critically damped": ([1.0], [0.25, 1.0, 1.0]),
    "overshooting": ([1.0], [1.0, 0.8, 1.0]),
    "gain below one": ([0.9], [0.5, 1.0]),
}


def unit_step(plant, times):
    """The answer of a transfer function to a unit step at 0, exact at each time."""
    return scipy.signal.step(scipy.signal.TransferFunction(*plant), T=times)[1]


def expected(plant):
    """Times to 63.2 % and 86.5 % of the whole change, and the overshoot, on a fine grid."""
    times = np.arange(0.0, 60.0, 1e-3)
    share = unit_step(plant, times) / (plant[0][-1] / plant[1][-1])
    t63, t86 = (times[np.argmax(share >= 1 - np.exp(-n))] for n in (1, 2))
    return DEAD_TIME + t63, DEAD_TIME + t86, max(share.max() - 1.0, 0.0)


@pytest.mark.parametrize(("rate", "way"), [(20.0, 1.0), (100.0, -1.0)])
@pytest.mark.parametrize("name", PLANTS)
def test_figures_of_a_known_plant(name, way, rate):
    plant, rng = PLANTS[name], np.random.default_rng(8)
    fine = np.arange(0.0, END, 1e-3)
    answer = np.concatenate([np.zeros(round((BEGIN + DEAD_TIME) / 1e-3)), unit_step(plant, fine)])
    times = np.arange(0.0, END, 1 / rate)
    stem = 0.5 + way * STEP * answer[np.round(times / 1e-3).astype(int)]
    measured = stem + 1e-5 * rng.standard_normal(times.size)
    pressure = 8e4 + SPAN * stem + 20.0 * rng.standard_normal(times.size)
    command = held([(BEGIN, 0.5), (END - BEGIN, 0.5 + way * STEP)])
    (move,) = follow(command, times, measured, pressure).summary.moves
    t63, t86, overshoot = expected(plant)
    sample = 1 / rate
    assert move.t63 == pytest.approx(t63, abs=sample)
    assert move.t86 == pytest.approx(t86, abs=sample)
    assert move.overshoot == pytest.approx(overshoot, abs=3e-3)
    first = fine[np.argmax(np.abs(STEP * unit_step(plant, fine)) >= 1e-3)]
    assert DEAD_TIME <= move.dead_time <= DEAD_TIME + first + sample
    assert move.steady_error == pytest.approx(way * STEP * (1 - plant[0][-1]), abs=1e-3)
