"""Recordings in CSV files, gzipped or not."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.csv_table import (
    CsvLayout,
    CsvTable,
    no_column,
    read_header,
    read_table,
)
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.units import (
    FORCE_UNITS,
    NANOSECONDS,
    PERCENT,
    POSITION_UNITS,
    PRESSURE_UNITS,
    Unit,
)
from valve_friction_ros.streams.samples import Samples
from valve_friction_ros.streams.uniform_grid import uniform_recording

__all__ = ["KNOWN_UNITS", "CsvColumns", "CsvFormat", "CsvUnits", "drive_column", "read_csv"]

_LATEST_TIME = 9e9
"""Latest time whose nanoseconds a signed 64-bit number holds, s, rounded down."""


KNOWN_UNITS = {
    "time": (*NANOSECONDS,),
    "position": (*POSITION_UNITS, PERCENT),
    "pressure": (*PRESSURE_UNITS,),
    "force": (*FORCE_UNITS,),
}
"""Names of the units in which a column may be."""


@dataclass(frozen=True)
class CsvColumns:
    """Headers of the columns of a recording; a machine without a diaphragm has a force."""

    time: str = "time_s"
    position: str = "position_m"
    pressure: str = "pressure_pa"
    force: str = "force_n"


@dataclass(frozen=True)
class CsvUnits:
    """Units of those columns, by their names in `records.units`.

    Raises ValueError if a unit is unknown.
    """

    time: str = "s"
    position: str = "m"
    pressure: str = "Pa"
    force: str = "N"

    def __post_init__(self) -> None:
        """Refuse unknown units."""
        for name, known in KNOWN_UNITS.items():
            unit = getattr(self, name)
            if unit not in known:
                raise ValueError(f"unknown unit of {name} {unit!r}; known are {', '.join(known)}")


@dataclass(frozen=True)
class CsvFormat:
    """Format of a recording: columns, units and layout."""

    columns: CsvColumns = field(default_factory=CsvColumns)
    units: CsvUnits = field(default_factory=CsvUnits)
    layout: CsvLayout = field(default_factory=CsvLayout)


def _stamps(table: CsvTable, name: str, unit: str) -> NDArray[np.int64]:
    """Round times to nanoseconds; refuse times that are too large, repeat or go back."""
    times = table.columns[name]
    on_clock = times * NANOSECONDS[unit]
    if np.abs(on_clock).max() > _LATEST_TIME * 1e9:
        sample = int(np.argmax(np.abs(times)))
        raise ValueError(
            f"{table.place(sample, name)}: {times[sample]:g} {unit} is too large for a time: "
            "name the unit of the column, or convert it to seconds"
        )
    stamps = np.rint(on_clock).astype(np.int64)
    steps = np.diff(stamps)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        what, remedy = (
            ("repeats", "delete one of the rows")
            if steps[sample - 1] == 0
            else ("goes back", "sort the rows, or use the record before or after it")
        )
        raise ValueError(
            f"{table.place(sample, name)} {what} "
            f"({times[sample]:.12g} after {times[sample - 1]:.12g}): {remedy}"
        )
    return stamps


def _position_unit(path: Path, unit: str, valve: Valve) -> Unit:
    if unit != PERCENT:
        return POSITION_UNITS[unit]
    if not math.isfinite(valve.travel):
        raise ValueError(
            f"{path}: a position in percent is a share of the travel: name the travel in the "
            "valve file"
        )
    return Unit(valve.travel, 100)


def drive_column(path: Path, form: CsvFormat) -> str:
    """Return the header of the signal that drives the stem: the pressure, or else the force.

    Raises ValueError if the file cannot be read or has neither pressure nor force.
    """
    header = read_header(path, form.layout)
    columns = form.columns
    for name in (columns.pressure, columns.force):
        if name in header:
            return name
    raise ValueError(no_column(path, f"{columns.pressure!r} (or {columns.force!r})", header))


def _drive(
    table: CsvTable, name: str, valve: Valve, form: CsvFormat
) -> tuple[NDArray[np.float64], Drive]:
    """Return the drive in its SI unit; refuse a pressure outside the sensor's range.

    A force on the diaphragm of a valve becomes the pressure that exerts it.
    """
    values, unit, driven_by = table.columns[name], form.units.pressure, Drive.PRESSURE
    if name == form.columns.pressure:
        drive = PRESSURE_UNITS[unit].to_si(values)
    else:
        unit, driven_by = form.units.force, valve.driven_by
        drive = valve.actuator_drive(FORCE_UNITS[unit].to_si(values))
    readable = valve.sensor_reads(drive)
    if not readable.all():
        sample = int(np.argmin(readable))
        raise ValueError(
            f"{table.place(sample, name)}: {values[sample]:g} {unit} is outside the sensor's "
            f"range {valve.pressure_minimum:g} to {valve.pressure_maximum:g} Pa: use a stretch "
            "of the record without it, name its unit, or correct the range"
        )
    return drive, driven_by


def read_csv(
    path: Path,
    valve: Valve,
    form: CsvFormat | None = None,
    stretch: Stretch | None = None,
) -> Recording:
    """Read a recording of pressure, or force, and stem position.

    Its samples pass through the same resampling as the samples of topics, with stamps in whole
    nanoseconds, so that a recording gives the same numbers from a file and from topics.

    Parameters
    ----------
    path : Path
        The file, gzipped or not; its first bytes decide.
    valve : Valve
        With a diaphragm it converts a force in the file into a pressure; it gives the sensor's
        range, and the travel for positions in percent.
    form : CsvFormat, optional
        Columns, units and layout. Pressure is read from a file with both pressure and force.
    stretch : Stretch, optional
        The part to read; errors outside it do not matter.

    Returns
    -------
    Recording
        On a uniform grid.

    Raises
    ------
    ValueError
        If the file cannot be read or holds an impossible value: file, row, cause and remedy.
    RefusalError
        If there is only one sample, or gaps take more than half of the time.
    """
    form, stretch = form or CsvFormat(), stretch or Stretch()
    columns, units = form.columns, form.units
    name = drive_column(path, form)
    whole = read_table(path, (columns.time, columns.position, name), form.layout)
    table = whole.where(stretch.select(whole.columns[columns.time] * NANOSECONDS[units.time]))
    if table.samples.size == 0:
        raise RefusalError(f"{path}: the chosen stretch holds no rows: choose another begin or end")
    table.require_finite()
    stamps = _stamps(table, columns.time, units.time)
    drive, driven_by = _drive(table, name, valve, form)
    position = _position_unit(path, units.position, valve).to_si(table.columns[columns.position])
    try:
        return uniform_recording(
            Samples(stamps, drive),
            Samples(stamps, position),
            (name, columns.position),
            driven_by,
            lambda gap: (
                f"{table.entry(gap.sample, columns.time)}: gap of {gap.seconds:.3g} s: use a "
                "stretch of the record without it"
            ),
        )
    except RefusalError as refusal:
        raise RefusalError(f"{path}: {refusal}") from None
