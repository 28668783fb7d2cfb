"""Arguments of the commands that read a recording: the file, its valve, and what it leaves open."""

import argparse
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.commands.valve_file import ValveFile, read_valve_file
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.monitoring.csv_recording import CsvColumns, drive_column, read_recording

__all__ = [
    "DIRECT_DRIVE",
    "add_recording_arguments",
    "described_valve",
    "read_one",
    "reading_options",
]

DIRECT_DRIVE = ValveFile(Valve(diaphragm_area=1.0), MappingProxyType({}))
"""A machine without a diaphragm: 1 Pa of "pressure" is 1 N of force."""


def add_recording_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the file, ``--valve``, and the options of reading."""
    parser.add_argument("file", type=Path, metavar="FILE.csv", help="recording, may be gzipped")
    parser.add_argument(
        "--valve",
        type=Path,
        metavar="FILE.yaml",
        help="diaphragm_area, pressure_reference, travel …; needed unless the file holds force_n",
    )
    for field in fields(CsvColumns):
        header = getattr(CsvColumns(), field.name)
        parser.add_argument(
            f"--{field.name}-column",
            default=header,
            metavar="HEADER",
            help="column header (%(default)s)",
        )


def reading_options(arguments: argparse.Namespace) -> CsvColumns:
    """Build the options of reading from the parsed arguments."""
    return CsvColumns(
        **{field.name: getattr(arguments, f"{field.name}_column") for field in fields(CsvColumns)}
    )


def described_valve(arguments: argparse.Namespace, reading: CsvColumns) -> ValveFile:
    """Read the valve file; a recorded force needs none.

    Raises
    ------
    ValueError
        If the valve file cannot be read, or is needed and not given.
    """
    if arguments.valve is not None:
        return read_valve_file(arguments.valve)
    if drive_column(arguments.file, reading) == reading.pressure:
        raise ValueError("pressure needs the diaphragm_area: give a valve file by --valve")
    return DIRECT_DRIVE


def read_one(path: Path, valve: Valve, reading: CsvColumns) -> Recording:
    """Read the recording of the one valve that a file holds.

    Raises
    ------
    ValueError, RefusalError
        If it cannot be read: one line that names the file, the cause and what to do.
    """
    return read_recording(path, valve, reading)
