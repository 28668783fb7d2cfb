"""How the usage of valves is shown: as lines, as a table of days, as JSON, and as CSV."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from valve_friction_ros.commands.output.formatting import plain_console
from valve_friction_ros.commands.output.valve_table import valve_table
from valve_friction_ros.history import AlarmRecording, KeptValve
from valve_friction_ros.identification.trust.rounding import percentage
from valve_friction_ros.outside_text import harmless, printable
from valve_friction_ros.records.whole_file import write_whole
from valve_friction_ros.response import ResponseSummary
from valve_friction_ros.streams import DAY, utc_day, utc_second
from valve_friction_ros.usage import BINS, Usage, UsedDay, ValveUsage

__all__ = [
    "alarms_as_json",
    "print_usage",
    "service_lines",
    "usage_as_json",
    "write_usage",
]

_HOUR = 3600e9


def usage_as_json(usage: ValveUsage) -> dict[str, Any] | None:
    """Return the usage as a mapping, with its times as text; None where nothing was counted."""
    if not usage.days and not usage.renewal:
        return None
    shown = usage.to_dict()
    shown["renewal"] = utc_second(usage.renewal) if usage.renewal else None
    for one in shown["days"]:
        one["day"] = utc_day(one["day"])
        one["renewal"] = utc_second(one["renewal"]) if one["renewal"] else None
    return shown


def alarms_as_json(alarms: Sequence[AlarmRecording]) -> list[dict[str, Any]]:
    """Return the recordings of alarms as mappings, with their times as text."""
    return [{**one.to_dict(), "time": utc_second(one.time)} for one in alarms]


def service_lines(
    usage: ValveUsage,
    alarms: Sequence[AlarmRecording] = (),
    response: ResponseSummary | None = None,
) -> list[str]:
    """Return what stands below the list of a valve: its usage, its answers, its latest alarm."""
    lines = []
    if usage.days:
        since = f"since {utc_day(usage.renewal)} (packing renewed)" if usage.renewal else "in all"
        lines.append(f"usage: {_words(usage.since_renewal)}, {since}")
        if usage.renewal:
            lines.append(f"usage: {_words(usage.total)}, in all")
    if response is not None and response.moves:
        lines.append(f"stem_command: {_answers(response)}")
    if alarms:
        last = alarms[-1]
        lines.append(
            f"alarm recordings: {len(alarms)}, the latest {utc_second(last.time)} "
            f"{last.level.name}: {printable(str(last.path))}"
        )
    return lines


def _answers(response: ResponseSummary) -> str:
    """Return the medians of the answers."""
    seconds = (("dead time", "dead_time"), ("T63", "t63"), ("T86", "t86"))
    shares = (("overshoot", "overshoot"), ("steady error", "steady_error"))
    figures = [
        *(f"{word} {getattr(response, name).median:.3g} s" for word, name in seconds),
        *(f"{word} {percentage(getattr(response, name).median)}" for word, name in shares),
    ]
    return (
        f"{len(response.moves)} steps, {len(response.ignored)} ignored; medians: "
        f"{', '.join(figures)}"
    )


def _words(usage: Usage) -> str:
    return (
        f"{usage.distance:.5g} m of travel, {usage.reversals} reversals, {usage.breakaways} "
        f"breakaways in {usage.time_watched / _HOUR:.4g} h of watching"
    )


def print_usage(valves: Sequence[tuple[KeptValve, ValveUsage]], is_chosen: bool = False) -> None:
    """Print a table of days a valve, and the sums and the pace below it.

    Of chosen days the sum names the first and the last.
    """
    console = plain_console()
    for valve, usage in valves:
        table = valve_table(
            valve,
            "day [UTC]",
            "travel [m]",
            "reversals",
            "breakaways",
            "watched [h]",
            "near 0 % [h]",
            "near 100 % [h]",
            "packing of",
        )
        for column in table.columns[1:-1]:
            column.justify = "right"
        for one in usage.days:
            table.add_row(
                utc_day(one.day * DAY),
                f"{one.usage.distance:.5g}",
                str(one.usage.reversals),
                str(one.usage.breakaways),
                f"{one.usage.time_watched / _HOUR:.4g}",
                f"{one.usage.time_near_seat() / _HOUR:.4g}",
                f"{one.usage.time_near_seat(True) / _HOUR:.4g}",
                utc_day(one.renewal) if one.renewal else "not known",
            )
        console.print(table)
        if is_chosen:
            first, last = (utc_day(usage.days[place].day * DAY) for place in (0, -1))
            console.print(f"usage: {_words(usage.total)}, from {first} to {last}")
        else:
            for line in service_lines(usage):
                console.print(line)
        if (pace := usage.pace()) is not None:
            console.print(
                f"pace of the last days: {pace.distance:.4g} m and {pace.reversals:.4g} reversals "
                "in a day of watching"
            )
        console.print()


def write_usage(path: Path, valves: Sequence[tuple[KeptValve, ValveUsage]]) -> None:
    """Write a row for each day of each valve, oldest first.

    Raises OSError if it cannot be written; it names `path`, and no part of the table stays.
    """
    rows = [_row(valve, one) for valve, usage in valves for one in usage.days]
    text = io.StringIO()
    writer = csv.DictWriter(
        text, _row(KeptValve("", ""), UsedDay(0, 0, Usage())), lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows({name: harmless(value) for name, value in row.items()} for row in rows)
    write_whole(path, text.getvalue().encode())


def _row(valve: KeptValve, one: UsedDay) -> dict[str, object]:
    width = 100 // BINS
    times = {
        f"time_at_{n * width}_to_{(n + 1) * width}_percent_s": time / 1e9
        for n, time in enumerate(one.usage.histogram)
    }
    return {
        "day": utc_day(one.day * DAY),
        "valve": valve.name,
        "tag": valve.tag,
        "packing_renewed": utc_second(one.renewal) if one.renewal else None,
        "distance_m": one.usage.distance,
        "reversals": one.usage.reversals,
        "breakaways": one.usage.breakaways,
        "time_watched_s": one.usage.time_watched / 1e9,
        **times,
    }
