"""Sub-command `history`: list, export and draw what the identifiers have kept."""

import argparse
import json
import time

from valve_friction_ros.commands.arguments.declared import EARLIEST, LATEST
from valve_friction_ros.commands.arguments.fail_on import has_failed
from valve_friction_ros.commands.arguments.kept_valves import chosen_valves
from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.commands.output.history_output import as_json, print_table, write_csv
from valve_friction_ros.commands.output.usage_output import (
    print_usage,
    usage_as_json,
    write_usage,
)
from valve_friction_ros.history import (
    History,
    HistoryError,
    KeptValve,
    ValveHistory,
    read_usage,
    valve_histories,
)
from valve_friction_ros.streams import DAY, nanoseconds
from valve_friction_ros.usage import ValveUsage

__all__ = ["REFUSALS", "run"]

REFUSALS = (HistoryError,)


def _require_files(options: argparse.Namespace) -> None:
    """Refuse files that cannot be written, before long work is done for them."""
    if options.csv is not None and not options.csv.parent.is_dir():
        raise ValueError(f"{options.csv}: there is no folder {options.csv.parent}")
    if options.plot is not None:
        from valve_friction_ros import figures  # noqa: PLC0415 - slow to import

        figures.require_picture_file(options.plot)


def _usages(options: argparse.Namespace) -> list[tuple[KeptValve, ValveUsage]]:
    """Read the usage of the chosen valves, on the chosen days."""
    if options.plot is not None or options.fail_on is not None:
        raise ValueError("--usage: neither --plot nor --fail-on belong to it")
    file, found = History(options.file), []
    since, until = _span(options)
    for valve in chosen_valves(file.valves(), options.valve, "--valve"):
        usage = read_usage(file, valve.name)
        days = [one for one in usage.days if since < (one.day + 1) * DAY and one.day * DAY < until]
        if days:
            found.append((valve, ValveUsage.of(days, usage.renewal)))
    if not found:
        raise ValueError(f"{options.file}: no usage of these valves within these times")
    return found


def _print_usages(options: argparse.Namespace) -> int:
    usages = _usages(options)
    try:
        if options.json:
            valves = [
                {"name": valve.name, "tag": valve.tag, "usage": usage_as_json(usage)}
                for valve, usage in usages
            ]
            print(json.dumps({"valves": valves}, ensure_ascii=False, allow_nan=False))
        else:
            print_usage(usages, (options.since, options.until) != (EARLIEST, LATEST))
    finally:
        if options.csv is not None:
            write_usage(options.csv, usages)
    return ExitCode.DONE


def _span(options: argparse.Namespace) -> tuple[int, int]:
    since, until = options.since - EARLIEST, options.until - EARLIEST
    return nanoseconds(since.total_seconds()), nanoseconds(until.total_seconds())


def _histories(options: argparse.Namespace) -> tuple[ValveHistory, ...]:
    """Read the chosen valves within the chosen times."""
    file = History(options.file)
    histories = valve_histories(
        file,
        chosen_valves(file.valves(), options.valve, "--valve"),
        *_span(options),
    )
    if not histories:
        raise ValueError(f"{options.file}: no identification of these valves within these times")
    return histories


def run(options: argparse.Namespace) -> int:
    """Print what was kept of the chosen valves, and write the files asked for."""
    _require_files(options)
    if options.usage:
        return _print_usages(options)
    histories = _histories(options)
    figure = None
    if options.plot is not None:
        from valve_friction_ros import figures  # noqa: PLC0415 - slow to import

        try:
            figure = figures.trend_figure(histories, time.time_ns())
        except ValueError as error:
            raise ValueError(f"--plot: {error} by --valve") from None
    try:
        if options.json:
            print(json.dumps(as_json(histories), ensure_ascii=False, allow_nan=False))
        else:
            print_table(histories)
    finally:  # a closed output costs no file, and a full disk no list
        if options.csv is not None:
            write_csv(options.csv, histories)
        if figure is not None:
            figures.save_picture(figure, options.plot)
    levels = (history.entries[-1].diagnosis.level for history in histories)
    return ExitCode.ALARM if has_failed(options, levels) else ExitCode.DONE
