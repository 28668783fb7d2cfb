"""Recordings in CSV files, gzipped or not."""

import csv
import gzip
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.monitoring.resampling import uniform_recording
from valve_friction_ros.monitoring.samples import Samples

__all__ = ["CsvColumns", "drive_column", "read_columns", "read_recording"]

_FIRST_ROW = 2
"""Number of the first row of data, as a spreadsheet counts."""


@dataclass(frozen=True)
class CsvColumns:
    """Headers of the columns of a recording; a machine without a diaphragm gives its force."""

    time: str = "time_s"
    position: str = "position_m"
    pressure: str = "pressure_pa"
    force: str = "force_n"


def _open(path: Path) -> IO[str]:
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8-sig", newline="")
    return path.open(encoding="utf-8-sig", newline="")


def _header(path: Path) -> list[str]:
    try:
        with _open(path) as stream:
            header = next(csv.reader(stream), [])
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read: {error}") from None
    if not header:
        raise ValueError(f"{path}: the file is empty")
    return [name.strip() for name in header]


def _first_bad_entry(path: Path, wanted: Mapping[str, int]) -> str:
    """Find the entry that is no number, for the message of an error already met."""
    with _open(path) as stream:
        rows = csv.reader(stream)
        next(rows)
        for number, row in enumerate(rows, start=_FIRST_ROW):
            for name, index in wanted.items():
                if row and index >= len(row):
                    return f"row {number} has no entry in column {name!r}"
                try:
                    float(row[index]) if row else None
                except ValueError:
                    return f"row {number}, column {name!r}: {row[index]!r} is not a number"
    return "the table cannot be read"


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of numbers from a CSV file with a header.

    Parameters
    ----------
    path : Path
        The file; gzipped if it ends in ``.gz``.
    names : sequence of str
        Headers of the wanted columns; others are ignored.

    Returns
    -------
    dict of str to ndarray of float, shape (n,) each
        The columns by name.

    Raises
    ------
    ValueError
        In one line: the file, the row (as a spreadsheet counts) and what is wrong.
    """
    header = _header(path)
    for name in names:
        if name not in header:
            raise ValueError(f"{path}: no column {name!r}; it has {', '.join(header)}")
    wanted = {name: header.index(name) for name in names}
    try:
        with _open(path) as stream:
            table = np.loadtxt(
                stream,
                delimiter=",",
                skiprows=1,
                usecols=list(wanted.values()),
                comments=None,
                quotechar='"',
                ndmin=2,
            )
    except (ValueError, IndexError):
        raise ValueError(f"{path}: {_first_bad_entry(path, wanted)}") from None
    except (OSError, EOFError) as error:
        raise ValueError(f"{path}: cannot be read to its end: {error}") from None
    if table.size == 0:
        raise ValueError(f"{path}: there are no rows under the header")
    columns = {name: table[:, index] for index, name in enumerate(wanted)}
    for name, values in columns.items():
        finite = np.isfinite(values)
        if not finite.all():
            row = int(np.argmin(finite))
            raise ValueError(f"{path}: row {row + _FIRST_ROW}: {name} is {values[row]}")
    return columns


def _stamps(path: Path, name: str, times: NDArray[np.float64]) -> NDArray[np.int64]:
    stamps = np.rint(times * 1e9).astype(np.int64)
    steps = np.diff(stamps)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0))
        what = "repeats" if steps[row] == 0 else "goes back"
        raise ValueError(f"{path}: row {row + 1 + _FIRST_ROW}: {name} {what} ({times[row + 1]:g})")
    return stamps


def drive_column(path: Path, columns: CsvColumns) -> str:
    """Return the header of what drives the stem: the pressure, or else the force.

    Raises
    ------
    ValueError
        If the file cannot be read or has neither.
    """
    header = _header(path)
    for name in (columns.pressure, columns.force):
        if name in header:
            return name
    raise ValueError(
        f"{path}: no column {columns.pressure!r} (or {columns.force!r}); it has {', '.join(header)}"
    )


def read_recording(path: Path, valve: Valve, columns: CsvColumns | None = None) -> Recording:
    """Read a recording of pressure, or force, and stem position.

    Its samples pass through the same resampling as those of the topics, stamps rounded to
    nanoseconds, so that a record gives the same numbers here as there.

    Parameters
    ----------
    path : Path
        The file; gzipped if it ends in ``.gz``.
    valve : Valve
        Turns force into pressure where the file holds a force; tells the sensor's range.
    columns : CsvColumns, optional
        Headers of the columns. A file with both pressure and force is read by its pressure.

    Returns
    -------
    Recording
        On a uniform grid.

    Raises
    ------
    ValueError
        If the file cannot be read or holds something impossible: the file, row and cause.
    RefusalError
        If there is a gap, or only one sample.
    """
    columns = columns or CsvColumns()
    drive = drive_column(path, columns)
    table = read_columns(path, (columns.time, columns.position, drive))
    stamps = _stamps(path, columns.time, table[columns.time])
    pressure = table[drive] if drive == columns.pressure else valve.actuator_pressure(table[drive])
    readable = valve.sensor_reads(pressure)
    if not readable.all():
        row = int(np.argmin(readable))
        raise ValueError(
            f"{path}: row {row + _FIRST_ROW}: {drive} is outside the sensor's range "
            f"{valve.pressure_minimum:g} to {valve.pressure_maximum:g} Pa ({table[drive][row]:g})"
        )
    return uniform_recording(
        Samples(stamps, pressure),
        Samples(stamps, table[columns.position]),
        (drive, columns.position),
    )
