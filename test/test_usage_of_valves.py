# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Usage counted from samples: exact on made signals, and against second forms of the same count."""

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, SineWave, simulate
from valve_friction_ros.streams import DAY, Samples
from valve_friction_ros.usage import (
    BINS,
    Pace,
    Usage,
    UsageCounter,
    UsageLimits,
    UsedDay,
    ValveUsage,
    limit_states,
    warned_limits,
)

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
TRAVEL = 0.02
BAND = 0.01 * TRAVEL


def stamps_of(count, period=0.01, start=START):
    return start + np.arange(count, dtype=np.int64) * round(period * SECOND)


def counted(position, stamps=None, travel=TRAVEL, cuts=(), share=0.01):
    """Usage by days, of samples that come in blocks between the cuts."""
    position = np.asarray(position, dtype=float)
    stamps = stamps_of(position.size) if stamps is None else stamps
    counter = UsageCounter(travel, share)
    for begin, end in itertools.pairwise([0, *sorted(cuts), position.size]):
        counter.add(Samples(stamps[begin:end], position[begin:end]))
    counter.flush()
    return counter.drain()


def usage_of(*arguments, **named):
    return sum(counted(*arguments, **named).values(), Usage())


def ramp(*corners, steps=50):
    parts = [np.linspace(a, b, steps, endpoint=False) for a, b in itertools.pairwise(corners)]
    return np.concatenate((*parts, [corners[-1]]))


def turning_points(position, band):
    """The naive form: sample by sample, the points from which the stem has come back by a band."""
    points, low, high, direction = [], position[0], position[0], 0
    for one in position:
        if direction == 0:
            low, high = min(low, one), max(high, one)
            if high - low > band:
                direction = 1 if one == high else -1
                points = [low if direction > 0 else high]
                far = one
        elif direction * (one - far) > 0:
            far = one
        elif direction * (far - one) > band:
            points.append(far)
            direction, far = -direction, one
    return [*points, far] if direction else []


class TestExact:
    def test_strokes(self):
        """Three strokes and two reversals; two dips of less and more than the dead band."""
        usage = usage_of(ramp(0.0, 0.01, 0.01 - 0.9 * BAND, 0.015, 0.015 - 1.5 * BAND, 0.018))
        assert usage.distance == pytest.approx(0.018 + 2 * 1.5 * BAND, rel=1e-12)
        assert usage.reversals == 2

    def test_the_stroke_under_way_counts(self):
        assert usage_of(ramp(0.0, 0.004)).distance == pytest.approx(0.004, rel=1e-12)
        assert usage_of(ramp(0.004, 0.001)).distance == pytest.approx(0.003, rel=1e-12)
        usage = usage_of(ramp(*[0.0, TRAVEL] * 10))
        assert usage.strokes(TRAVEL) == pytest.approx(19, rel=1e-12)
        assert usage.reversals == 18
        assert math.isnan(usage.strokes(math.inf))

    def test_time_at_each_place(self):
        """A sample stands for the pause behind it; each bin holds 5 % of the travel."""
        position = np.repeat([0.0, 0.0011, 0.0199, 0.025, -0.004], 100)
        usage = usage_of(position)
        times = [round(one / SECOND, 9) for one in usage.histogram]
        assert times == [1.99, 1.0, *[0.0] * 17, 2.0]
        assert usage.time_watched == 499 * SECOND // 100
        assert usage.time_near_seat() == 199 * SECOND // 100
        assert usage.time_near_seat(seat_is_at_travel=True) == 2 * SECOND

    def test_breakaways(self):
        """Slips of 1.5 % after rests of three seconds; a creep and a smaller slip are none."""
        slips = np.repeat(0.005 + 1.5 * BAND * np.arange(6), 300)
        creep = slips[-1] + np.linspace(0, 5 * BAND, 2000)
        small = np.repeat([creep[-1], creep[-1] + 0.5 * BAND], 300)
        assert usage_of(slips).breakaways == 5
        assert usage_of(np.concatenate((slips, creep, small))).breakaways == 5
        moving = 0.01 + 0.009 * np.sin(np.arange(3000) / 100)
        assert usage_of(moving).breakaways == 0

    def test_days(self):
        stamps = stamps_of(401, 0.5, start=20_000 * DAY - 100 * SECOND)
        days = counted(ramp(0.0, TRAVEL, steps=400), stamps)
        assert set(days) == {19_999, 20_000}
        assert days[19_999].time_watched == pytest.approx(100 * SECOND, abs=SECOND)
        assert days[20_000].distance == pytest.approx(TRAVEL / 2, rel=0.01)
        assert sum(one.distance for one in days.values()) == pytest.approx(TRAVEL, rel=1e-12)


class TestTrouble:
    def test_a_gap_counts_its_displacement_and_no_time(self):
        stamps = stamps_of(600)
        stamps[300:] += 3600 * SECOND
        usage = usage_of(np.repeat([0.002, 0.015], 300), stamps)
        assert usage.distance == pytest.approx(0.013, rel=1e-12)
        assert usage.time_watched == 598 * SECOND // 100
        assert usage.breakaways == 0

    def test_a_clock_that_goes_back_counts_neither(self):
        stamps = np.concatenate((stamps_of(300), stamps_of(300, start=START - 40 * SECOND)))
        usage = usage_of(np.repeat([0.002, 0.015], 300), stamps)
        assert usage == Usage(histogram=usage.histogram)
        assert usage.time_watched == 598 * SECOND // 100

    def test_what_is_no_position_is_left_out(self):
        position = ramp(0.0, 0.01)
        stamps = stamps_of(position.size, 0.01)
        bad = np.array([math.nan, math.inf, -math.inf, 25.0, -0.011])
        spoilt = np.insert(position, 25, bad)
        between = stamps[24] + (1 + np.arange(bad.size)) * SECOND // 1000
        assert usage_of(spoilt, np.insert(stamps, 25, between)) == usage_of(position, stamps)

    def test_repeated_stamps_are_left_out(self):
        position = ramp(0.0, 0.01, steps=400)
        stamps = stamps_of(position.size)
        repeated = np.insert(position, 256, 0.019), np.insert(stamps, 256, stamps[255])
        assert usage_of(*repeated) == usage_of(position, stamps)

    @pytest.mark.parametrize("travel", [0.0, -1.0, math.inf, math.nan])
    def test_no_travel(self, travel):
        with pytest.raises(ValueError, match="travel"):
            UsageCounter(travel)

    @pytest.mark.parametrize(
        "wrong",
        [{"distance": -1.0}, {"reversals": -1}, {"distance": math.nan}, {"histogram": (1,)}],
    )
    def test_impossible_usages(self, wrong):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Usage(**wrong)


class TestSensor:
    @pytest.mark.parametrize("seed", range(2))
    @pytest.mark.parametrize("deviation", [0.0005, 0.002, 0.02])  # of the travel
    def test_noise_counts_nothing(self, seed, deviation):
        noise = np.random.default_rng(seed).normal(0.0, deviation * TRAVEL, 100_000)
        usage = usage_of(0.01 + noise, stamps_of(noise.size, 0.001))
        assert (usage.distance, usage.reversals, usage.breakaways) == (0.0, 0, 0)
        assert usage.time_watched == 99_999 * SECOND // 1000

    def test_a_coarse_converter_counts_nothing(self):
        """Codes of 1.5 % of the travel, one of which the stem lies at the edge of."""
        step = 0.015 * TRAVEL
        noise = np.random.default_rng(5).normal(0.0, 0.2 * step, 100_000)
        usage = usage_of(np.round((0.01 + 0.5 * step + noise) / step) * step)
        assert (usage.distance, usage.reversals, usage.breakaways) == (0.0, 0, 0)

    def test_the_dead_band_is_raised_only_where_the_sensor_demands_it(self):
        rng = np.random.default_rng(6)
        for deviation, raised in ((0.0002, False), (0.002, True)):
            counter = UsageCounter(TRAVEL)
            position = 0.01 + rng.normal(0.0, deviation * TRAVEL, 10_000)
            counter.add(Samples(stamps_of(position.size), position))
            assert counter.is_raised is raised
            expected = 14 * deviation * TRAVEL if raised else BAND
            assert counter.band == pytest.approx(expected, rel=0.2 if raised else 0)

    @pytest.mark.parametrize("period", [0.001, 0.02, 0.2, 1.0])
    def test_motion_is_no_noise(self, period):
        """A sine of 10 s and 50 % of the travel, down to ten samples a period."""
        time = np.arange(0, 1200, period)
        position = 0.01 + 0.25 * TRAVEL * np.sin(2 * np.pi * time / 10)
        usage = usage_of(position, stamps_of(time.size, period))
        points = turning_points(position, BAND)
        assert usage.reversals == len(points) - 2
        assert usage.distance == pytest.approx(sum(np.abs(np.diff(points))), rel=1e-9)


walks = st.lists(
    st.tuples(st.floats(-0.003, 0.003), st.integers(1, 40)), min_size=1, max_size=60
).map(lambda steps: 0.01 + np.cumsum(np.repeat([a / n for a, n in steps], [n for _, n in steps])))


class TestProperties:
    @settings(max_examples=60, deadline=None)
    @given(walks, st.lists(st.integers(0, 2000), max_size=12), st.integers(0, 3), st.booleans())
    def test_how_samples_come_changes_nothing(self, position, cuts, seed, is_fast):
        """Exactly: also with jitter, gaps, jumps of the clock and bad readings."""
        rng = np.random.default_rng(seed)
        stamps = START + np.cumsum(
            rng.choice(
                [0, 5, 10, 11, 3000, -700], position.size, p=[0.02, 0.3, 0.3, 0.36, 0.01, 0.01]
            )
        ) * (100_000 if is_fast else 1_000_000)
        position = np.where(rng.random(position.size) < 0.01, math.nan, position)
        cuts = [cut for cut in cuts if cut < position.size]
        assert counted(position, stamps, cuts=cuts) == counted(position, stamps)

    @settings(max_examples=60, deadline=None)
    @given(walks)
    @example(ramp(0.0, 0.01, 0.002, 0.012))
    def test_distance_and_reversals_are_those_of_the_turning_points(self, position):
        position = position[:256]  # one block has one dead band
        counter = UsageCounter(10.0, 1e-4)  # a wide travel: nothing is out of its reach
        counter.add(Samples(stamps_of(position.size), position))
        counter.flush()
        (usage,) = counter.drain().values()
        points = turning_points(position, counter.band)
        strokes = np.abs(np.diff(points))
        assert usage.distance == pytest.approx(strokes.sum(), abs=1e-12)
        assert usage.reversals == max(strokes.size - 1, 0)

    @settings(max_examples=40, deadline=None)
    @given(st.integers(0, 2**32 - 1), st.floats(1e-3, 0.999), st.floats(0.0, TRAVEL))
    def test_what_stays_within_the_dead_band_counts_nothing(self, seed, share, place):
        rng = np.random.default_rng(seed)
        position = place + share * BAND * (rng.random(3000) - 0.5)
        usage = usage_of(position)
        assert (usage.distance, usage.reversals, usage.breakaways) == (0.0, 0, 0)


def test_the_distance_of_a_simulated_valve():
    """The true distance is ∫|ẋ|dt of the simulated stem, which no counter has seen."""
    period, count = 1e-3, 120_000
    time = np.arange(count) * period
    pressure = SineWave(period=20.0).sample(time)
    stem = simulate(BENCH_VALVE, HIGH_FRICTION, pressure, period)
    true = float(np.sum(np.abs(stem.velocity)) * period)
    counter = UsageCounter(BENCH_VALVE.travel)
    noise = np.random.default_rng(3).normal(0.0, 20e-6, count)
    counter.add(Samples(stamps_of(count, period), stem.position + noise))
    counter.flush()
    usage = sum(counter.drain().values(), Usage())
    assert usage.distance == pytest.approx(true, rel=0.01)
    turns = int(np.sum(np.diff(np.sign(stem.velocity[stem.velocity != 0])) != 0))
    assert usage.reversals == turns


HOUR = DAY // 24
TODAY = 20_000
NOW = TODAY * DAY
PACE = Pace(2.0, 0.0)


def usage(distance=1.0, reversals=10, hours=12):
    return Usage(distance, reversals, 3, (0, hours * HOUR, *[0] * (BINS - 2)))


def days(count, renewal=0, first=TODAY - 100, **figures):
    return [UsedDay(first + n, renewal, usage(**figures)) for n in range(count)]


def test_sums_since_the_renewal_and_in_all():
    """A packing before, and a day with both packings."""
    found = ValveUsage.of([*days(3, 7, TODAY), *days(5), *days(2, 0, TODAY - 1)], renewal=7)
    assert found.since_renewal.distance == 3
    assert found.total == Usage(10, 100, 30, (0, 120 * HOUR, *[0] * (BINS - 2)))
    assert [one.renewal for one in found.days] == [0] * 7 + [7] * 3
    assert ValveUsage.of(days(5), renewal=7).since_renewal == Usage()


def test_a_day_that_occurs_twice_is_added_up():
    assert ValveUsage.of(days(1) * 2).days == (UsedDay(TODAY - 100, 0, usage() + usage()),)


def test_condensed_days_are_the_same_usage():
    whole = ValveUsage.of([*days(400), *days(60, 7, TODAY)], renewal=7)
    short = whole.condensed()
    assert len(short.days) == 1 + 1 + 31
    assert short.total == whole.total
    assert short.since_renewal == whole.since_renewal
    assert short.pace() == whole.pace()
    assert short.condensed() == short
    few = ValveUsage.of(days(3))
    assert few.condensed() == few


OLD, NEW = days(50, distance=9.0), days(14, first=TODAY, distance=0.5)


@pytest.mark.parametrize(
    ("used", "renewal", "pace"),
    [
        (days(20), 0, Pace(2.0, 20.0)),  # watched for half of each day
        (OLD + NEW, 0, Pace(1.0, 20.0)),  # of the last days
        (days(1, hours=23), 0, None),  # not before a day is watched
        (days(1, hours=24), 0, Pace(1.0, 10.0)),
        (days(20), 7, None),  # of this packing only
    ],
)
def test_the_pace_is_that_of_a_whole_day(used, renewal, pace):
    assert ValveUsage.of(used, renewal=renewal).pace() == pace


class TestLimits:
    def state(self, limits, used=None, pace=PACE):
        (found,) = limit_states(used or usage(100.0), pace, limits, NOW)  # and none for 0
        return found

    def test_expected_date(self):
        state = self.state(UsageLimits(travel=150.0))
        assert (state.used, state.limit, state.is_reached) == (100.0, 150.0, False)
        assert state.expected == NOW + 25 * DAY
        assert state.warns
        assert state.message == (
            "packing life: 100 m of 150 m travelled (travel_limit), expected on 2024-10-29: "
            "replace the packing, then call ~/reset_usage"
        )

    def test_reached(self):
        state = self.state(UsageLimits(reversals=10.0))
        assert state.is_reached
        assert state.warns
        assert state.expected is None
        assert "10 of 10 reversals (reversal_limit), limit reached: replace" in state.message

    @pytest.mark.parametrize("pace", [None, Pace(0.0, 0.0), Pace(1e-9, 0.0)])
    def test_no_date(self, pace):
        """Without a pace, or for one that reaches no date of the calendar."""
        state = self.state(UsageLimits(travel=150.0), pace=pace)
        assert state.expected is None
        assert not state.warns

    def test_no_warning_a_month_before_but_what_has_warned_goes_on(self):
        state = self.state(UsageLimits(travel=162.0))
        assert state.expected == NOW + 31 * DAY
        assert not state.warns
        assert state._replace(has_warned=True).warns

    def test_what_has_warned_and_has_no_date_is_near_and_not_reached(self):
        near = self.state(UsageLimits(travel=110.0), pace=None)._replace(has_warned=True)
        assert near.warns
        assert near.message == (
            "packing life: 100 m of 110 m travelled (travel_limit), close to its limit "
            "(previously warned): replace the packing, then call ~/reset_usage"
        )

    def test_what_has_warned_is_found_again(self):
        """It warned at 3 m a day; then the valve rests."""
        used = [*days(20, distance=3.0), *days(28, first=TODAY, distance=0.0)]
        limits = UsageLimits(travel=100.0 + 2 * 60.0, reversals=1e6)
        found = ValveUsage.of(used)
        (travel, _) = limit_states(found.since_renewal, found.pace(), limits, NOW)
        assert not travel.warns
        assert warned_limits(found, limits) == {"travel_limit"}
        assert warned_limits(found, UsageLimits(travel=1e4)) == set()
        assert warned_limits(ValveUsage.of(used, renewal=7), limits) == set()

    @pytest.mark.parametrize("name", ["travel", "reversals"])
    def test_negative(self, name):
        with pytest.raises(ValueError, match="limit must not be negative"):
            UsageLimits(**{name: -1.0})


def test_it_is_shown_as_plain_values():
    shown = ValveUsage.of([*days(2), *days(1, 7, TODAY)], renewal=7).to_dict()
    assert json.loads(json.dumps(shown)) == shown
    assert shown["total"]["distance"] == 3.0
    assert shown["since_renewal"]["time_watched"] == 12 * 3600
    assert shown["days"][0]["day"] == (TODAY - 100) * DAY
    assert shown["renewal"] == 7
