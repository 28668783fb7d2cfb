"""The section of a report on what the valve has done."""

from valve_friction_ros.figures.usage_figure import usage_figure
from valve_friction_ros.model import Valve
from valve_friction_ros.reports.page import Column, Paragraph, Picture, Section, Table
from valve_friction_ros.streams import utc
from valve_friction_ros.usage import Usage, ValveUsage

__all__ = ["usage_section"]

_MEANING = (
    "A stroke counts where it is longer than the counting dead band, so noise counts nothing; a "
    "breakaway is a start after a rest of a whole second of the stamps. Time that was "
    "not watched counts nowhere."
)


def usage_section(usage: ValveUsage, valve: Valve) -> Section | None:
    """Return the table of the usage, since the packing was renewed and in all, and its figure.

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
    words, pace = _MEANING, usage.pace()
    if pace is not None:
        words += (
            f" Pace of the last days: {pace.distance:.3g} m and {pace.reversals:.3g} reversals in "
            "a day of watching."
        )
    if not used.time_watched:
        return Section("Use", (table, Paragraph(words)))
    picture = Picture(
        usage_figure(usage),
        "Time at each 5 % of the travel, and the travelled distance of each day.",
        "A histogram of the stem position, and the distance of each day.",
    )
    return Section("Use", (table, picture, Paragraph(words)))


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
