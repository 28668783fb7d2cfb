"""Times of samples as dates."""

from datetime import datetime, timezone

__all__ = ["DAY", "utc", "utc_day", "utc_minute", "utc_second"]

DAY = 86_400_000_000_000
"""A day, ns."""


def utc(stamp: float) -> datetime:
    """Return the date of a stamp, ns since 1970 (UTC)."""
    return datetime.fromtimestamp(stamp / 1e9, timezone.utc)


def utc_day(stamp: float) -> str:
    """Write the day of a stamp, ns since 1970, by ISO 8601, as UTC."""
    return f"{utc(stamp):%Y-%m-%d}"


def utc_minute(stamp: float) -> str:
    """Write a stamp, ns since 1970, for people, to the minute: 2026-11-22 18:56 UTC."""
    return f"{utc(stamp):%Y-%m-%d %H:%M} UTC"


def utc_second(stamp: float) -> str:
    """Write a stamp, ns since 1970, by ISO 8601, as UTC, to the second."""
    return f"{utc(stamp):%Y-%m-%dT%H:%M:%SZ}"
