# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-commands `history` and `history copy`: list, export, plot and copy what is stored."""

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from rich.table import Table

from valve_friction_ros import figures
from valve_friction_ros.commands.arguments import require_outputs
from valve_friction_ros.commands.arguments.declared import EARLIEST, LATEST
from valve_friction_ros.commands.arguments.identification import chosen_valves, has_failed
from valve_friction_ros.commands.console import plain_console
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.health.comparison import friction_name
from valve_friction_ros.health.diagnosis import FrictionState
from valve_friction_ros.history import (
    AlarmRecording,
    CopiedPart,
    History,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    Trend,
    ValveHistory,
    copied,
    read_usage,
    valve_histories,
)
from valve_friction_ros.history.trend import LEAST_ESTIMATES
from valve_friction_ros.identification.rendering import parameter_columns, plain
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.outside_text import csv_text, printable
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.response import ResponseSummary
from valve_friction_ros.streams import DAY, nanoseconds, utc, utc_day, utc_second
from valve_friction_ros.usage import BINS, Usage, UsedDay, ValveUsage
from valve_friction_ros.wording import (
    Code,
    headline,
    member_words,
    percentage,
    sentence,
    with_width,
)


def _valve_table(valve: KeptValve, *columns: str) -> Table:
    """Return an empty table with these columns, titled by tag and name of the valve."""
    tag = f"{valve.tag} " if valve.tag else ""
    return Table(
        *columns,
        box=None,
        header_style="bold",
        title=printable(f"{tag}{valve.name}"),
        title_justify="left",
    )


_HOUR = 3600e9


def _usage_as_json(usage: ValveUsage) -> dict[str, Any] | None:
    """Return the usage as a mapping, with times as text; None without usage."""
    if not usage.days and not usage.renewal:
        return None
    shown = usage.to_dict()
    shown["renewal"] = utc_second(usage.renewal) if usage.renewal else None
    for one in shown["days"]:
        one["day"] = utc_day(one["day"])
        one["renewal"] = utc_second(one["renewal"]) if one["renewal"] else None
    return shown


def service_lines(
    usage: ValveUsage,
    alarms: Sequence[AlarmRecording] = (),
    response: ResponseSummary | None = None,
) -> list[str]:
    """Return the lines below the list of a valve: usage, responses and latest alarm."""
    lines = []
    if usage.days:
        since = f"since {utc_day(usage.renewal)} (packing renewed)" if usage.renewal else "in total"
        lines.append(f"usage: {_words(usage.since_renewal)}, {since}")
        if usage.renewal:
            lines.append(f"usage: {_words(usage.total)}, in total")
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
        f"breakaways in {usage.time_watched / _HOUR:.4g} h monitored"
    )


def _print_usage_table(
    valves: Sequence[tuple[KeptValve, ValveUsage]], is_chosen: bool = False
) -> None:
    """Print a table of days per valve, followed by sums and pace."""
    console = plain_console()
    for valve, usage in valves:
        counts = ("travel [m]", "reversals", "breakaways")
        hours = ("monitored [h]", "near 0 % [h]", "near 100 % [h]")
        table = _valve_table(valve, "day [UTC]", *counts, *hours, "packing of")
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
                f"recent pace: {pace.distance:.4g} m and {pace.reversals:.4g} reversals per day "
                "monitored"
            )
        console.print()


def _usage_row(valve: KeptValve, one: UsedDay) -> dict[str, object]:
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


def time_text(time: float, timespec: str = "milliseconds") -> str:
    """Format a time in ns since 1970 in ISO 8601 and UTC."""
    return utc(time).isoformat(timespec=timespec).replace("+00:00", "Z")


def _trend_as_json(trend: Trend | None) -> dict[str, Any] | None:
    """Return the trend as a mapping; with numbers only if the drift is significant."""
    if trend is None:
        return None
    is_sure, crossing = trend.is_significant, trend.crossing
    return {
        "begin": time_text(trend.begin),
        "end": time_text(trend.end),
        "days": trend.days,
        "outliers": trend.outliers,
        "of": trend.of,
        "speed": plain(trend.speed),
        "significant": is_sure,
        "drift_n_per_month": trend.drift if is_sure else None,
        "half_width_n_per_month": trend.half_width if is_sure else None,
        "crossing": None
        if crossing is None
        else {
            "limit": crossing.limit.value,
            "level_n": crossing.level,
            "expected": time_text(crossing.time),
            "earliest": time_text(crossing.earliest),
            "latest": time_text(crossing.latest),
        },
    }


def _shown(entry: HistoryEntry | KeptBaseline) -> dict[str, Any]:
    """Return an entry or a baseline as a mapping, with times as text."""
    shown = entry.to_dict()
    for name in {"time", "begin", "end", "since"} & {*shown}:
        shown[name] = None if shown[name] is None else time_text(shown[name])
    return shown


def _as_json(histories: Sequence[ValveHistory]) -> dict[str, Any]:
    """Build the JSON object: the valves, each with its history."""
    return {
        "valves": [
            {
                "name": history.valve.name,
                "tag": history.valve.tag,
                "trend": _trend_as_json(history.trend),
                "baselines": [_shown(kept) for kept in history.baselines],
                "usage": _usage_as_json(history.usage),
                "alarm_recordings": [
                    one.to_dict() | {"time": utc_second(one.time)} for one in history.alarms
                ],
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


def _write_csv(path: Path, rows: Sequence[Mapping[str, object]]) -> None:
    """Write rows as a table, whose header has the columns of all rows; missing values are empty."""
    widest = max(rows, key=len)
    header = [*dict.fromkeys([*widest, *(name for row in rows for name in row)])]
    write_whole(path, csv_text(header, rows).encode())


def _told(entry: HistoryEntry) -> str:
    """Return the reason of a refusal, or the diagnosis without figures."""
    found = entry.diagnosis
    if found.statement.code is Code.HELD_IN_TEST:
        return headline(found.statement)
    if found.statement.code is Code.QUOTED and found.state is not FrictionState.UNKNOWN:
        return entry.refusal or member_words(found.state.name, "state")  # from a former version
    return entry.refusal or headline(found.statement)


def _cells(row: HistoryEntry | KeptBaseline) -> tuple[str, ...]:
    """Return the table cells of an identification or a baseline after its time."""
    if isinstance(row, KeptBaseline):
        level = "" if row.level is None else row.level.name
        change = f"{row.by}: {row.in_force or 'none'}; previous: {row.replaced or 'none'}"
        return ("", "", "baseline", "", level, change)
    one, ratio = row.parameters.get(SLIDING) or row.friction, row.diagnosis.ratio
    cells: tuple[str, ...] = ("", "–", "refused")
    if one is not None:
        name = "sliding" if one.name == SLIDING else "F_c"
        cells = (name, with_width(one.value, one.half_width), one.verdict.value)
    return (
        *cells,
        "" if ratio is None or row.refusal else f"{ratio.value:.2f}",
        row.diagnosis.level.name,
        _told(row),
    )


def _print_table(histories: Sequence[ValveHistory]) -> None:
    """Print a table per valve with its baselines, followed by the trend."""
    console = plain_console()
    for history in histories:
        names = ("friction", "[N], ± 95 %", "verdict", "ratio", "level", "diagnosis")
        table = _valve_table(history.valve, "time [UTC]", *names)
        for column in (2, 4):
            table.columns[column].justify = "right"
        for column in range(6):
            table.columns[column].no_wrap = True
        rows: list[HistoryEntry | KeptBaseline] = [*history.entries, *history.baselines]
        for row in sorted(rows, key=attrgetter("time")):
            time = time_text(row.time, "seconds")[:-1].replace("T", " ")
            table.add_row(time, *_cells(row))
        console.print(table)
        for line in _trend_lines(history.trend) or _without_trend(history):
            console.print(line)
        for line in service_lines(history.usage, history.alarms, history.response):
            console.print(line)
        console.print()


def _trend_lines(trend: Trend | None) -> list[str]:
    if trend is None:
        return []
    begin, end = (time_text(time)[:10] for time in (trend.begin, trend.end))
    left_out = f"; {trend.outliers} left out as outliers" if trend.outliers else ""
    days = f"{trend.days} days with records, {begin} to {end}{left_out}"
    if not trend.is_significant:
        return [f"trend: no significant drift of {trend.what} over {days}"]
    lines = [
        f"trend: {trend.what} drifts by {'+' * (trend.drift > 0)}"
        f"{with_width(trend.drift, trend.half_width)} N per month, over {days}"
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


def _without_trend(history: ValveHistory) -> list[str]:
    """Say that there is no trend because the records move at other speeds than the baseline."""
    kept = history.set_baseline
    healthy = None if kept is None else kept.baseline
    if kept is None or healthy is None or healthy.sliding is None:
        return []
    known = [
        entry
        for entry in history.entries
        if (one := entry.parameters.get(SLIDING)) and one.value > 0 and entry.time >= kept.since
    ]
    far = [entry for entry in known if entry.is_at_other_speed(healthy)]
    if not far or len(known) < LEAST_ESTIMATES:
        return []
    speed = sentence(friction_name(SLIDING, healthy.sliding.speed))
    return [
        f"trend: none, because {len(far)} of {len(known)} records move the stem at other speeds "
        f"than the baseline ({speed}), and friction between these speeds is not known well enough: "
        "move the stem as for the baseline"
    ]


def _print_usages(options: argparse.Namespace) -> int:
    """Print the usage of the chosen valves, and write the requested table."""
    if options.plot is not None or options.fail_on is not None:
        raise ValueError("--usage: cannot be combined with --plot or --fail-on")
    file, usages = History(options.file), []
    since, until = _span(options)
    for valve in chosen_valves(file.valves(), options.valve, "--valve"):
        usage = read_usage(file, valve.name)
        days = [one for one in usage.days if since < (one.day + 1) * DAY and one.day * DAY < until]
        if days:
            usages.append((valve, ValveUsage.of(days, usage.renewal)))
    if not usages:
        raise ValueError(f"{options.file}: no usage of these valves within these times")
    try:
        if options.json:
            valves = [
                {"name": valve.name, "tag": valve.tag, "usage": _usage_as_json(usage)}
                for valve, usage in usages
            ]
            print(json.dumps({"valves": valves}, ensure_ascii=False, allow_nan=False))
        else:
            _print_usage_table(usages, (options.since, options.until) != (EARLIEST, LATEST))
    finally:
        if options.csv is not None:
            rows = [_usage_row(valve, one) for valve, usage in usages for one in usage.days]
            _write_csv(options.csv, rows)
    return ExitCode.DONE


def _span(options: argparse.Namespace) -> tuple[int, int]:
    since, until = options.since - EARLIEST, options.until - EARLIEST
    return nanoseconds(since.total_seconds()), nanoseconds(until.total_seconds())


def run(options: argparse.Namespace) -> int:
    """Print the history of the chosen valves, and write the requested files."""
    require_outputs(options.csv, picture=options.plot)
    if options.usage:
        return _print_usages(options)
    file = History(options.file)
    valves = chosen_valves(file.valves(), options.valve, "--valve")
    histories = valve_histories(file, valves, *_span(options))
    if not histories:
        raise ValueError(f"{options.file}: no identification of these valves within these times")
    figure = None
    if options.plot is not None:
        try:
            figure = figures.trend_figure(histories, time.time_ns())
        except ValueError as error:
            raise ValueError(f"--plot: {error} with --valve") from None
    try:
        if options.json:
            print(json.dumps(_as_json(histories), ensure_ascii=False, allow_nan=False))
        else:
            _print_table(histories)
    finally:  # a closed output must not prevent the files, nor a full disk the list
        if options.csv is not None:
            entries = (entry for history in histories for entry in history.entries)
            _write_csv(options.csv, [_row(one) for one in sorted(entries, key=attrgetter("time"))])
        if figure is not None:
            figures.save_picture(figure, options.plot)
    levels = (history.entries[-1].diagnosis.level for history in histories)
    return ExitCode.ALARM if has_failed(options, levels) else ExitCode.DONE


def _print_parts(parts: tuple[CopiedPart, ...]) -> None:
    print(f"{'table':<20}{'rows':>10}{'written':>10}{'same':>10}  checksum")
    for one in parts:
        verdict = one.checksum[:12] if one.is_same else f"{one.checksum[:12]} ≠ {one.copied[:12]}"
        print(f"{one.table:<20}{one.rows:>10}{one.written:>10}{one.same:>10}  {verdict}")


def copy(options: argparse.Namespace) -> int:
    """Copy the history, and print the result table by table."""
    valves = History(options.source).valves()
    names = [one.name for one in chosen_valves(valves, options.valve, "--valve")]
    parts = copied(options.source, options.target, names)
    is_same = all(one.is_same for one in parts)
    if options.json:
        tables = {one.table: {**one._asdict(), "is_same": one.is_same} for one in parts}
        print(json.dumps({"valves": names, "tables": tables, "is_same": is_same}))
    else:
        _print_parts(parts)
        words = "all rows are the same" if is_same else "rows differ"
        print(f"{len(names)} valves: {words} in {options.source} and {options.target}")
    return ExitCode.DONE if is_same else ExitCode.PARTLY
