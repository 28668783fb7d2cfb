"""Times of samples as dates."""

from datetime import datetime, timezone

__all__ = ["utc"]


def utc(stamp: float) -> datetime:
    """Return the date of a stamp, ns since 1970 (UTC)."""
    return datetime.fromtimestamp(stamp / 1e9, timezone.utc)
