# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarms: raised and cleared by whole intervals, one a year at most; no step of a life is lost."""

import itertools
import json
import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.health import (
    Alarm,
    AlarmKind,
    AlarmState,
    Baseline,
    Condition,
    DigestDesk,
    FrictionLimits,
    Level,
    Ratio,
    Side,
    StatusSignal,
    diagnose,
)
from valve_friction_ros.health.alarm_conditions import Delay, FrictionHold, held_level, widening
from valve_friction_ros.health.alarms import (
    LONGEST_ABSENCE,
    LONGEST_SHELVING,
    NO_CONDITION,
    TRANSITIONS,
    AlarmAction,
    AlarmError,
    AlarmRequest,
    alarm_summary,
    followed_by,
    requested,
)
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionState, friction_state
from valve_friction_ros.identification import IdentificationSettings, identify_bench
from valve_friction_ros.model import BENCH_VALVE, SensorNoise
from valve_friction_ros.wording import quoted

HOUR = 3600.0
NOW = 1_800_000_000_000_000_000
HIGH = AlarmKind.FRICTION_HIGH
WARN = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
ERROR = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
DURATION = {AlarmAction.SHELVE: 8 * HOUR, AlarmAction.TAKE_OUT: 100 * HOUR}


def request(action, text="seen", **given):
    return AlarmRequest(action, "A. Operator", text, given.get("duration", DURATION.get(action, 0)))


def after(*steps):
    """Return the alarm after conditions and actions, a second apart."""
    alarm = Alarm(HIGH)
    for number, step in enumerate(steps):
        now = NOW + number * 10**9
        if isinstance(step, Condition):
            for event in followed_by(alarm, step, now):
                alarm = event.alarm
        else:
            alarm = requested(alarm, request(step), now).alarm
    return alarm


@pytest.mark.parametrize(
    ("steps", "state"),
    [
        ((WARN,), AlarmState.UNACKNOWLEDGED),
        ((WARN, AlarmAction.ACKNOWLEDGE), AlarmState.ACKNOWLEDGED),
        ((WARN, AlarmAction.ACKNOWLEDGE, NO_CONDITION), AlarmState.NORMAL),
        ((WARN, NO_CONDITION), AlarmState.RETURNED),
        ((WARN, NO_CONDITION, AlarmAction.ACKNOWLEDGE), AlarmState.NORMAL),
        ((WARN, NO_CONDITION, WARN), AlarmState.UNACKNOWLEDGED),
        ((WARN, AlarmAction.ACKNOWLEDGE, ERROR), AlarmState.UNACKNOWLEDGED),
        ((ERROR, AlarmAction.ACKNOWLEDGE, WARN), AlarmState.ACKNOWLEDGED),
        ((WARN, AlarmAction.SHELVE, ERROR, NO_CONDITION, WARN), AlarmState.SHELVED),
        ((WARN, AlarmAction.SHELVE, AlarmAction.UNSHELVE), AlarmState.UNACKNOWLEDGED),
        ((WARN, AlarmAction.SHELVE, NO_CONDITION, AlarmAction.UNSHELVE), AlarmState.NORMAL),
        ((AlarmAction.TAKE_OUT, WARN, AlarmAction.PUT_BACK), AlarmState.UNACKNOWLEDGED),
        ((WARN, AlarmAction.SHELVE, AlarmAction.TAKE_OUT), AlarmState.OUT_OF_SERVICE),
        ((WARN, AlarmAction.COMMENT), AlarmState.UNACKNOWLEDGED),
    ],
)
def test_the_life_of_isa_18_2(steps, state):
    assert after(*steps).state is state


def test_shelving_ends_by_itself_and_the_condition_decides():
    shelved = after(WARN, AlarmAction.SHELVE)
    assert not followed_by(shelved, WARN, shelved.until - 1)
    (event,) = followed_by(shelved, WARN, shelved.until)
    assert (event.action, event.alarm.state) == (AlarmAction.EXPIRE, AlarmState.UNACKNOWLEDGED)
    assert event.alarm.raised == NOW, "it is the same alarm still"
    expired, cleared = followed_by(shelved, NO_CONDITION, shelved.until + 1)
    assert expired.alarm.state is AlarmState.UNACKNOWLEDGED
    assert (cleared.action, cleared.alarm.state) == (AlarmAction.CLEAR, AlarmState.RETURNED)


@pytest.mark.parametrize(
    ("action", "longest"),
    [(AlarmAction.SHELVE, LONGEST_SHELVING), (AlarmAction.TAKE_OUT, LONGEST_ABSENCE)],
)
def test_a_clock_that_is_set_back_does_not_suppress_an_alarm_for_years(action, longest):
    """It was raised and suppressed ten years ahead; a clock may be ahead by an hour."""
    hour = 3_600_000_000_000
    asked = request(action, duration=longest / 1e9)
    suppressed = requested(after(WARN), asked, NOW).alarm
    assert not followed_by(suppressed, WARN, NOW - hour)
    (event,) = followed_by(suppressed, WARN, NOW - 10 * 366 * 24 * hour)
    assert (event.action, event.alarm.state) == (AlarmAction.EXPIRE, AlarmState.UNACKNOWLEDGED)


def test_an_event_holds_who_and_what_and_the_sentence_stays():
    event = requested(after(WARN), request(AlarmAction.ACKNOWLEDGE, " repack on Monday "), NOW)
    assert (event.who, event.text) == ("A. Operator", "repack on Monday")
    assert event.alarm.message == "friction has grown"
    assert event.before is AlarmState.UNACKNOWLEDGED


def test_nobody_answers_an_alarm_before_it_was_raised():
    """The clock of the valve is an hour ahead of the one that asks."""
    early = NOW - 3_600_000_000_000
    event = requested(after(WARN), request(AlarmAction.SHELVE, duration=60.0), early)
    assert (event.time, event.alarm.until) == (NOW, NOW + 60_000_000_000)
    assert requested(after(WARN), request(AlarmAction.ACKNOWLEDGE), NOW + 1).time == NOW + 1


@pytest.mark.parametrize(
    ("action", "who", "text", "hours", "says"),
    [
        (AlarmAction.ACKNOWLEDGE, "  ", "", 0, "who is empty"),
        (AlarmAction.ACKNOWLEDGE, "x" * 81, "", 0, "at most 80"),
        (AlarmAction.ACKNOWLEDGE, "a\nb", "", 0, "one line"),
        (AlarmAction.COMMENT, "A", " ", 0, "comment is empty"),
        (AlarmAction.COMMENT, "A", "x" * 501, 0, "at most 500"),
        (AlarmAction.SHELVE, "A", "", math.inf, "for inf h"),
        (AlarmAction.SHELVE, "A", "", math.nan, "for nan h"),
        (AlarmAction.SHELVE, "A", "", 0, "for 0 h"),
        (AlarmAction.SHELVE, "A", "", LONGEST_SHELVING / 3.6e12 + 1, "up to 720 h"),
        (AlarmAction.TAKE_OUT, "A", "", LONGEST_ABSENCE / 3.6e12 + 1, "up to 8784 h"),
        (AlarmAction.RAISE, "A", "", 0, "by the valve"),
    ],
)
def test_what_nobody_may_ask_is_refused_with_one_line(action, who, text, hours, says):
    with pytest.raises(AlarmError, match=says) as refused:
        AlarmRequest(action, who, text, hours * HOUR)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("steps", "action"),
    [
        ((), AlarmAction.ACKNOWLEDGE),
        ((WARN,), AlarmAction.UNSHELVE),
        ((WARN,), AlarmAction.PUT_BACK),
        ((WARN, AlarmAction.ACKNOWLEDGE), AlarmAction.ACKNOWLEDGE),
        ((AlarmAction.TAKE_OUT,), AlarmAction.SHELVE),
    ],
)
def test_what_the_state_does_not_allow_is_refused_and_says_what_it_does(steps, action):
    with pytest.raises(AlarmError, match=r"friction high: .* it can be .*commented"):
        requested(after(*steps), request(action), NOW)


CONDITIONS = st.sampled_from([NO_CONDITION, WARN, ERROR])
STEPS = st.lists(
    st.tuples(st.integers(0, 200), st.one_of(CONDITIONS, st.sampled_from([*AlarmAction]))),
    max_size=40,
)


@settings(max_examples=300, deadline=None)
@given(STEPS)
def test_no_order_of_steps_leaves_the_table_or_contradicts_itself(steps):
    """Each event is one of the table, none is silent, and what the valve shows is never lost."""
    alarm, now, shown = Alarm(HIGH), NOW, NO_CONDITION
    for hours, step in steps:
        now += hours * 3_600_000_000_000
        shown = step if isinstance(step, Condition) else shown
        events = followed_by(alarm, shown, now)
        if events:
            alarm = events[-1].alarm
        if (alarm.state, step) in TRANSITIONS and step.is_of_person:
            asked = requested(alarm, request(step), now)
            events, alarm = (*events, asked), asked.alarm
        for event in events:
            assert TRANSITIONS[event.before, event.action] in (None, event.alarm.state)
            is_ended = event.alarm.state in (AlarmState.NORMAL, AlarmState.ACKNOWLEDGED)
            assert event.who or not (event.before.needs_answer and is_ended), "nobody has seen it"
            assert event.who or event.action is not AlarmAction.COMMENT
        chain = [event.before for event in events]
        assert chain[1:] == [event.alarm.state for event in events[:-1]]
        assert alarm.condition.level == shown.level
        assert alarm.is_told == (shown.level > Level.OK and not alarm.state.is_suppressed)
        assert alarm.until is None or alarm.until > now
        assert not followed_by(alarm, shown, now), "the same again is no event"


@pytest.mark.parametrize(
    ("state", "condition", "until"),
    [
        (AlarmState.SHELVED, NO_CONDITION, None),
        (AlarmState.UNACKNOWLEDGED, NO_CONDITION, None),
        (AlarmState.NORMAL, WARN, None),
        (AlarmState.NORMAL, NO_CONDITION, NOW),
    ],
)
def test_an_alarm_that_contradicts_itself_cannot_be(state, condition, until):
    with pytest.raises(ValueError, match="an alarm that is"):
        Alarm(HIGH, state, condition, until=until)


def test_a_summary_names_what_is_not_normal():
    every = [Alarm(kind) for kind in AlarmKind]
    assert alarm_summary(every) == "all alarms of the valve are normal"
    assert alarm_summary([after(WARN), *every[2:4]]) == (
        "friction high: unacknowledged; stuck, whole valve: normal"
    )
    shelved = alarm_summary([after(WARN, AlarmAction.SHELVE)])
    assert shelved == "friction high: shelved until 2027-01-15 16:00 UTC"


DAY = 86_400
MIDNIGHT = 20_000 * DAY
ONE, OTHER = ("FV-101", "/fv_101/identifier"), ("FV-102", "/fv_102/identifier")


def alarm(state, condition=NO_CONDITION, raised=MIDNIGHT * 10**9, kind=HIGH):
    until = (MIDNIGHT + DAY) * 10**9 if state.is_suppressed else None
    return Alarm(kind, state, condition, raised, until, condition.message)


@given(
    hour=st.floats(0, 23.99),
    times=st.lists(st.integers(MIDNIGHT, MIDNIGHT + 5 * DAY), min_size=2, unique=True),
)
def test_a_digest_comes_once_each_time_its_hour_goes_by(hour, times):
    """Also after a pause, and when the clock is set back."""
    desk, told, latest = DigestDesk(), 0, times[0]
    for time in times:
        due = (time - 3600 * hour) // DAY > (latest - 3600 * hour) // DAY
        latest = max(time, latest)
        assert (desk.hear("address", hour, ONE, {}, time) is not None) == due
        told += due
    assert told <= 6


def test_groups_have_letters_of_their_own_and_a_valve_may_leave():
    desk = DigestDesk()
    for group, hour, valve in (("a", 6.0, ONE), ("a", 6.0, OTHER), ("b", 6.0, ("V", "/v"))):
        assert desk.hear(group, hour, valve, {}, MIDNIGHT) is None
    assert desk.hear("a", -1.0, OTHER, {}, MIDNIGHT) is None
    letter = desk.hear("a", 6.0, ONE, {}, MIDNIGHT + 6 * 3600)
    assert set(letter.alarms) == {ONE}
    letter = desk.hear("b", 6.0, ("V", "/v"), {}, MIDNIGHT + 6 * 3600)
    assert set(letter.alarms) == {("V", "/v")}


def test_it_tells_what_stands_or_waits_and_counts_what_is_shelved():
    desk = DigestDesk()
    shelved = alarm(AlarmState.SHELVED, ERROR, kind=AlarmKind.STUCK)
    returned = alarm(AlarmState.RETURNED, raised=MIDNIGHT * 10**9 + 1)
    desk.hear("a", 6.0, ONE, {HIGH: returned, AlarmKind.STUCK: shelved}, MIDNIGHT)
    standing = alarm(AlarmState.ACKNOWLEDGED, ERROR)
    others = {
        HIGH: standing,
        AlarmKind.WHOLE_VALVE: alarm(AlarmState.UNACKNOWLEDGED, WARN, kind=AlarmKind.WHOLE_VALVE),
        AlarmKind.POSITIONER: Alarm(AlarmKind.POSITIONER),
    }
    letter = desk.hear("a", 6.0, OTHER, others, MIDNIGHT + 6 * 3600)
    content = json.loads(letter.body())
    counts = {"valves": 2, "errors": 1, "warnings": 1, "unanswered": 2, "suppressed": 1}
    assert content["digest"] == counts
    told = [(one["valve"], one["alarm"], one["state"]) for one in content["alarms"]]
    assert told == [
        ("FV-102", "friction_high", "acknowledged"),
        ("FV-102", "whole_valve", "unacknowledged"),
        ("FV-101", "friction_high", "returned unacknowledged"),
    ]
    assert content["alarms"][0]["message"] == "excess friction"
    assert content["time"].startswith("2024-10-04T06:00:00")
    assert letter.title == "the digest of 2024-10-04 06:00:00 UTC"


LIMITS = FrictionLimits()
NANO_DAY = 86_400 * 10**9
YEAR = 365 * NANO_DAY
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
    tail = 1 - NormalDist().cdf(1.959964 * widening(NANO_DAY))
    assert tail == pytest.approx(0.01 / 365.25, rel=1e-4)
    assert math.isinf(widening(0))


@pytest.mark.parametrize("true", [1.0, 1.2, 1.24, 1.25, 1.3, 0.8, 2.0])
@pytest.mark.parametrize("every", [NANO_DAY, NANO_DAY // 24, NANO_DAY // 288])
@pytest.mark.parametrize("share", [0.03, 0.3])
def test_a_valve_that_stays_as_it_is_raises_one_alarm_a_year_at_most(true, every, share):
    """Years of looks with honest noise, wherever the friction is, also at a limit.

    Looks that show the same as the one before change nothing (a property above) and are left out.
    """
    generator = np.random.default_rng(round(1000 * true + 7 * share + every % 1000))
    count = (10 if every > NANO_DAY // 100 else 2) * YEAR // every
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
        found, time = diagnosis(ratio(value, share)), START + day * NANO_DAY
        hold = hold.looked(found, time, LIMITS, elapsed=NANO_DAY if day else None)
        shown.append(hold.conditions[Side.HIGH].level)
    assert sum(a != b for a, b in itertools.pairwise(shown)) == 2
    assert max(shown) is Level.WARN
    assert hold.conditions[Side.LOW] == NO_CONDITION


def test_what_compares_nothing_changes_nothing():
    grown = diagnosis(ratio(1.6, 0.05))
    hold = FrictionHold().looked(grown, START, LIMITS)
    assert hold.conditions[Side.HIGH].level is Level.WARN
    unknown = Diagnosis(Level.OK, StatusSignal.GOOD, quoted("no comparison"), None)
    assert hold.looked(unknown, START + NANO_DAY, LIMITS) is hold
    normal = diagnosis(ratio(1.0, 0.05))
    assert hold.looked(normal, START + NANO_DAY, LIMITS).conditions[Side.HIGH] == NO_CONDITION


@given(RATIOS, st.integers(1, 10 * NANO_DAY))
def test_a_record_asked_for_shows_the_level_of_its_diagnosis(found, later):
    """However soon after the one before; one that repeats by itself needs more certainty."""
    expected = diagnosis(found)
    hold = FrictionHold().looked(diagnosis(ratio(1.0, 0.05)), START, LIMITS)
    asked = hold.looked(expected, START + later, LIMITS)
    side = expected.state.side
    for one in Side:
        level = expected.level if one is side else Level.OK
        assert asked.conditions[one].level is level
    again = asked.looked(expected, START + 2 * later, LIMITS)
    assert again.conditions == asked.conditions


def test_a_look_that_repeats_by_itself_needs_more_certainty():
    hold = FrictionHold().looked(diagnosis(ratio(1.0, 0.05)), START, LIMITS)
    found = diagnosis(ratio(2.4, 0.14))
    minute = 60_000_000_000
    assert hold.looked(found, START + minute, LIMITS).conditions[Side.HIGH].level is Level.ERROR
    often = hold.looked(found, START + minute, LIMITS, elapsed=minute)
    assert often.conditions[Side.HIGH].level is Level.WARN


def test_an_active_alarm_does_not_read_as_normal():
    """Uncertainty keeps the alarm: its message says so, and what the latest record shows."""
    hold = FrictionHold().looked(diagnosis(ratio(2.6, 0.05)), START, LIMITS)
    after = hold.looked(diagnosis(ratio(1.1, 0.2)), START + NANO_DAY, LIMITS)
    kept = after.conditions[Side.HIGH]
    assert kept.level is Level.WARN
    assert "; the latest record does not clear it: " in kept.message


def test_a_friction_too_small_to_be_identified_is_low():
    collapsed = Diagnosis.of(FrictionState.COLLAPSED, quoted("gone"))
    shown = FrictionHold().looked(collapsed, START, LIMITS).conditions[Side.LOW]
    assert shown == Condition(Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, "gone")


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


ASSUMED = IdentificationSettings(assumed_mass=1.6)
SEEDS = range(40)


def assessed(record, seed):
    noise = SensorNoise(28.6e-6, 165.0, seed)
    return identify_bench(noise.applied_to(record), BENCH_VALVE, ASSUMED)


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


def test_an_unchanged_valve_raises_none_and_no_interval_would_hide_a_change_of_5_percent(pairs):
    found = [diagnose(now, BENCH_VALVE, baseline) for now, baseline in pairs]
    assert [one.level for one in found] == [Level.OK] * len(SEEDS)
    assert all(0.95 < one.ratio.low < one.ratio.high < 1.05 for one in found)


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
    assert all(one.state is FrictionState.UNCLEAR for one in beyond)


def test_friction_grown_by_half_is_always_seen(tight_record, unchanged):
    for seed, before in zip(range(100, 108), unchanged, strict=False):
        found = diagnose(assessed(tight_record, seed), BENCH_VALVE, Baseline.of(before))
        assert found.level == Level.WARN
        assert found.message.startswith("friction has grown: ")
