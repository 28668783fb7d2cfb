"""Sums, pace and limits of a valve's usage."""

import json

import pytest

from valve_friction_ros.streams import DAY
from valve_friction_ros.usage import (
    BINS,
    Pace,
    Usage,
    UsageLimits,
    UsedDay,
    ValveUsage,
    limit_states,
    warned_limits,
)

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


class TestPace:
    def test_of_a_day_of_watching(self):
        """Watched for half of each day, the valve moves twice as far in a whole one."""
        assert ValveUsage.of(days(20)).pace() == Pace(2.0, 20.0)

    def test_of_the_last_days(self):
        old, new = days(50, distance=9.0), days(14, first=TODAY, distance=0.5)
        assert ValveUsage.of([*old, *new]).pace().distance == pytest.approx(1.0)

    def test_not_before_a_day_is_watched(self):
        assert ValveUsage.of(days(1, hours=23)).pace() is None
        assert ValveUsage.of(days(1, hours=24)).pace() == Pace(1.0, 10.0)

    def test_of_this_packing_only(self):
        assert ValveUsage.of(days(20), renewal=7).pace() is None


class TestLimits:
    def state(self, limits, used=None, pace=PACE):
        (found,) = limit_states(used or usage(100.0), pace, limits, NOW)
        return found

    def test_no_limit(self):
        assert limit_states(usage(), Pace(1.0, 1.0), UsageLimits(), NOW) == ()

    def test_expected_date(self):
        state = self.state(UsageLimits(travel=150.0))
        assert (state.used, state.limit, state.is_reached) == (100.0, 150.0, False)
        assert state.expected == NOW + 25 * DAY
        assert state.warns
        assert state.message == (
            "packing life: 100 m of travel of 150 (travel_limit), expected on 2024-10-29: renew "
            "the packing, then call ~/reset_usage"
        )

    def test_no_warning_a_month_before(self):
        state = self.state(UsageLimits(travel=162.0))
        assert state.expected == NOW + 31 * DAY
        assert not state.warns

    def test_reached(self):
        state = self.state(UsageLimits(reversals=10.0))
        assert state.is_reached
        assert state.warns
        assert state.expected is None
        assert "10 reversals of 10 (reversal_limit): reached: renew" in state.message

    @pytest.mark.parametrize("pace", [None, Pace(0.0, 0.0), Pace(1e-9, 0.0)])
    def test_no_date(self, pace):
        """Without a pace, or for one that reaches no date of the calendar."""
        state = self.state(UsageLimits(travel=150.0), pace=pace)
        assert state.expected is None
        assert not state.warns

    def test_what_has_warned_goes_on(self):
        state = self.state(UsageLimits(travel=162.0))._replace(has_warned=True)
        assert state.warns

    def test_what_has_warned_and_has_no_date_is_near_and_not_reached(self):
        near = self.state(UsageLimits(travel=110.0), pace=None)._replace(has_warned=True)
        assert near.warns
        assert near.message == (
            "packing life: 100 m of travel of 110 (travel_limit), near its limit (warned before): "
            "renew the packing, then call ~/reset_usage"
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
