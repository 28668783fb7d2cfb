# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `inspect`: show what would be read of a table, and how."""

import argparse
import json
from pathlib import Path

from rich.table import Table

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
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.inspection import InspectedSignal, Inspection, inspected
from valve_friction_ros.streams import utc_second

REFUSALS = (RefusalError,)
_DATED = 946_684_800_000_000_000
"""Time, ns since 1970, from which a stamp is a date: the year 2000."""


def _cells(one: InspectedSignal) -> tuple[str, ...]:
    rate = f"{one.period:.4g} s" if one.samples > 1 else "–"
    gaps = f"{one.gaps}, longest {one.longest:.3g} s" if one.gaps else "none"
    return (
        printable(one.valve),
        one.quantity,
        printable(one.name),
        "%" if one.unit == "percent" else one.unit,
        str(one.samples),
        rate,
        f"{one.low:.6g} … {one.high:.6g}" if one.samples else "–",
        gaps,
        str(one.bad),
    )


def _print(found: Inspection) -> None:
    console = plain_console()
    console.print(found.layout.words, soft_wrap=True)
    others = [
        f"{printable(name) or 'without a name'} ({kind or 'empty'})"
        for name, kind in found.kinds.items()
        if name not in {one.name for one in found.signals}
    ]
    if found.signals:
        heads = ("valve", "signal", "column", "unit", "values", "every", "range", "gaps", "bad")
        rows = [_cells(one) for one in found.signals]
        kept = [place for place in range(len(heads)) if any(row[place] for row in rows)]
        table = Table(*(heads[place] for place in kept), box=None, header_style="bold")
        for row in rows:
            table.add_row(*(row[place] for place in kept))
        console.print(table)
        for one in found.signals:
            console.print(f"{one.picture}  {printable(one.name)}", soft_wrap=True)
        begin = min(one.begin for one in found.signals)
        if begin >= _DATED:
            console.print(f"begins {utc_second(begin)}")
    if others:
        console.print(f"other columns: {', '.join(others)}", soft_wrap=True)


def _draw(options: argparse.Namespace, path: Path) -> None:
    """Draw the recording, in SI units where a valve file gives the travel."""
    from valve_friction_ros import figures  # noqa: PLC0415 - slow to import
    from valve_friction_ros.figures.record_figures import record_figure  # noqa: PLC0415

    figures.require_picture_file(path)
    description, reading = described(options.file, options.valve, options)
    recorded = read_one(options.file, description.valve, reading)
    figures.save_picture(record_figure(recorded.recording()), path)


def run(options: argparse.Namespace) -> int:
    """Print what would be read; what is open is a line on stderr, and exit code 2."""
    description = valve_of(options)
    reading = reading_options(options, description.columns if description else None)
    with reading_progress():
        found = inspected(options.file, reading.columns, reading.stretch)
    layout = found.layout
    if options.json:
        shown = {
            "words": layout.words,
            "questions": list(layout.questions),
            "signals": [one.to_dict() for one in found.signals],
            "columns": found.kinds,
        }
        print(json.dumps(shown, ensure_ascii=False))
    else:
        _print(found)
    if layout.questions:
        complain(options.command, f"{options.file}: cannot tell {'; '.join(layout.questions)}")
        return ExitCode.REFUSED
    save_columns(options, reading)
    if options.plot is not None:
        _draw(options, options.plot)
    return ExitCode.DONE
