"""Times for people: in a zone that stands beside them."""

from collections.abc import Mapping
from datetime import datetime
from zoneinfo import ZoneInfo

from valve_friction_ros.dashboard.options import zone_of
from valve_friction_ros.streams import utc

__all__ = ["ago", "moment", "zone_asked"]


def zone_asked(query: Mapping[str, str], usual: str) -> ZoneInfo:
    """Return the zone that an address asks for by ``tz``; the usual one for an unknown name."""
    try:
        return zone_of(query.get("tz", usual))
    except ValueError:
        return zone_of(usual)


def moment(stamp: int | None, zone: ZoneInfo) -> str:
    """Write a time, ns since 1970, in a zone, with the zone's short name."""
    if stamp is None:
        return "–"
    local: datetime = utc(stamp).astimezone(zone)
    return f"{local:%Y-%m-%d %H:%M:%S} {local.tzname()}"


def ago(seconds: float) -> str:
    """Write how long ago something was, in its largest unit."""
    for size, unit in ((86_400 * 365.25, "y"), (86_400, "d"), (3600, "h"), (60, "min")):
        if seconds >= size:
            return f"{seconds // size:.0f} {unit}"
    return f"{max(0.0, seconds):.0f} s"
