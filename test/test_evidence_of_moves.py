# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Evidence that adds up: moves, their stamps, and what many of them say together."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from service import (
    PRELOAD,
    SECOND,
    SPRING,
    START,
    STEP,
    VALVE,
    arrivals,
    changing_at,
    levels,
    made_moves,
    parts,
    signals,
)

from valve_friction_ros.evidence import (
    MOST_MOVES,
    Move,
    Moves,
    MoveStream,
    evidence_of,
    is_clock_reset,
    stamp_problem,
)
from valve_friction_ros.evidence.balance import (
    balance_of,
    blocks_of,
    design_of,
    levels_of,
    priors,
    with_onsets,
)
from valve_friction_ros.evidence.estimate import series_of
from valve_friction_ros.identification import IdentificationSettings, Verdict
from valve_friction_ros.streams import Arrivals, Kind

FRICTION = 300.0
PLACES = levels(8, seed=3)
WHOLE = signals(PLACES, FRICTION)
GOOD = Move(0, 10, 1e-3, 2e-3, 500.0, 10.0, 1e-3)


def taken(*some, valve=VALVE):
    stream = MoveStream(valve)
    return [move for one in some for move in stream.take(one)]


def taken_by(size, samples, valve=VALVE):
    """The moves of samples that arrive so many at a time."""
    return taken(*parts(samples, range(0, samples.stamps.size, size)), valve=valve)


def middles(moves):
    """Seconds after the start."""
    return [(0.5 * (one.begin + one.end) - START) / 1e9 for one in moves]


def friction_of(move):
    middle = 0.5 * (move.start + move.stop)
    return move.direction * (move.force - SPRING * middle - PRELOAD)


@pytest.fixture(scope="module")
def moves():
    # The first ten seconds tell the noise; what moves in them is lost, and the last may go on.
    return taken_by(37, arrivals(*WHOLE))


class TestBalance:
    def test_each_move_gives_its_friction(self, moves):
        """Inertia leaves no trace: between two rests it does no work."""
        assert len(moves) >= 6
        for move in moves:
            assert friction_of(move) == pytest.approx(FRICTION, rel=2e-3)
            assert move.distance == pytest.approx(STEP, rel=1e-2)

    def test_its_onset_is_the_force_of_the_breakaway(self, moves):
        for move in moves:
            free = SPRING * move.onset_position + PRELOAD
            assert move.direction * (move.onset_force - free) == pytest.approx(FRICTION, rel=0.05)

    def test_a_lag_adds_its_rate(self, moves):
        """The pressure seen 50 ms late changes the mean force by the rate, to first order."""
        stamps, pressure, position = WHOLE
        late = np.interp(stamps - 50_000_000, stamps, pressure)
        found = taken(arrivals(stamps, late, position))
        for one, exact in zip(found[-4:], moves[-4:], strict=True):
            assert one.force - exact.force == pytest.approx(-0.05 * exact.force_rate, rel=0.1)

    @pytest.mark.parametrize("hold", [2, 4])
    def test_a_held_pressure_is_not_late(self, hold):
        """Each value is sent 2 or 4 times: in the mean it is 25 or 75 ms old."""
        random = np.random.default_rng(2)
        stamps, pressure, position = signals(PLACES, FRICTION, rate=20.0)
        noisy = pressure + 20.0 * random.standard_normal(pressure.size)
        held = np.repeat(noisy[::hold], hold)[: noisy.size]
        found = taken_by(37, arrivals(stamps, held, position))
        assert len(found) >= 5
        mean = np.mean([friction_of(move) for move in found])
        assert mean == pytest.approx(FRICTION, rel=0.01)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 2 * WHOLE[0].size - 1), max_size=12, unique=True))
def test_the_moves_do_not_depend_on_the_messages_batches(moves, cuts):
    """What comes before the first look at the noise may differ; nothing after it."""
    found, usual = taken(*parts(arrivals(*WHOLE), sorted(cuts))), moves
    last = {(one.start, one.stop): one for one in found}
    after = [one for one in usual if one.begin > START + 24e9]
    common = [last[one.start, one.stop] for one in after if (one.start, one.stop) in last]
    assert len(common) >= len(after) - 1
    assert all(friction_of(one) == pytest.approx(FRICTION, rel=2e-3) for one in found)


class TestNoEvidence:
    """Motion 4 lies between 53 s and 55 s."""

    def harmed(self, samples, kind=Kind.POSITION, value=None):
        kinds, stamps, values = (one.copy() for one in samples)
        one = np.flatnonzero((stamps >= START + 54e9) & (kinds == kind))[0]
        if value is None:
            kinds[one] = Kind.NO_POSITION
        else:
            values[one] = value
        return Arrivals(kinds, stamps, values)

    def lost(self, samples):
        found = middles(taken_by(37, samples))
        assert any(64 < one < 68 for one in found)
        return not any(52 < one < 56 for one in found)

    def test_without_harm_it_is_there(self):
        assert not self.lost(arrivals(*WHOLE))

    @pytest.mark.parametrize(
        ("kind", "value"),
        [
            (Kind.POSITION, None),
            (Kind.POSITION, math.nan),
            (Kind.PRESSURE, math.inf),
        ],
    )
    def test_a_bad_sample_in_it(self, kind, value):
        assert self.lost(self.harmed(arrivals(*WHOLE), kind, value))

    def test_a_pressure_outside_the_sensor(self):
        valve = replace(VALVE, pressure_maximum=250e3)
        samples = self.harmed(arrivals(*WHOLE), Kind.PRESSURE, 300e3)
        assert not any(52 < one < 56 for one in middles(taken_by(37, samples, valve)))

    def test_a_gap_in_it(self):
        keep = np.abs((WHOLE[0] - START) / 1e9 - 54.0) > 0.5
        assert self.lost(arrivals(*(one[keep] for one in WHOLE)))

    @pytest.mark.timeout(20)
    def test_a_clock_that_is_set_ten_years_ahead_in_it(self):
        """What lies between is no motion: cut into pieces of ten seconds it had 30 million."""
        stamps, ahead = WHOLE[0].copy(), 3 * 10**17
        stamps[stamps > START + 54e9] += ahead
        found = taken_by(37, arrivals(stamps, *WHOLE[1:]))
        assert all(one.end - one.begin < 4e9 for one in found)
        begins = [(one.begin - ahead * (one.begin > START + ahead) - START) / 1e9 for one in found]
        assert not any(52 < one < 56 for one in begins)
        assert any(64 < one < 68 for one in begins)

    def test_stamps_that_go_back(self):
        stamps = WHOLE[0].copy()
        stamps[stamps > START + 54e9] -= 20_000_000_000
        found = taken_by(37, arrivals(stamps, *WHOLE[1:]))
        assert all(one.end - one.begin < 4e9 for one in found)
        assert all(friction_of(one) == pytest.approx(FRICTION, rel=2e-3) for one in found)

    @pytest.mark.parametrize("rate", [20.0, 1000.0])
    def test_a_repeated_stamp_a_second_costs_nothing(self, rate):
        """At any rate."""
        stamps, *signal = signals(PLACES, FRICTION, rate=rate)
        second = round(rate)
        twice = np.sort(np.concatenate((np.arange(stamps.size), np.arange(0, stamps.size, second))))
        usual, found = (
            taken_by(37, arrivals(*columns))
            for columns in ((stamps, *signal), (stamps[twice], *(one[twice] for one in signal)))
        )
        assert len(found) == len(usual) >= 6
        assert all(friction_of(one) == pytest.approx(FRICTION, rel=5e-3) for one in found)

    def test_what_is_forgotten_in_it(self):
        stream, found = MoveStream(VALVE), []
        for part in parts(arrivals(*WHOLE), range(0, 2 * WHOLE[0].size, 40)):
            found += stream.take(part)
            if START + 53.9e9 < part.stamps[-1:].sum() < START + 55e9:
                stream.forget()
        assert not any(52 < one < 56 for one in middles(found))
        assert any(64 < one < 68 for one in middles(found))

    def test_a_stem_at_rest_under_noise(self):
        random = np.random.default_rng(1)
        stamps = START + np.arange(12_000, dtype=np.int64) * 50_000_000
        position = 0.01 + 20e-6 * random.standard_normal(stamps.size)
        pressure = 9e4 + 2e4 * np.sin(np.arange(stamps.size) / 40)
        assert taken_by(400, arrivals(stamps, pressure, position)) == []

    def test_the_stops(self):
        """On a stop the pressure is that of the stop, not of friction."""
        places = np.array([0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5]) * VALVE.travel
        stamps, pressure, position = signals(places, FRICTION, moving=4.0, rate=50.0)
        pressure[position < 0.005 * VALVE.travel] = 0.0
        found = taken_by(80, arrivals(stamps, pressure, position))
        assert found
        for move in found:
            assert friction_of(move) == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("same", [True, False])
def test_memory_is_bounded(same):
    """Whether a signal stays away for an hour, or all stamps are one."""
    stream = MoveStream(VALVE)
    stamps = START + np.arange(72_000, dtype=np.int64) * (0 if same else 50_000_000)
    values = np.full(stamps.size, 0.01)
    kinds = np.full(stamps.size, Kind.POSITION, np.uint8)
    for part in parts(Arrivals(kinds, stamps, values), range(0, stamps.size, 400)):
        assert stream.take(part) == ()
        assert stream.size <= 50_400


def swept(time, position):
    """Arrivals of a stem at these positions, in balance with the pressure."""
    way = np.sign(np.gradient(position))
    pressure = (SPRING * position + PRELOAD + way * FRICTION) / VALVE.diaphragm_area
    stamps = START + np.round(time * 1e9).astype(np.int64)
    return arrivals(stamps, pressure + VALVE.pressure_reference, position)


def test_a_turn_without_a_rest_makes_two_moves():
    """A quick stroke up and down, at 50 Hz."""
    time = np.arange(0, 60, 0.02)
    phase = np.clip(time - 30, 0, 4)
    position = 0.01 + 2e-3 * np.sin(np.pi * phase / 4)
    found = taken_by(100, swept(time, position))
    assert [one.direction for one in found] == [1, -1]
    for move in found:
        assert friction_of(move) == pytest.approx(FRICTION, rel=0.01)


@pytest.mark.parametrize("period", [0.004, 0.1])
def test_the_parts_of_a_slow_stroke_follow_each_other(period):
    """A minute up and a minute down are cut, and no part overlaps the one before it."""
    time = np.arange(0, 120, period)
    position = 2e-3 + 0.02 * np.abs((time / 60) % 2 - 1)
    found = taken_by(50, swept(time, position))
    assert found[-1].end > START + 105e9
    pauses = [then.begin - one.end for one, then in pairwise(found)]
    assert min(pauses) >= 0, pauses
    assert max(pauses) <= 0.5e9, pauses


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"end": 0}, "must end after it begins"),
        ({"stop": 1e-3}, "distance"),
        ({"force": math.nan}, "force"),
        ({"speed": -1.0}, "speed"),
    ],
)
def test_an_impossible_move_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        replace(GOOD, **changes)


def test_columns():
    table = Moves.of([GOOD, replace(GOOD, begin=20, end=1_000_000_000, stop=0.0)])
    assert table.time.tolist() == [1e-8, 1.0]
    assert table.direction.tolist() == [1.0, -1.0]
    assert len(table[table.direction > 0]) == 1
    assert len(Moves.of([])) == 0


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


def test_back_and_ahead():
    assert problem(START - SECOND) == problem(0) == "earlier than those stored"
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
    assert is_clock_reset(move, now + ahead * 60 * SECOND, now) is expected


WEIGHTS = np.random.default_rng(1)


@pytest.fixture(scope="module", params=[0.4, 3.0], ids=["one preload", "preloads by the hour"])
def design(request):
    moves = Moves.of(made_moves(request.param, lambda hour: 300.0 + 20.0 * hour, noise=10.0))
    plain, scales = design_of(moves, blocks_of(moves))
    precision = priors(plain, scales, moves, VALVE.travel)
    return with_onsets(plain, moves, scales.place), precision


def test_its_parts_are_those_of_all_rows(design):
    design, precision = design
    rows, weight = design.rows(), WEIGHTS.uniform(0.5, 2.0, design.force.size)
    normal = (rows * weight[:, None]).T @ rows + np.diag(precision)
    right = rows.T @ (weight * design.force)
    values = np.linalg.solve(normal, right)
    parts = design.normal(weight, precision)
    assert design.right(weight * design.force) == pytest.approx(right)
    assert parts.solved(right) == pytest.approx(values, rel=1e-5, abs=0.05)
    assert design.forces(values) == pytest.approx(rows @ values)
    inverse = np.linalg.inv(normal)[design.shared :, design.shared :]
    assert parts.friction_covariance() == pytest.approx(inverse, rel=1e-5)


def test_blocks_hold_both_ways_and_are_bounded_in_number():
    moves = Moves.of(made_moves(40.0, lambda _: 300.0, period=60.0))
    fine, coarse = blocks_of(moves), blocks_of(moves, 30)
    assert fine[-1] > 100
    assert coarse[-1] < 30
    for blocks in (fine, coarse):
        assert set(np.diff(blocks)) == {0, 1}
        for way in (-1, 1):
            assert np.bincount(blocks[moves.direction == way]).min() >= 4


HOUR = 3600e9
EXACT = IdentificationSettings(timing_uncertainty=0.0)


def constant(value):
    return lambda _: value


def by_the_hour(moves, settings=None):
    return evidence_of(moves, VALVE, settings)


class TestEstimate:
    @pytest.mark.parametrize("seed", range(5))
    def test_an_hour_gives_what_is_true(self, seed):
        found = by_the_hour(made_moves(1.0, constant(300.0), seed))
        expected = {
            "sliding_friction": 300.0,
            "static_friction": 300.0,
            "spring_constant": SPRING,
            "spring_preload": PRELOAD,
            "dead_band": 600.0 / SPRING,
        }
        for name, value in expected.items():
            one = found.parameters[name]
            assert abs(one.value - value) <= one.half_width, name
        sliding = found.parameters["sliding_friction"]
        assert sliding.value == pytest.approx(300.0, rel=0.02)
        assert sliding.half_width < 0.1 * 300.0
        assert found.change is None
        assert found.since == START
        assert math.isnan(found.parameters["coulomb_friction"].value)  # is not split off

    def test_few_moves_are_withheld_with_their_number(self):
        found = by_the_hour(made_moves(0.1, constant(300.0)))
        one = found.parameters["sliding_friction"]
        assert math.isnan(one.value)
        assert one.verdict is Verdict.NOT_IDENTIFIABLE
        assert "moves up and" in one.reason
        assert "leave the valve in service" in one.reason
        assert not found.is_known

    def test_none_at_all(self):
        found = by_the_hour([])
        assert (found.moves, found.since, found.until) == (0, 0, 0)
        assert not found.is_known

    def test_a_lag_of_the_signals_is_in_the_interval(self):
        """100 N/s by 0.04 s are 4 N, and twice that at 95 %."""
        moves = made_moves(1.0, constant(300.0))
        plain, exact = (
            by_the_hour(moves, one).parameters["sliding_friction"].half_width
            for one in (None, EXACT)
        )
        assert math.sqrt(plain**2 - exact**2) == pytest.approx(8.0, rel=0.02)

    def test_calibration_widens_and_can_be_left_out(self):
        moves = made_moves(1.0, constant(300.0))
        settings = IdentificationSettings(area_uncertainty=0.05)
        one = by_the_hour(moves, settings).parameters["sliding_friction"]
        bare = by_the_hour(moves).parameters["sliding_friction"]
        assert one.without_calibration.half_width == pytest.approx(bare.half_width)
        added = math.sqrt(one.half_width**2 - bare.half_width**2)
        assert added == pytest.approx(2 * 0.05 * bare.value)

    def test_a_known_spring_is_used(self):
        """Set points that hardly leave their place say little of the spring."""
        moves = made_moves(1.0, constant(300.0), low=0.484, high=0.516)
        settings = IdentificationSettings(fixed={"spring_constant": SPRING})
        free, known = by_the_hour(moves), by_the_hour(moves, settings)
        assert free.parameters["dead_band"].verdict is Verdict.WEAK
        assert known.parameters["spring_constant"].verdict is Verdict.FIXED
        one = known.parameters["dead_band"]
        assert one.value == pytest.approx(600.0 / SPRING, rel=0.03)
        assert one.half_width < 0.1 * one.value

    def test_without_a_spring_there_is_no_dead_band(self):
        """Places within 2 % of the travel: friction that bends with the speed hides it."""
        moves = made_moves(1.0, constant(900.0), step=0.01 * VALVE.travel, low=0.49, high=0.51)
        settings = IdentificationSettings(fixed={"spring_constant": SPRING})
        free, known = (by_the_hour(moves, one).parameters["dead_band"] for one in (None, settings))
        assert free.verdict is Verdict.NOT_IDENTIFIABLE
        assert "fixed.spring_constant" in free.reason
        assert known.value == pytest.approx(1800.0 / SPRING, rel=0.03)

    def test_outliers_hardly_count(self):
        moves = made_moves(1.0, constant(300.0))
        for place in range(5, 300, 40):
            object.__setattr__(moves[place], "force", moves[place].force + 2000.0)
        one = by_the_hour(moves).parameters["sliding_friction"]
        assert one.value == pytest.approx(300.0, rel=0.03)

    @pytest.mark.parametrize("period", [300.0, 3600.0])
    def test_weeks_of_a_quiet_valve_cost_no_more_than_hours_of_a_busy_one(self, period):
        moves = made_moves(MOST_MOVES * period / 3600, constant(300.0), period=period)
        assert balance_of(Moves.of(moves), 0.04, VALVE.travel).values.size <= 70
        found = by_the_hour(moves).parameters["sliding_friction"]
        assert found.value == pytest.approx(300.0, rel=0.02)

    @settings(max_examples=15, deadline=None)
    @given(st.floats(0.01, 100.0))
    def test_forces_in_another_scale_give_numbers_in_that_scale(self, scale):
        moves = made_moves(1.0, constant(300.0))
        larger = made_moves(1.0, constant(300.0))
        for one in larger:
            for name in ("force", "force_rate", "onset_force", "onset_rate"):
                object.__setattr__(one, name, scale * getattr(one, name))
        before, after = by_the_hour(moves), by_the_hour(larger)
        for name in ("sliding_friction", "static_friction", "spring_constant"):
            first, second = before.parameters[name], after.parameters[name]
            assert second.value == pytest.approx(scale * first.value, rel=1e-6)
            assert second.half_width == pytest.approx(scale * first.half_width, rel=1e-3)


class TestChange:
    def test_half_more_is_declared_within_an_hour(self):
        found = by_the_hour(made_moves(3.95, changing_at(3.0)))
        change = found.change
        assert change.low <= 1.5 <= change.high
        assert change.earliest <= START + 3.0 * HOUR <= change.latest
        assert change.latest - change.earliest < HOUR
        one = found.parameters["sliding_friction"]
        assert one.value == pytest.approx(450.0, rel=0.03)
        assert found.since >= START + 2.8 * HOUR

    def test_it_is_found_as_soon_after_a_week_as_after_a_day(self):
        """A move every 150 s: 24 moves, and a date that is as narrow as the blocks."""
        moves = made_moves(169.0, changing_at(168.0), period=150.0, noise=12.0)
        change = by_the_hour(moves[-MOST_MOVES:]).change
        assert change.low <= 1.5 <= change.high
        assert change.earliest <= START + 168.0 * HOUR <= change.latest
        assert change.latest - change.earliest < 2 * HOUR

    @pytest.mark.parametrize("minutes", range(0, 60, 7))
    def test_its_date_and_ratio_hold_as_soon_as_it_is_declared(self, minutes):
        """Wherever in a block it lies; a block that holds both frictions tells neither."""
        begin = 2 + minutes / 60
        for hours in (0.4, 0.5, 0.6):
            change = by_the_hour(made_moves(begin + hours, changing_at(begin))).change
            if change is not None:
                assert change.low <= 1.5 <= change.high
                assert change.earliest <= START + begin * HOUR <= change.latest
        assert change is not None

    def test_a_fall_too(self):
        found = by_the_hour(made_moves(4.0, changing_at(3.0, after=120.0)))
        assert found.change.ratio == pytest.approx(0.4, rel=0.05)

    def test_the_past_is_let_go_while_friction_creeps_up(self):
        """10 % in an hour: no step, yet the estimate is never a tenth behind."""
        for hours in (4.0, 6.0, 8.0):
            found = by_the_hour(made_moves(hours, lambda hour: 300.0 * (1 + 0.05 * hour)))
            now = 300.0 * (1 + 0.05 * hours)
            assert found.parameters["sliding_friction"].value == pytest.approx(now, rel=0.1)

    @pytest.mark.parametrize("seed", range(10))
    def test_what_is_no_change(self, seed):
        """Preload that drifts with the day, a viscous friction, and new ranges of the set point."""
        moves = made_moves(
            10.0,
            constant(300.0),
            seed,
            offset=lambda hour: 60.0 * math.sin(hour / 4),
            viscous=4e4,
            noise=12.0,
        )
        middle = 0.5 * VALVE.travel
        moves = [
            one
            for one in moves
            if (0.5 * (one.start + one.stop) > middle) == bool(int((one.end - START) // HOUR) % 2)
        ]
        assert len(moves) > 1000
        found = by_the_hour(moves)
        assert found.change is None
        one = found.parameters["sliding_friction"]
        assert abs(one.value - 300.0 - 4e4 * found.sliding_speed) < one.half_width

    def test_faster_moves_are_no_change(self):
        slow = made_moves(4.0, constant(300.0), viscous=8e4)
        for one in slow[600:]:
            way, more = one.direction, 8e4 * one.speed
            object.__setattr__(one, "speed", 2 * one.speed)
            object.__setattr__(one, "force", one.force + way * more)
        assert by_the_hour(slow).change is None

    @pytest.mark.parametrize("size", [0.5, 2.0, 10.0])
    @pytest.mark.parametrize("seed", range(4))
    def test_steps_of_the_process_force_are_no_change(self, seed, size):
        """Of up to ten times F_c, each within a move; friction grown by half is told all the same.

        A pressure on the plug moves both branches of the loop, friction moves them apart.
        """
        random = np.random.default_rng([seed, 5])
        steps = np.sort(random.uniform(0.3, 3.9, 9))
        levels = np.append(0.0, random.uniform(-size, size, steps.size)) * 300.0

        def process(hour):
            """Mean force over the move of 12 s that begins at an hour."""
            return float(levels[np.searchsorted(steps, hour + np.arange(10) / 3600)].mean())

        steady = by_the_hour(made_moves(4.0, constant(300.0), seed, noise=12.0, offset=process))
        assert steady.changes == ()
        one = steady.parameters["sliding_friction"]
        assert one.value == pytest.approx(300.0, rel=0.02)
        assert one.half_width < 0.1 * 300.0
        grown = made_moves(4.0, changing_at(3.0), seed, noise=12.0, offset=process)
        (change,) = by_the_hour(grown).changes
        assert change.low <= 1.5 <= change.high
        assert change.earliest <= START + 3.0 * HOUR <= change.latest
        assert change.latest - change.earliest < HOUR

    @pytest.mark.parametrize("seed", range(3))
    def test_a_step_that_a_loop_works_off_in_one_direction_is_no_change(self, seed):
        """Each step pushes the stem away by a fifth of the travel, and 25 moves bring it back.

        By the hours alone, the first moves of a level have one direction, which does not tell
        preload and friction apart.
        """
        random = np.random.default_rng([seed, 6])
        made, place, process, time = [], 0.5, 0.0, START
        ways: list[float] = []
        for number in range(1200):
            step = 0.0
            if number % 190 == 100:
                step = random.choice([-1.0, 1.0]) * random.uniform(1200.0, 2000.0)
                ways = [float(np.sign(step))] * 25  # a force against the pressure pushes down
            way = -np.sign(step) or (ways.pop() if ways else random.choice([-1.0, 1.0]))
            if not ways and not step:
                way = np.sign(0.5 - place) if abs(place - 0.5) > 0.1 else way
            far = 0.2 if step else 0.008
            start, stop = place * VALVE.travel, (place + way * far) * VALVE.travel
            force = 2e5 * 0.5 * (start + stop) + 1e3 + process + 0.5 * step + way * 300.0
            end = time + 4_000_000_000
            force, speed = force + random.normal(0.0, 5.0), 2e-2 if step else 1e-3
            made.append(Move(time, end, start, stop, force, 0.0, speed))
            place, process, time = place + way * far, process + step, time + 60_000_000_000
        found = evidence_of(made, VALVE)
        assert found.changes == ()
        one = found.parameters["sliding_friction"]
        assert abs(one.value - 300.0) < one.half_width < 0.1 * 300.0
        assert found.sliding_speed == pytest.approx(1e-3)  # the steps are not those of the loop
        for last in range(300, 1200, 50):
            assert evidence_of(made[:last], VALVE).changes == ()

    def test_the_ratio_of_a_change_holds_a_lag(self):
        """30 ms of late pressure take 0.03 s × 2000 N/s from 300 N and from 450 N alike."""
        late = made_moves(4.0, changing_at(3.0))
        for one in late:
            object.__setattr__(one, "force_rate", 2000.0 * one.direction)
            object.__setattr__(one, "force", one.force - 0.03 * one.force_rate)
        change = by_the_hour(late).change
        assert change.ratio == pytest.approx(390.0 / 240.0, rel=0.02)
        assert change.low <= 1.5 <= change.high
        assert by_the_hour(late, EXACT).change.low > 1.5

    def test_the_levels_of_the_preload_are_those_between_the_steps(self):
        step = {"offset": lambda hour: 600.0 if 1.0 <= hour < 2.0 else 0.0}
        made = made_moves(3.0, changing_at(1.5), noise=12.0, **step)
        numbers, largest = levels_of(Moves.of(made))
        assert np.flatnonzero(np.diff(numbers)).tolist() == [299, 599]
        assert largest == pytest.approx(600.0, rel=0.1)

    def test_the_series_is_that_of_the_blocks(self):
        series = series_of(Moves.of(made_moves(2.0, constant(300.0))), VALVE.travel)
        assert series.friction == pytest.approx(300.0, rel=0.02)
        assert 10 <= series.friction.size <= 12
