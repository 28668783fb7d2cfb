# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The daily digest: when it is due, once for all valves, and what it says of the states."""

import json

from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.health import (
    Alarm,
    AlarmDigest,
    AlarmKind,
    AlarmState,
    Condition,
    DigestDesk,
    Level,
    StatusSignal,
)
from valve_friction_ros.health.alarms import NO_CONDITION

DAY = 86_400
MIDNIGHT = 20_000 * DAY
ONE, OTHER = ("FV-101", "/fv_101/identifier"), ("FV-102", "/fv_102/identifier")
ERROR = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
WARN = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")


def alarm(state, condition=NO_CONDITION, raised=MIDNIGHT * 10**9, kind=AlarmKind.FRICTION_HIGH):
    until = (MIDNIGHT + DAY) * 10**9 if state.is_suppressed else None
    return Alarm(kind, state, condition, raised, until, condition.message)


def test_it_comes_once_a_day_for_all_valves():
    desk = DigestDesk()
    letters = []
    letters = [
        (second, set(letter.alarms))
        for second in range(MIDNIGHT, MIDNIGHT + 3 * DAY, 600)
        for valve in (ONE, OTHER)
        if (letter := desk.hear("address", 6.5, valve, {}, second))
    ]
    due = [MIDNIGHT + day * DAY + 6.5 * 3600 for day in range(3)]
    assert letters == [(second, {ONE, OTHER}) for second in due]


@given(
    hour=st.floats(0, 23.99),
    times=st.lists(st.integers(MIDNIGHT, MIDNIGHT + 5 * DAY), min_size=2, unique=True),
)
def test_it_is_one_for_each_gap_in_which_its_time_goes_by(hour, times):
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
    desk.hear(
        "a", 6.0, ONE, {AlarmKind.FRICTION_HIGH: returned, AlarmKind.STUCK: shelved}, MIDNIGHT
    )
    standing = alarm(AlarmState.ACKNOWLEDGED, ERROR)
    others = {
        AlarmKind.FRICTION_HIGH: standing,
        AlarmKind.WHOLE_VALVE: alarm(AlarmState.UNACKNOWLEDGED, WARN, kind=AlarmKind.WHOLE_VALVE),
        AlarmKind.POSITIONER: Alarm(AlarmKind.POSITIONER),
    }
    letter = desk.hear("a", 6.0, OTHER, others, MIDNIGHT + 6 * 3600)
    content = json.loads(letter.body())
    assert content["digest"] == {
        "valves": 2,
        "errors": 1,
        "warnings": 1,
        "unanswered": 2,
        "suppressed": 1,
    }
    told = [(one["valve"], one["alarm"], one["state"]) for one in content["alarms"]]
    assert told == [
        ("FV-102", "friction_high", "acknowledged"),
        ("FV-102", "whole_valve", "unacknowledged"),
        ("FV-101", "friction_high", "returned unacknowledged"),
    ]
    assert content["alarms"][0]["message"] == "excess friction"
    assert content["time"].startswith("2024-10-04T06:00:00")
    assert letter.body() == letter.body()
    assert isinstance(letter, AlarmDigest)
    assert letter.title == "the digest of 2024-10-04 06:00:00 UTC"
