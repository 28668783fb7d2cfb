# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""No alarm flickers: what the valve shows follows from intervals, and errs once a year at most."""

import itertools
import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    Level,
    Ratio,
    Side,
    StatusSignal,
    diagnose,
)
from valve_friction_ros.health.alarm_conditions import Delay, FrictionHold, held_level, widening
from valve_friction_ros.health.alarms import NO_CONDITION, Condition
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionState, friction_state
from valve_friction_ros.identification import IdentificationSettings, identify_bench
from valve_friction_ros.model import BENCH_VALVE, SensorNoise
from valve_friction_ros.wording import quoted

LIMITS = FrictionLimits()
DAY = 86_400 * 10**9
YEAR = 365 * DAY
START = 1_800_000_000_000_000_000


def ratio(value, share):
    """Return a ratio with an interval that is symmetric by logarithm."""
    return Ratio.between(value, value / (1 + share), value * (1 + share))


def diagnosis(found, limits=LIMITS):
    state = friction_state(found, limits)
    return Diagnosis(state.level, StatusSignal.GOOD, quoted(state.name), found, state)


@pytest.mark.parametrize(
    ("held", "value", "share", "level"),
    [
        (Level.OK, 1.5, 0.1, Level.WARN),
        (Level.OK, 1.5, 0.3, Level.WARN),
        (Level.OK, 1.5, 0.5, Level.OK),
        (Level.OK, 1.2, 0.01, Level.OK),
        (Level.WARN, 1.5, 0.3, Level.WARN),
        (Level.WARN, 1.2, 0.1, Level.WARN),
        (Level.WARN, 1.1, 0.1, Level.OK),
        (Level.ERROR, 1.9, 0.1, Level.ERROR),
        (Level.ERROR, 1.7, 0.1, Level.WARN),
        (Level.OK, 3.0, 0.1, Level.ERROR),
        (Level.ERROR, 1.0, 0.1, Level.OK),
    ],
)
def test_a_level_is_reached_and_left_by_the_whole_interval(held, value, share, level):
    assert held_level(held, ratio(value, share), Side.HIGH, LIMITS) is level


RATIOS = st.builds(ratio, st.floats(0.01, 100), st.floats(1e-3, 10))
LEVELS = st.sampled_from([*Level])


@given(LEVELS, RATIOS, st.sampled_from([*Side]), st.floats(1, 5))
def test_the_same_look_twice_changes_nothing(held, found, side, wider):
    once = held_level(held, found, side, LIMITS, wider)
    assert held_level(once, found, side, LIMITS, wider) is once


@given(LEVELS, RATIOS)
def test_both_sides_are_alike(held, found):
    """What is high above the baseline is as low below it, where the limits are inverse."""
    inverse = Ratio.between(1 / found.value, 1 / found.high, 1 / found.low)
    high = held_level(held, found, Side.HIGH, LIMITS)
    low = held_level(held, inverse, Side.LOW, LIMITS)
    edges = (found.low * 0.8, found.high * 0.8, found.low * 0.5, found.high * 0.5)
    if all(abs(edge - 1) > 1e-9 for edge in edges):
        assert high is low


@given(LEVELS, RATIOS)
def test_a_wider_interval_never_changes_more(held, found):
    narrow = held_level(held, found, Side.HIGH, LIMITS, 1.0)
    wide = held_level(held, found, Side.HIGH, LIMITS, 2.0)
    assert abs(wide - held) <= abs(narrow - held)


def test_each_look_errs_by_its_share_of_a_year():
    """0.01 of a year's false changes: the tail of a normal distribution beyond k·1.96."""
    assert widening(4 * YEAR) == pytest.approx(1.0)
    tail = 1 - NormalDist().cdf(1.959964 * widening(DAY))
    assert tail == pytest.approx(0.01 / 365.25, rel=1e-4)
    assert math.isinf(widening(0))


@pytest.mark.parametrize("true", [1.0, 1.2, 1.24, 1.25, 1.3, 0.8, 2.0])
@pytest.mark.parametrize("every", [DAY, DAY // 24, DAY // 288])
@pytest.mark.parametrize("share", [0.03, 0.3])
def test_a_valve_that_stays_as_it_is_raises_one_alarm_a_year_at_most(true, every, share):
    """Years of looks with honest noise, wherever the friction is, also at a limit.

    Looks that show the same as the one before change nothing (a property above) and are left out.
    """
    generator = np.random.default_rng(round(1000 * true + 7 * share + every % 1000))
    count = (10 if every > DAY // 100 else 2) * YEAR // every
    spread = math.log1p(share) / 1.959964
    values = true * np.exp(spread * generator.standard_normal(count))
    side = Side.LOW if true < 1 else Side.HIGH
    half = (1 + share) ** widening(every)
    bounds, less = (0.5, 0.8, 1.25, 2.0), half / (1 + share)
    ends = (1 / half, half, 1 / less, less)
    shows = [np.searchsorted(bounds, values * end) for end in ends]
    shows.append(np.abs(np.log(values)) > 1.5 * widening(every) * math.log1p(share))
    is_new = np.any([np.diff(one, prepend=-1) != 0 for one in map(np.int8, shows)], axis=0)
    level, raised = Level.OK, []
    for index in np.flatnonzero(is_new):
        wider = widening(every) if index else 1.0
        after = held_level(level, ratio(values[index], share), side, LIMITS, wider)
        if after > Level.OK and level is Level.OK:
            raised.append(index * every // YEAR)
        level = after
    years = count * every / YEAR
    assert len(raised) <= (years if true not in (1.0, 2.0) else true - 1.0)


def test_a_friction_that_grows_is_raised_once_and_cleared_once():
    hold, shown, share = FrictionHold(), [], 0.1
    growth = [*np.linspace(1, 1.8, 40), *np.linspace(1.8, 1, 40)]
    for day, value in enumerate(growth):
        hold = hold.looked(diagnosis(ratio(value, share)), START + day * DAY, LIMITS)
        shown.append(hold.conditions[Side.HIGH].level)
    assert sum(a != b for a, b in itertools.pairwise(shown)) == 2
    assert max(shown) is Level.WARN
    assert hold.conditions[Side.LOW] == NO_CONDITION


def test_only_newer_looks_count_and_what_compares_nothing_changes_nothing():
    grown = diagnosis(ratio(1.6, 0.05))
    hold = FrictionHold().looked(grown, START, LIMITS)
    assert hold.conditions[Side.HIGH].level is Level.WARN
    normal = diagnosis(ratio(1.0, 0.05))
    assert hold.looked(normal, START, LIMITS) is hold
    unknown = Diagnosis(Level.OK, StatusSignal.GOOD, quoted("no comparison"), None)
    assert hold.looked(unknown, START + DAY, LIMITS) is hold
    assert hold.looked(normal, START + DAY, LIMITS).conditions[Side.HIGH] == NO_CONDITION


def test_a_friction_too_small_to_be_identified_is_low():
    collapsed = Diagnosis(
        Level.ERROR,
        StatusSignal.OUT_OF_SPECIFICATION,
        quoted("gone"),
        None,
        FrictionState.COLLAPSED,
    )
    hold = FrictionHold().looked(collapsed, START, LIMITS)
    assert hold.conditions[Side.LOW] == Condition(
        Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, "gone"
    )


def test_another_baseline_begins_anew_but_a_restart_does_not():
    kept = {Side.HIGH: Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "of before")}
    hold = FrictionHold(kept).based_on("the baseline")
    assert hold.conditions[Side.HIGH].message == "of before"
    assert hold.based_on("the baseline") is hold
    assert hold.based_on("another").conditions[Side.HIGH] == NO_CONDITION


def test_what_has_no_interval_is_held_for_a_time():
    fault = Condition(Level.WARN, StatusSignal.CHECK_FUNCTION, "no samples")
    delay, shown = Delay(rise=15, fall=60), []
    for second in range(400):
        is_wrong = 100 <= second < 200 or 210 <= second < 220 or second == 50
        delay = delay.seen(fault if is_wrong else NO_CONDITION, float(second))
        shown.append(delay.shown.level is Level.WARN)
    changes = [second for second in range(1, 400) if shown[second] != shown[second - 1]]
    assert changes == [115, 280]


SETTINGS = IdentificationSettings(assumed_mass=1.6)
SEEDS = range(40)


def assessed(record, seed):
    noise = SensorNoise(28.6e-6, 165.0, seed)
    return identify_bench(noise.applied_to(record), BENCH_VALVE, SETTINGS)


@pytest.fixture(scope="module")
def unchanged(loose_record):
    return [assessed(loose_record, seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def pairs(unchanged):
    """Each result with the baseline that the one before it makes."""
    return [
        (now, Baseline.of(before))
        for now, before in zip(unchanged, unchanged[-1:] + unchanged, strict=False)
    ]


def test_an_unchanged_valve_raises_none(pairs):
    levels = [diagnose(now, BENCH_VALVE, baseline).level for now, baseline in pairs]
    assert levels == [Level.OK] * len(SEEDS)


def test_nor_where_the_limits_are_as_narrow_as_the_scatter(pairs):
    """The ratios of F_c alone would pass these limits again and again: intervals hold them back.

    At one standard deviation of the ratio, an unchanged valve passes with its whole interval,
    beyond 1 + 1.96 of them, once in 300 times.
    """
    limits = FrictionLimits(warn_ratio=1.006, error_ratio=1.02, low_ratio=1 / 1.006)
    found = [
        diagnose(now, BENCH_VALVE, replace(baseline, sliding=None), limits)
        for now, baseline in pairs
    ]
    beyond = [
        one for one in found if not limits.low_warn_ratio < one.ratio.value < limits.warn_ratio
    ]
    assert len(beyond) > len(SEEDS) / 5
    assert [one.state.side for one in found] == [None] * len(SEEDS)
    assert all(one.state.is_uncertain for one in beyond)


def test_the_intervals_are_no_wider_than_they_must_be(pairs):
    """A limit 5 % away would be seen: no interval hides a change of that size."""
    for now, baseline in pairs:
        ratio = diagnose(now, BENCH_VALVE, baseline).ratio
        assert 0.95 < ratio.low < ratio.high < 1.05


def test_friction_grown_by_half_is_always_seen(tight_record, unchanged):
    for seed, before in zip(range(100, 108), unchanged, strict=False):
        found = diagnose(assessed(tight_record, seed), BENCH_VALVE, Baseline.of(before))
        assert found.level == Level.WARN
        assert found.message.startswith("friction has grown: ")
