"""Recordings in CSV files, gzipped or not."""

import contextlib
import csv
import gzip
import itertools
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.monitoring.resampling import GapError, uniform_recording
from valve_friction_ros.monitoring.samples import Samples

__all__ = ["CsvColumns", "drive_column", "read_columns", "read_recording"]

_FIRST_ROW = 2
"""Number of the first row of data, as a spreadsheet counts."""

_LONGEST_QUOTE = 40
"""Characters of a bad entry that a message repeats."""

_LATEST_TIME = 9e9
"""Latest time whose nanoseconds a signed 64-bit number holds, s, rounded down."""


@dataclass(frozen=True)
class CsvColumns:
    """Headers of the columns of a recording; a machine without a diaphragm gives its force."""

    time: str = "time_s"
    position: str = "position_m"
    pressure: str = "pressure_pa"
    force: str = "force_n"


def _is_gzipped(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(2) == b"\x1f\x8b"


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[IO[str]]:
    """Open a file, gzipped or not; what cannot be read to its end raises a ValueError."""
    try:
        if _is_gzipped(path):
            with gzip.open(path, "rt", encoding="utf-8-sig", newline="") as stream:
                yield stream
        else:
            with path.open(encoding="utf-8-sig", newline="") as stream:
                yield stream
    except (OSError, EOFError, UnicodeDecodeError, csv.Error, zlib.error) as error:
        cause = (isinstance(error, OSError) and error.strerror) or error
        raise ValueError(f"{path}: cannot be read as CSV: {cause}") from None


def _header(path: Path) -> list[str]:
    with _opened(path) as stream:
        header = next(csv.reader(stream), None)
    if header is None:
        raise ValueError(f"{path}: the file is empty")
    if not header:
        raise ValueError(f"{path}: row 1 is blank; it must hold the column headers")
    return [name.strip() for name in header]


def _is_number(text: str) -> bool:
    """Tell whether numpy reads a number; Python would take underscores and foreign digits too."""
    try:
        float(text)
    except ValueError:
        return False
    return text.isascii() and "_" not in text


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}…"


def _first_bad_entry(path: Path, wanted: Mapping[str, int]) -> str:
    """Find the entry that is no number, for the message of an error already met."""
    with _opened(path) as stream:
        rows = csv.reader(stream)
        next(rows)
        for number, row in enumerate(rows, start=_FIRST_ROW):
            for name, index in wanted.items():
                if row and index >= len(row):
                    return f"row {number} has no entry in column {name!r}: complete or delete it"
                if row and not _is_number(row[index]):
                    return (
                        f"row {number}, column {name!r}: {_shortened(row[index])!r} is not a "
                        "number: mend it or delete the row"
                    )
    return "the table cannot be read"


def _row_of(path: Path, sample: int) -> int:
    """Row that holds a sample, as a spreadsheet counts; blank rows hold none."""
    with _opened(path) as stream:
        rows = csv.reader(stream)
        next(rows)
        filled = (number for number, row in enumerate(rows, start=_FIRST_ROW) if row)
        return next(itertools.islice(filled, sample, None))


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of numbers from a CSV file with a header.

    Parameters
    ----------
    path : Path
        The file, gzipped or not; told by its first bytes.
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
            raise ValueError(_no_column(path, repr(name), header))
        if header.count(name) > 1:
            raise ValueError(f"{path}: column {name!r} is there twice: rename one of them")
    wanted = {name: header.index(name) for name in names}
    try:
        with _opened(path) as stream, warnings.catch_warnings():
            warnings.filterwarnings("ignore", "loadtxt: input contained no data")
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
    if table.size == 0:
        raise ValueError(f"{path}: there are no rows under the header")
    columns = {name: table[:, index] for index, name in enumerate(wanted)}
    for name, values in columns.items():
        finite = np.isfinite(values)
        if not finite.all():
            sample = int(np.argmin(finite))
            raise ValueError(
                f"{path}: row {_row_of(path, sample)}, column {name!r}: {values[sample]} is not "
                "finite: use a stretch of the record without it"
            )
    return columns


def _no_column(path: Path, wanted: str, header: Sequence[str]) -> str:
    return f"{path}: no column {wanted} among {', '.join(header)}: rename one or name the right one"


def _stamps(path: Path, name: str, times: NDArray[np.float64]) -> NDArray[np.int64]:
    """Round times to nanoseconds; refuse times that are too large, repeat or go back."""
    if np.abs(times).max() > _LATEST_TIME:
        sample = int(np.argmax(np.abs(times)))
        raise ValueError(
            f"{path}: row {_row_of(path, sample)}, column {name!r}: {times[sample]:g} s is too "
            "large for a time: convert the column to seconds"
        )
    stamps = np.rint(times * 1e9).astype(np.int64)
    steps = np.diff(stamps)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        what, remedy = (
            ("repeats", "delete one of the rows")
            if steps[sample - 1] == 0
            else ("goes back", "sort the rows, or use the record before or after it")
        )
        raise ValueError(
            f"{path}: row {_row_of(path, sample)}, column {name!r} {what} "
            f"({times[sample]:.12g} after {times[sample - 1]:.12g}): {remedy}"
        )
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
    raise ValueError(_no_column(path, f"{columns.pressure!r} (or {columns.force!r})", header))


def read_recording(path: Path, valve: Valve, columns: CsvColumns | None = None) -> Recording:
    """Read a recording of pressure, or force, and stem position.

    Its samples pass through the same resampling as those of the topics, stamps rounded to
    nanoseconds, so that a record gives the same numbers here as there.

    Parameters
    ----------
    path : Path
        The file, gzipped or not; told by its first bytes.
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
        sample = int(np.argmin(readable))
        raise ValueError(
            f"{path}: row {_row_of(path, sample)}, column {drive!r}: {table[drive][sample]:g} is "
            f"outside the sensor's range {valve.pressure_minimum:g} to "
            f"{valve.pressure_maximum:g} Pa: use a stretch of the record without it, or mend the "
            "range"
        )
    try:
        return uniform_recording(
            Samples(stamps, pressure),
            Samples(stamps, table[columns.position]),
            (drive, columns.position),
        )
    except GapError as gap:
        raise RefusalError(
            f"{path}: row {_row_of(path, gap.sample)}, column {columns.time!r}: gap of "
            f"{gap.seconds:.3g} s: use a stretch of the record without it"
        ) from None
    except RefusalError as refusal:
        raise RefusalError(f"{path}: {refusal}") from None
