# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `inspect`: show what would be read from a table, and how."""

import argparse
import json
from collections.abc import Mapping
from typing import Any

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
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.bags.topics import is_bag
from valve_friction_ros.records.layout import Layout
from valve_friction_ros.records.table import OpenTables, ReadSignal
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


def _print(layout: Layout, reads: list[ReadSignal], signals: list[dict[str, Any]]) -> None:
    console = plain_console()
    console.print(layout.words, soft_wrap=True)
    others = [
        f"{printable(name) or 'without a name'} ({kind or 'empty'})"
        for name, kind in layout.kinds.items()
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


def run(options: argparse.Namespace) -> int:
    """Print what would be read; open questions give a line on stderr and exit code 2."""
    description = valve_of(options)
    reading = reading_options(options, description.columns if description else None)
    if is_bag(options.file):
        raise ValueError(
            f"{options.file}: a bag, not a table: `ros2 bag info` lists its topics, and `identify` "
            "reads it"
        )
    with reading_progress():
        table = OpenTables((options.file, *reading.beside), reading.columns)
        layout = table.layout
        named = [(label, one) for label, group in layout.valves.items() for one in group]
        reads: list[ReadSignal] = []
        questions = list(layout.questions)
        if not questions:
            reads = table.read([one for _, one in named], reading.stretch)
            questions = table.doubts(reads)
    signals = [_inspected(label, read) for (label, _), read in zip(named, reads, strict=False)]
    if options.json:
        shown = {
            "words": layout.words,
            "questions": questions,
            "signals": plain(signals),
            "columns": layout.kinds,
        }
        print(json.dumps(shown, ensure_ascii=False))
    else:
        _print(layout, reads, signals)
    if questions:
        complain(options.command, table.asked(questions))
        return ExitCode.REFUSED
    save_columns(options, reading)
    if options.plot is not None:
        _draw(options)
    return ExitCode.DONE
