"""Dates of stamps."""

from datetime import datetime, timezone

from valve_friction_ros.streams import utc


def test_a_stamp_is_nanoseconds_since_1970_in_utc():
    assert utc(0) == datetime(1970, 1, 1, tzinfo=timezone.utc)
    assert utc(951_782_400_500_000_000) == datetime(2000, 2, 29, 0, 0, 0, 500_000, timezone.utc)
