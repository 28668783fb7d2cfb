"""Arguments of the commands that read a recording: the file, its valve, and what it leaves open."""

import argparse
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.model import Valve
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.csv_recording import (
    KNOWN_UNITS,
    CsvColumns,
    CsvFormat,
    CsvUnits,
)
from valve_friction_ros.records.csv_table import CsvLayout
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import ReadingOptions, holds_force, read_recordings
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.valve_file import ValveFile, read_valve_file

__all__ = [
    "add_reading_arguments",
    "add_recording_arguments",
    "read_one",
    "reading_options",
    "require_one",
    "valve_of",
]

_TABS = {"tab": "\t", "\\t": "\t"}
"""What people type for a tab, which a shell makes hard to type."""


def add_recording_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the file, ``--valve``, and the options of reading."""
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="recording: CSV, may be gzipped; or a bag of ROS 2, MCAP or SQLite3: its folder or "
        "one of its files, may be compressed",
    )
    parser.add_argument(
        "--valve",
        type=Path,
        metavar="FILE.yaml",
        help="diaphragm_area, pressure_reference, travel …; needed unless the file holds force_n",
    )
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what a file does not say itself."""
    stretch = parser.add_argument_group("part of the recording")
    for name, help_text in (
        ("begin", "leave out what lies before S seconds after the first sample"),
        ("end", "leave out what lies after S seconds after the first sample"),
        ("last", "only the last S seconds, as a node with `window` S takes them"),
    ):
        stretch.add_argument(
            f"--{name}", type=float, default=getattr(Stretch(), name), metavar="S", help=help_text
        )
    bag = parser.add_argument_group(
        "bags", "topics are found by their types, unless these options name them"
    )
    bag.add_argument(
        "--pressure-topic",
        metavar="TOPIC",
        help="topic of the pressure; without a leading slash: in the namespace of each valve",
    )
    bag.add_argument("--stem-topic", metavar="TOPIC", help="topic of the stem, likewise")
    bag.add_argument(
        "--joint", metavar="NAME", help="joint that is the stem (the only one, or 'stem')"
    )
    bag.add_argument("--valve-name", metavar="NAMESPACE", help="only this valve of several")
    table = parser.add_argument_group("CSV")
    for name, units in KNOWN_UNITS.items():
        header, unit = getattr(CsvColumns(), name), getattr(CsvUnits(), name)
        table.add_argument(
            f"--{name}-column", default=header, metavar="HEADER", help="column header (%(default)s)"
        )
        table.add_argument(
            f"--{name}-unit",
            default=unit,
            choices=units,
            metavar="UNIT",
            help=f"{', '.join(units)} (%(default)s)",
        )
    table.add_argument(
        "--delimiter",
        default=",",
        metavar="MARK",
        help="between the entries of a row: , ; tab … (%(default)s)",
    )
    table.add_argument(
        "--decimal", default=".", metavar="MARK", help="decimal mark, . or , (%(default)s)"
    )


def reading_options(arguments: argparse.Namespace) -> ReadingOptions:
    """Build the options of reading from the parsed arguments.

    Raises ValueError if they do not go together.
    """
    columns = {
        field.name: getattr(arguments, f"{field.name}_column") for field in fields(CsvColumns)
    }
    units = {field.name: getattr(arguments, f"{field.name}_unit") for field in fields(CsvUnits)}
    delimiter = _TABS.get(arguments.delimiter, arguments.delimiter)
    return ReadingOptions(
        CsvFormat(
            CsvColumns(**columns), CsvUnits(**units), CsvLayout(delimiter, arguments.decimal)
        ),
        TopicChoice(
            arguments.pressure_topic, arguments.stem_topic, arguments.joint, arguments.valve_name
        ),
        Stretch(arguments.begin, arguments.end, arguments.last),
    )


def valve_of(recording: Path, valve_file: Path | None, reading: ReadingOptions) -> ValveFile:
    """Read the valve file of a recording; a recorded force needs none.

    Raises ValueError if the valve file cannot be read, or is needed and not given.
    """
    if valve_file is not None:
        return read_valve_file(valve_file)
    if not holds_force(recording, reading):
        raise ValueError("pressure needs the diaphragm_area: give a valve file by --valve")
    return ValveFile(Valve(), MappingProxyType({}))


def require_one(recorded: Sequence[RecordedValve], purpose: str) -> None:
    """Refuse several valves where `purpose` is for one.

    The ValueError names the valves and the option that chooses one.
    """
    if len(recorded) > 1:
        names = ", ".join(each.name for each in recorded)
        raise ValueError(f"{purpose} one valve: choose one of {names} by --valve-name")


def read_one(path: Path, valve: Valve, reading: ReadingOptions) -> RecordedValve:
    """Read the one valve that a file holds, or that was chosen.

    Raises ValueError or RefusalError if it cannot be read: one line that names the file, the cause
    and what to do.
    """
    recorded = read_recordings(path, valve, reading)
    require_one(recorded, f"{path} holds several, and this command takes")
    return recorded[0]
