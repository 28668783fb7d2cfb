# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments of commands that read a recording: the file, its valve and its format."""

import argparse
import contextlib
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from valve_friction_ros import model, records
from valve_friction_ros.commands.arguments import add_options
from valve_friction_ros.records.bags.topics import VALVE_FILE, TopicChoice
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.files import on_disk, write_whole


def add_recording_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the file, ``--valve``, and the reading options."""
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="recording: CSV (gzipped or not, - for standard input), Excel or Parquet; or a ROS 2 "
        "bag, MCAP or SQLite3: its folder or one of its files, compressed or not",
    )
    parser.add_argument(
        "beside",
        type=Path,
        nargs="*",
        metavar="FILE",
        help="further tables of the same valve, if pressure and position are in separate files",
    )
    add_options(
        parser,
        """
        --valve FILE.yaml: diaphragm_area, pressure_reference, travel, columns …, or parameters of
            an identifier; needed unless the file holds force_n, or a bag its own valve.yaml
        --save-columns FILE.yaml: write a valve file with the recognized table format, so that the
            next export needs no option
        """,
    )
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options for information that a file lacks."""
    stretch = parser.add_argument_group("part of the recording")
    for name, default, help_text in (
        ("begin", -math.inf, "skip everything before S seconds after the first sample"),
        ("end", math.inf, "skip everything after S seconds after the first sample"),
        ("last", math.inf, "only the last S seconds, like a node with `window` S"),
    ):
        stretch.add_argument(f"--{name}", type=float, default=default, metavar="S", help=help_text)
    bag = parser.add_argument_group(
        "bags", "topics are found by type unless these options name them"
    )
    add_options(
        bag,
        """
        --pressure-topic TOPIC: pressure topic; without a leading slash: in the namespace of each
            valve
        --stem-topic TOPIC: stem topic, likewise
        --joint NAME: joint that is the stem (the only one, or 'stem')
        --valve-name NAMESPACE: valve to use if the bag holds several
        """,
    )
    add_table_arguments(
        parser,
        "each may be set in the section `columns:` of the valve file instead, as time_column: Time",
    )


def add_table_arguments(parser: argparse.ArgumentParser, text: str) -> None:
    """Declare the options for the format of a table."""
    table = parser.add_argument_group("CSV, Excel, Parquet", text)
    for each in fields(Columns):
        option, text = f"--{each.name.replace('_', '-')}", each.metadata["help"]
        if isinstance(each.default, bool):
            table.add_argument(
                option, action=argparse.BooleanOptionalAction, default=None, help=text
            )
        else:
            table.add_argument(
                option,
                type=type(each.default),
                metavar=each.metadata["metavar"],
                help=f"{text} ({each.default})" if each.default else text,
            )


def given_columns(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the format of a table given by the parsed arguments."""
    options = {each.name: getattr(arguments, each.name) for each in fields(Columns)}
    return {name: value for name, value in options.items() if value is not None}


def reading_options(
    arguments: argparse.Namespace, columns: Columns | None = None
) -> "records.ReadingOptions":
    """Build the reading options from the parsed arguments and the valve file.

    Raises ValueError if they are incompatible.
    """
    return records.ReadingOptions(
        replace(columns or Columns(), **given_columns(arguments)),
        TopicChoice(
            arguments.pressure_topic, arguments.stem_topic, arguments.joint, arguments.valve_name
        ),
        records.Stretch(arguments.begin, arguments.end, arguments.last),
        tuple(getattr(arguments, "beside", ())),
    )


def valve_of(arguments: argparse.Namespace) -> "records.ValveFile | None":
    """Read the given valve file, or that in the bag, if any."""
    path = arguments.valve or _own_description(arguments.file)
    return None if path is None else records.read_valve_file(path, arguments.valve_name)


def save_columns(arguments: argparse.Namespace, reading: "records.ReadingOptions") -> None:
    """Write the recognized format of the table into the valve file, if requested.

    Raises ValueError if the recording is a bag or leaves a question open; OSError if writing fails.
    """
    if arguments.save_columns is None:
        return
    from valve_friction_ros.records.table import OpenTables  # noqa: PLC0415 - slow to import
    from valve_friction_ros.records.valve_file import with_columns  # noqa: PLC0415

    table = OpenTables((arguments.file, *reading.beside), reading.columns)
    table.require_settled()
    source = arguments.valve
    text = "" if source is None else source.read_text(encoding="utf-8-sig")
    try:
        text = with_columns(text or "{}\n", table.layout.form)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None
    write_whole(arguments.save_columns, text.removeprefix("{}\n").encode())


@contextlib.contextmanager
def reading_progress() -> "Iterator[None]":
    """Show on a terminal how much of a large text has been read."""
    from valve_friction_ros.records.table_rows import PROGRESS  # noqa: PLC0415 - slow to import

    if not sys.stderr.isatty():
        yield
        return
    from rich.progress import Progress  # noqa: PLC0415 - slow to import

    from valve_friction_ros.commands.console import shown_progress  # noqa: PLC0415

    with shown_progress(*Progress.get_default_columns()) as progress:
        task = progress.add_task("reading", total=1.0)
        token = PROGRESS.set(lambda share: progress.update(task, completed=share))
        try:
            yield
        finally:
            PROGRESS.reset(token)


@contextlib.contextmanager
def identifying_progress(count: int) -> "Iterator[Callable[[], None]]":
    """Show on a terminal that recordings are being identified, and since when.

    The given function counts one of them as done.
    """
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn  # noqa: PLC0415 - slow

    from valve_friction_ros.commands.console import shown_progress  # noqa: PLC0415

    with shown_progress(TextColumn("identifying"), BarColumn(), TimeElapsedColumn()) as progress:
        task = progress.add_task("", total=count if count > 1 else None)
        yield lambda: progress.advance(task)


def _own_description(recording: Path) -> Path | None:
    folder = recording if recording.is_dir() else recording.parent
    place = folder / VALVE_FILE
    is_own = recording.is_dir() or (folder / "metadata.yaml").exists()
    return place if is_own and place.is_file() else None


def described(
    recording: Path, valve_file: Path | None, arguments: argparse.Namespace
) -> "tuple[records.ValveFile, records.ReadingOptions]":
    """Return the valve file of a recording, given or in the bag, and the reading options.

    A recorded force needs no valve file. Raises ValueError if the valve file cannot be read, or is
    required but not given.
    """
    from valve_friction_ros.records.recordings import holds_force  # noqa: PLC0415 - slow to import

    valve_file = valve_file or _own_description(recording)
    if valve_file is not None:
        description = records.read_valve_file(valve_file, arguments.valve_name)
        return description, reading_options(arguments, description.columns)
    reading = reading_options(arguments)
    with on_disk(recording) as path:
        has_force = holds_force(path, reading)
    if not has_force:
        raise ValueError(
            "pressure needs the diaphragm_area: give a valve file with --valve; `valve_friction "
            "describe-valve` writes one"
        )
    return records.ValveFile(model.Valve(), MappingProxyType({})), reading


def require_one(recorded: "Sequence[records.RecordedValve]", purpose: str) -> None:
    """Refuse several valves if `purpose` takes only one.

    The ValueError names the valves and the option to choose one.
    """
    if len(recorded) > 1:
        names = ", ".join(each.name for each in recorded)
        raise ValueError(f"{purpose} one valve: choose one of {names} with --valve-name")


def read_one(
    path: Path, valve: "model.Valve", reading: "records.ReadingOptions"
) -> "records.RecordedValve":
    """Read the only valve in a file, or the chosen valve.

    Raises ValueError or RefusalError if it cannot be read: one line with file, cause and remedy.
    """
    with reading_progress():
        recorded = records.read_recordings(path, valve, reading)
    require_one(recorded, f"{path} holds several, and this command takes")
    return recorded[0]
