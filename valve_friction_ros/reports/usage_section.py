"""The section of a report on what the valve has done."""

from collections.abc import Sequence

from valve_friction_ros.figures.usage_figure import usage_figure
from valve_friction_ros.health import percentage
from valve_friction_ros.model import Valve
from valve_friction_ros.reports.page import Column, Paragraph, Picture, Section, Table
from valve_friction_ros.streams import utc, utc_day
from valve_friction_ros.usage import LimitState, Usage, ValveUsage

__all__ = ["usage_section"]

_MEANING = (
    "A stroke counts where it is longer than the counting dead band, so noise counts nothing; a "
    "breakaway is a start after a rest of a whole second of the stamps. Time that was "
    "not watched counts nowhere."
)


_UNITS = {"travel_limit": "m", "reversal_limit": "reversals"}
_NO_LIMIT = (
    "The life of the packing has no limit: set the parameter travel_limit or reversal_limit to be "
    "warned a month ahead."
)


def usage_section(
    usage: ValveUsage, valve: Valve, limits: Sequence[LimitState] | None = None
) -> Section | None:
    """Return the table of the usage, since the packing was renewed and in all, and its figure.

    With the `limits` of the packing, if they are known, beside when each is expected to be reached.
    None for a valve that was not watched.
    """
    used, everything = usage.since_renewal, usage.total
    if not everything.time_watched:
        return None
    since = "since the first sample"
    if usage.renewal:
        date = utc(usage.renewal)
        since = f"since the packing was renewed, {date:%Y-%m-%d}"
    columns = (Column("usage"), Column(since, is_number=True), Column("in all", is_number=True))
    old, new = _cells(used, valve), _cells(everything, valve)
    table = Table(columns, tuple((name, old[name], new[name]) for name in old))
    life = () if limits is None else _life(limits)
    words, pace = _MEANING, usage.pace()
    if pace is not None:
        words += (
            f" Pace of the last days: {pace.distance:.3g} m and {pace.reversals:.3g} reversals in "
            "a day of watching."
        )
    if not used.time_watched:
        return Section("Use", (table, *life, Paragraph(words)))
    picture = Picture(
        usage_figure(usage),
        "Time at each 5 % of the travel, and the travelled distance of each day.",
        "A histogram of the stem position, and the distance of each day.",
        usage_figure(usage, is_narrow=True),
    )
    return Section("Use", (table, *life, picture, Paragraph(words)))


def _life(limits: Sequence[LimitState]) -> tuple[Table | Paragraph, ...]:
    """Return how far the packing is from its limits, and what to do."""
    if not limits:
        return (Paragraph(_NO_LIMIT),)
    titles = ("limit of the packing", "used", "limit", "share", "expected")
    columns = tuple(Column(title, is_number=title != titles[0]) for title in titles)
    rows = tuple(
        (
            f"{one.name} [{_UNITS[one.name]}]",
            f"{one.used:.5g}",
            f"{one.limit:.6g}",
            percentage(one.used / one.limit),
            _expected(one),
        )
        for one in limits
    )
    warnings = (f"{one.message[0].upper()}{one.message[1:]}." for one in limits if one.warns)
    return Table(columns, rows), *map(Paragraph, warnings)


def _expected(state: LimitState) -> str:
    if state.is_reached:
        return "reached"
    if state.expected is None:
        return "not known before a day of watching"
    return utc_day(state.expected)


def _cells(usage: Usage, valve: Valve) -> dict[str, str]:
    return {
        "travelled distance [m]": f"{usage.distance:.5g}",
        "strokes of the whole travel": f"{usage.strokes(valve.travel):.5g}",
        "reversals": f"{usage.reversals}",
        "breakaways": f"{usage.breakaways}",
        "time watched [h]": f"{usage.time_watched / 3600e9:.4g}",
        "time near 0 % of the travel [h]": f"{usage.time_near_seat() / 3600e9:.4g}",
        "time near 100 % of the travel [h]": f"{usage.time_near_seat(True) / 3600e9:.4g}",
    }
