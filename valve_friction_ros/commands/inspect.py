# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `inspect`: show what would be read from a table or a bag, and how."""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.table import Table

from valve_friction_ros import figures
from valve_friction_ros.commands.arguments.recording import (
    described,
    read_one,
    reading_options,
    reading_progress,
    save_columns,
    valve_of,
)
from valve_friction_ros.commands.console import plain_console
from valve_friction_ros.commands.process import ExitCode, complain
from valve_friction_ros.held_signals import LONG_PAUSE
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.bags.topics import is_bag
from valve_friction_ros.records.layout import TableSignal
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.records.table import OpenTables, ReadSignal, fault_of
from valve_friction_ros.streams import utc_second
from valve_friction_ros.wording import lasting

_DATED = 946_684_800_000_000_000
"""Time, ns since 1970, from which a stamp is taken for a date: the year 2000."""
_BARS = "▁▂▃▄▅▆▇█"
_PARTS = 60
"""Largest number of intervals in the sketch of a signal."""


def _inspected(valve: str, read: ReadSignal) -> dict[str, Any]:
    """Describe a signal as read: times in s, values in its unit, start in ns since 1970."""
    steps = np.diff(read.stamps) / 1e9
    period = float(np.median(steps)) if steps.size else np.nan
    return {
        "valve": valve,
        "quantity": read.signal.quantity,
        "name": read.signal.name,
        "unit": read.signal.unit,
        "samples": read.values.size,
        "bad": read.bad.total(),
        "period": period,
        "low": float(np.min(read.values, initial=np.inf)),
        "high": float(np.max(read.values, initial=-np.inf)),
        "gaps": int((steps > LONG_PAUSE * period).sum()),
        "longest": float(np.max(steps, initial=0.0)),
        "begin": int(read.stamps[0]) if read.stamps.size else 0,
    }


def _cells(one: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        printable(one["valve"]),
        one["quantity"],
        printable(one["name"]),
        "%" if one["unit"] == "percent" else one["unit"],
        str(one["samples"]),
        f"{one['period']:.4g} s" if one["samples"] > 1 else "–",
        f"{one['low']:.6g} … {one['high']:.6g}" if one["samples"] else "–",
        f"{one['gaps']}, up to {lasting(one['longest'])}" if one["gaps"] else "none",
        str(one["bad"]),
    )


def _picture(read: ReadSignal) -> str:
    """Return a sketch of the signal in one line: its means over equal intervals of time."""
    parts = min(_PARTS, read.stamps.size)
    if not parts:
        return ""
    since = read.stamps - read.stamps[0]
    part = np.minimum(since * parts // (int(since[-1]) + 1), parts - 1)
    counts = np.bincount(part, minlength=parts)
    means = np.bincount(part, read.values, minlength=parts)[counts > 0] / counts[counts > 0]
    height = (means - means.min()) / (float(np.ptp(means)) or 1.0) * (len(_BARS) - 1)
    marks = iter(_BARS[round(float(one))] for one in height)
    return "".join(next(marks) if count else " " for count in counts)


def _print(shown: Mapping[str, Any], reads: Sequence[ReadSignal]) -> None:
    console, signals = plain_console(), shown["signals"]
    console.print(shown["words"], soft_wrap=True)
    others = [
        f"{printable(name) or 'without a name'} ({kind or 'empty'})"
        for name, kind in shown["columns"].items()
        if name not in {one["name"] for one in signals}
    ]
    if signals:
        heads = (
            "valve",
            "signal",
            "column",
            "unit",
            "values",
            "every",
            "range",
            "long pauses",
            "bad",
        )
        rows = [_cells(one) for one in signals]
        kept = [place for place in range(len(heads)) if any(row[place] for row in rows)]
        table = Table(*(heads[place] for place in kept), box=None, header_style="bold")
        for row in rows:
            table.add_row(*(row[place] for place in kept))
        console.print(table)
        for read in reads:
            console.print(f"{_picture(read)}  {printable(read.signal.name)}", soft_wrap=True)
        begin = min(one["begin"] for one in signals)
        if begin >= _DATED:
            console.print(f"begins {utc_second(begin)}")
    if others:
        which = "other columns" if signals else "columns"
        console.print(f"{which}: {', '.join(others)}", soft_wrap=True)


def _draw(options: argparse.Namespace) -> None:
    """Plot the recording in SI units, with the travel from a valve file."""
    from valve_friction_ros.figures.record_figures import record_figure  # noqa: PLC0415 - slow

    figures.require_picture_file(options.plot)
    description, reading = described(options.file, options.valve, options)
    recorded = read_one(options.file, description.valve, reading)
    figures.save_picture(record_figure(recorded.recording()), options.plot)


class _Found(NamedTuple):
    """What a file holds: the signals of each valve, open questions, and why signals are refused."""

    words: str
    valves: Mapping[str, Sequence[ReadSignal]]
    columns: Mapping[str, str]
    questions: Sequence[str] = ()
    faults: Sequence[str] = ()


def _table(path: Path, _: Valve, reading: ReadingOptions) -> _Found:
    table = OpenTables((path, *reading.beside), reading.columns)
    layout, valves = table.layout, {}
    questions = list(layout.questions)
    faults: list[str] = []
    if not questions:
        every = [one for group in layout.valves.values() for one in group]
        reads = dict(zip(every, table.read(every, reading.stretch), strict=True))
        valves = {label: [reads[one] for one in group] for label, group in layout.valves.items()}
        questions = table.doubts([*reads.values()])
        faults = [fault for read in reads.values() if (fault := fault_of(read, layout.form))]
    if questions:
        faults = [table.asked(questions)]
    return _Found(layout.words, valves, layout.kinds, questions, faults)


def _bag(path: Path, valve: Valve, reading: ReadingOptions) -> _Found:
    valves, faults, notes = {}, [], {}
    for one in read_recordings(path, valve, reading):
        notes.update(dict.fromkeys(one.notes))
        if isinstance(one.outcome, RefusalError):
            faults.append(str(one.refused(one.outcome)))
            continue
        record, stamped = one.outcome, one.outcome.stamped
        since = round(record.start_time * 1e9)
        own = (stamped.drive, stamped.position) if stamped else ()
        times = [signal.time for signal in own] or [record.time] * 2
        values = [signal.value for signal in own] or [record.drive, record.position]
        signals = zip(("pressure", "position"), ("Pa", "m"), times, values, strict=True)
        valves[one.name] = [
            ReadSignal(
                TableSignal(quantity, one.name, unit, 0, (0,)),
                since + np.rint(time * 1e9).astype(np.int64),
                signal,
                np.arange(time.size),
            )
            for quantity, unit, time, signal in signals
        ]
    return _Found("; ".join(["read as: a bag", *notes]), valves, {}, faults=faults)


def run(options: argparse.Namespace) -> int:
    """Print what would be read; open questions give a line on stderr and exit code 2."""
    description = valve_of(options)
    reading = reading_options(options, description.columns if description else None)
    valve = description.valve if description else Valve()
    with reading_progress():
        look = _bag if is_bag(options.file) else _table
        found = look(options.file, valve, reading)
    named = [(label, read) for label, reads in found.valves.items() for read in reads]
    shown = {
        "words": found.words,
        "questions": found.questions,
        "signals": [_inspected(label, read) for label, read in named],
        "columns": found.columns,
    }
    if options.json:
        print(json.dumps(plain(shown), ensure_ascii=False))
    else:
        _print(shown, [read for _, read in named])
    for fault in found.faults:
        complain(options.command, fault)
    if found.faults:
        return ExitCode.REFUSED
    save_columns(options, reading)
    if options.plot is not None:
        _draw(options)
    return ExitCode.DONE
