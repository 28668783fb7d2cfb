"""How a history is shown: as a table, as an object of JSON, and as CSV."""

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from valve_friction_ros.commands.output.formatting import plain_console
from valve_friction_ros.commands.output.usage_output import (
    alarms_as_json,
    service_lines,
    usage_as_json,
)
from valve_friction_ros.commands.output.valve_table import valve_table
from valve_friction_ros.history import HistoryEntry, KeptBaseline, Trend, ValveHistory
from valve_friction_ros.identification import (
    parameter_cells,
    parameter_columns,
    parameter_mapping,
    plain,
    two_digits,
)
from valve_friction_ros.outside_text import harmless
from valve_friction_ros.records.whole_file import write_whole
from valve_friction_ros.streams import utc

__all__ = ["as_json", "print_table", "write_csv"]


def time_text(time: float, timespec: str = "milliseconds") -> str:
    """Write a time in ns since 1970 by ISO 8601, in UTC."""
    when = utc(time)
    return when.isoformat(timespec=timespec).replace("+00:00", "Z")


def _trend_as_json(trend: Trend | None) -> dict[str, Any] | None:
    """Return the trend; the numbers only where the drift is significant."""
    if trend is None:
        return None
    told: dict[str, Any] = {
        "begin": time_text(trend.begin),
        "end": time_text(trend.end),
        "days": trend.days,
        "outliers": trend.outliers,
        "of": trend.of,
        "speed": plain(trend.speed),
        "significant": trend.is_significant,
        "drift_n_per_month": None,
        "half_width_n_per_month": None,
        "crossing": None,
    }
    if trend.is_significant:
        told |= {
            "drift_n_per_month": trend.drift,
            "half_width_n_per_month": trend.half_width,
        }
    if trend.crossing is not None:
        told["crossing"] = {
            "limit": trend.crossing.limit.value,
            "level_n": trend.crossing.level,
            "expected": time_text(trend.crossing.time),
            "earliest": time_text(trend.crossing.earliest),
            "latest": time_text(trend.crossing.latest),
        }
    return told


def _shown(entry: HistoryEntry | KeptBaseline) -> dict[str, Any]:
    """Return an entry, or a baseline, as a mapping, with its times as text."""
    shown = entry.to_dict()
    for name in {"time", "begin", "end", "since"} & {*shown}:
        shown[name] = None if shown[name] is None else time_text(shown[name])
    return shown


def as_json(histories: Sequence[ValveHistory]) -> dict[str, Any]:
    """Build the object that JSON shows: valves, each with what was kept of it."""
    return {
        "valves": [
            {
                "name": history.valve.name,
                "tag": history.valve.tag,
                "trend": _trend_as_json(history.trend),
                "baselines": [_shown(kept) for kept in history.baselines],
                "usage": usage_as_json(history.usage),
                "alarm_recordings": alarms_as_json(history.alarms),
                "response": history.response.to_dict(),
                "entries": [_shown(entry) for entry in history.entries],
            }
            for history in histories
        ]
    }


def _row(entry: HistoryEntry) -> dict[str, object]:
    shown = _shown(entry)
    diagnosis = shown["diagnosis"]
    low, high = diagnosis["ratio_interval"] or (None, None)
    row = {
        "time": shown["time"],
        "valve": entry.valve.name,
        "tag": entry.valve.tag,
        **{name: shown[name] for name in ("begin", "end", "method")},
        "level": diagnosis["level"],
        "refusal": shown["refusal"],
        "ratio": diagnosis["ratio"],
        "ratio_low": low,
        "ratio_high": high,
        "ratio_of": diagnosis["ratio_of"],
        "ratio_speed_m_per_s": diagnosis["ratio_speed"],
        "baseline_n": shown["baseline"],
        "baseline_sliding_n": (shown["baseline_sliding"] or {}).get("value"),
        "sliding_speed_m_per_s": shown["sliding_speed"],
        "fit": shown["fit"],
        "rms_m": shown["rms"],
    }
    for name, parameter in shown["parameters"].items():
        row |= parameter_columns(name, parameter)
    return row | {"message": diagnosis["message"], "software_version": shown["software_version"]}


def write_csv(path: Path, histories: Sequence[ValveHistory]) -> None:
    """Write a row for each identification, oldest first; a cell without a value is empty.

    Raises
    ------
    OSError
        If it cannot be written; it names `path`, and no part of the table stays.
    """
    entries = sorted(
        (entry for history in histories for entry in history.entries), key=lambda one: one.time
    )
    rows = [_row(entry) for entry in entries]
    widest = max(rows, key=len)
    header = [*dict.fromkeys([*widest, *(name for row in rows for name in row)])]
    text = io.StringIO()
    writer = csv.DictWriter(text, header, lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: harmless(value) for name, value in row.items()} for row in rows)
    write_whole(path, text.getvalue().encode())


def _told(entry: HistoryEntry) -> str:
    """Return the reason of a refusal, or the verdict without its figures."""
    return entry.refusal or re.split("[:;]", entry.diagnosis.message)[0]


def _cells(row: HistoryEntry | KeptBaseline) -> tuple[str, ...]:
    """Return what the table shows of an identification or a baseline, after its time."""
    if isinstance(row, KeptBaseline):
        level = "" if row.level is None else row.level.name
        change = f"{row.by}: {row.in_force or 'none'}; before: {row.replaced or 'none'}"
        return ("", "", "baseline", "", level, change)
    one, ratio = row.friction, row.diagnosis.ratio
    cells: tuple[str, ...] = ("", "–", "", "", "refused")
    if one is not None:
        cells = parameter_cells(one.name, parameter_mapping(one))
    return (
        *(cells[place] for place in (1, 2, 4)),
        "" if ratio is None or row.refusal else f"{ratio.value:.2f}",
        row.diagnosis.level.name,
        _told(row),
    )


def print_table(histories: Sequence[ValveHistory]) -> None:
    """Print a table a valve, with its baselines, and the trend below it."""
    console = plain_console()
    for history in histories:
        table = valve_table(
            history.valve,
            "time [UTC]",
            "F_c [N]",
            "± 95 %",
            "verdict",
            "ratio",
            "level",
            "diagnosis",
        )
        for column in (1, 2, 4):
            table.columns[column].justify = "right"
        for column in range(6):
            table.columns[column].no_wrap = True
        rows: list[HistoryEntry | KeptBaseline] = [*history.entries, *history.baselines]
        for row in sorted(rows, key=lambda one: one.time):
            time = time_text(row.time, "seconds")[:-1].replace("T", " ")
            table.add_row(time, *_cells(row))
        console.print(table)
        for line in _trend_lines(history.trend):
            console.print(line)
        for line in service_lines(history.usage, history.alarms, history.response):
            console.print(line)
        console.print()


def _trend_lines(trend: Trend | None) -> list[str]:
    if trend is None:
        return []
    days = f"{trend.days} days"
    if trend.outliers:
        days += f" ({trend.outliers} left out as outliers)"
    if not trend.is_significant:
        return [f"trend: no significant drift of {trend.what} over {days}"]
    lines = [
        f"trend: {trend.what} drifts by {trend.drift:+.3g} ± {two_digits(trend.half_width)} N "
        f"a month, over {days}"
    ]
    if trend.crossing is not None:
        expected, earliest, latest = (
            time_text(time)[:10]
            for time in (trend.crossing.time, trend.crossing.earliest, trend.crossing.latest)
        )
        lines.append(
            f"trend: {trend.crossing.limit.value} ({trend.crossing.level:.4g} N) expected on "
            f"{expected} (95 %: {earliest} to {latest})"
        )
    return lines
