"""Recordings in tables: CSV files, gzipped or not, Excel and Parquet."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.tables.table import (
    OpenTable,
    Table,
    joined,
    open_table,
    require_room,
)
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

__all__ = ["drive_column", "read_table"]

_LATEST_TIME = 9e9
"""Latest time whose nanoseconds a signed 64-bit number holds, s, rounded down."""

_FAR = 1e200
"""Times beyond this overflow as nanoseconds, and are too late in any unit."""

_Times = NDArray[np.float64] | NDArray[np.int64]


def _on_clock(times: _Times, unit: str) -> _Times:
    """Return times in ns, finite ones also where they are refused; those of dates are."""
    if times.dtype == np.int64:
        return times
    far = np.isfinite(times) & (np.abs(times) > _FAR)
    return np.where(far, np.copysign(_FAR, times), times) * NANOSECONDS[unit]


def _stamps(table: Table, name: str, unit: str) -> NDArray[np.int64]:
    """Round times to nanoseconds; refuse times that are too large, repeat or go back."""
    times = table.columns[name]
    is_date = times.dtype == np.int64
    on_clock = _on_clock(times, unit)
    if not is_date and np.abs(on_clock).max() > _LATEST_TIME * 1e9:
        sample = int(np.argmax(np.abs(times)))
        raise ValueError(
            f"{table.place(sample, name)}: {times[sample]:g} {unit} is too large for a time: "
            "name the unit of the column, or convert it to seconds"
        )
    stamps = np.rint(on_clock).astype(np.int64) if not is_date else np.asarray(times, np.int64)
    steps = np.diff(stamps)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        what, remedy = (
            ("repeats", "delete one of the rows")
            if steps[sample - 1] == 0
            else ("goes back", "sort the rows, or use the record before or after it")
        )
        now, before = (
            str(np.datetime64(int(time), "ns")) if is_date else f"{time:.12g}"
            for time in (times[sample], times[sample - 1])
        )
        raise ValueError(f"{table.place(sample, name)} {what} ({now} after {before}): {remedy}")
    return stamps


def _require_rising(block: Table, form: Columns, stretch: Stretch, start: float) -> None:
    """Refuse times of a block that are finite and do not rise, before the rest is read."""
    if stretch.last < math.inf:
        return  # the block may yet be left out
    times = _on_clock(block.columns[form.time_column], form.time_unit)
    chosen = block.where(stretch.select(times, start))
    if chosen.rows.size and np.isfinite(times).all():
        _stamps(chosen, form.time_column, form.time_unit)


def _position(table: Table, form: Columns, valve: Valve) -> NDArray[np.float64]:
    """Return the position in m, rising the way in which the pressure pushes the stem."""
    unit = form.position_unit
    needs = "a position in percent" if unit == PERCENT else "an inverted position"
    if (unit == PERCENT or form.inverted_position) and not math.isfinite(valve.travel):
        raise ValueError(
            f"{table.path}: {needs} is a share of the travel: name the travel in the valve file"
        )
    size = Unit(valve.travel, 100) if unit == PERCENT else POSITION_UNITS[unit]
    position = size.to_si(np.asarray(table.columns[form.position_column], np.float64))
    return valve.travel - position if form.inverted_position else position


def _opened(path: Path, form: Columns) -> tuple[OpenTable, str]:
    """Open a table; return the header of its drive too: the pressure, or else the force."""
    either = (form.pressure_column, form.force_column)
    table = open_table(path, form, [[form.time_column], [form.position_column], either])
    for name in either:
        if name in table.header:
            return table, name
    wanted = f"{either[0]!r} (or {either[1]!r})"
    raise ValueError(table.no_column(wanted, ("pressure", "force")))


def drive_column(path: Path, form: Columns) -> str:
    """Return the header of the signal that drives the stem: the pressure, or else the force.

    Raises ValueError if the file cannot be read or has neither pressure nor force.
    """
    return _opened(path, form)[1]


def _pressure(table: Table, name: str, valve: Valve, form: Columns) -> NDArray[np.float64]:
    """Return a pressure in Pa; refuse one outside the sensor's range."""
    values, unit = np.asarray(table.columns[name], np.float64), form.pressure_unit
    pressure = PRESSURE_UNITS[unit].to_si(values)
    _require_readable(table, name, valve, pressure, f"{{:g}} {unit}", values)
    return pressure


def _require_readable(
    table: Table,
    name: str,
    valve: Valve,
    pressure: NDArray[np.float64],
    words: str,
    values: NDArray[np.float64],
) -> None:
    readable = valve.sensor_reads(pressure)
    if not readable.all():
        sample = int(np.argmin(readable))
        raise ValueError(
            f"{table.place(sample, name)}: {words.format(values[sample])} is outside the sensor's "
            f"range {valve.pressure_minimum:g} to {valve.pressure_maximum:g} Pa: use a stretch "
            "of the record without it, name its unit, or correct the range"
        )


def _drive(
    table: Table, name: str, valve: Valve, form: Columns
) -> tuple[NDArray[np.float64], Drive]:
    """Return the drive in its SI unit.

    A force on the diaphragm of a valve becomes the pressure that exerts it. Of a double-acting
    actuator it is the pressure that alone would exert the force of both.
    """
    if name == form.pressure_column:
        drive = _pressure(table, name, valve, form)
        if form.opposing_pressure_column:
            opposing = _pressure(table, form.opposing_pressure_column, valve, form)
            drive = drive - form.opposing_area_ratio * (opposing - valve.pressure_reference)
        return drive, Drive.PRESSURE
    values = np.asarray(table.columns[name], np.float64)
    drive = valve.actuator_drive(FORCE_UNITS[form.force_unit].to_si(values))
    _require_readable(table, name, valve, drive, f"{{:g}} {form.force_unit}", values)
    return drive, valve.driven_by


def _chosen(opened: OpenTable, names: Mapping[str, str], stretch: Stretch) -> Table:
    """Read the stretch, and keep no more of the table than that."""
    form = opened.form
    kept: list[Table] = []
    start: float | None = None
    for block in opened.blocks(names, form.time_column):
        times = _on_clock(block.columns[form.time_column], form.time_unit)
        if start is None:
            start = float(times[0]) if times.dtype == np.float64 else int(times[0])
        since = times - start
        if (since > stretch.end * 1e9).all():
            break
        if (since < stretch.begin * 1e9).all():
            continue
        _require_rising(block, form, stretch, start)
        kept.append(block)
        newest = min(float(since[-1]), stretch.end * 1e9)
        while len(kept) > 1 and math.isfinite(newest):
            oldest = _on_clock(kept[0].columns[form.time_column], form.time_unit)[-1] - start
            if not newest - oldest > (stretch.last + 1) * 1e9:
                break
            del kept[0]
        require_room(opened.path, form, sum(each.rows.size for each in kept))
    if start is None:
        raise ValueError(f"{opened.path}: there are no rows under the header")
    if kept:
        table = joined(kept)
        times = _on_clock(table.columns[form.time_column], form.time_unit)
        table = table.where(stretch.select(times, start))
    if not kept or table.rows.size == 0:
        raise RefusalError(
            f"{opened.path}: the chosen stretch holds no rows: choose another begin or end"
        )
    return table


def read_table(
    path: Path,
    valve: Valve,
    form: Columns | None = None,
    stretch: Stretch | None = None,
) -> RecordedValve:
    """Read a recording of pressure, or force, and stem position.

    Its samples pass through the same resampling as the samples of topics, with stamps in whole
    nanoseconds, so that a recording gives the same numbers from a file and from topics.

    Parameters
    ----------
    path : Path
        The file; its first bytes decide what it is.
    valve : Valve
        With a diaphragm it converts a force in the file into a pressure; it gives the sensor's
        range, and the travel for positions in percent.
    form : Columns, optional
        Columns, units and layout. Pressure is read from a file with both pressure and force.
    stretch : Stretch, optional
        The part to read; errors outside it do not matter.

    Returns
    -------
    RecordedValve
        The recording on a uniform grid.

    Raises
    ------
    ValueError
        If the file cannot be read or holds an impossible value: file, row, cause and remedy.
    RefusalError
        If there is only one sample, or gaps take more than half of the time.
    """
    form, stretch = form or Columns(), stretch or Stretch()
    opened, name = _opened(path, form)
    names = {
        form.time_column: "time",
        form.position_column: "position",
        name: "pressure" if name == form.pressure_column else "force",
    }
    if form.opposing_pressure_column:
        if name != form.pressure_column:
            raise ValueError(
                f"{path}: a double-acting actuator has two pressures, and there is no column "
                f"{form.pressure_column!r}: name the pressure that pushes the stem to larger "
                "positions"
            )
        names[form.opposing_pressure_column] = "pressure"
    table = _chosen(opened, names, stretch)
    table.require_finite()
    stamps = _stamps(table, form.time_column, form.time_unit)
    drive, driven_by = _drive(table, name, valve, form)
    position = _position(table, form, valve)
    try:
        recording = uniform_recording(
            Samples(stamps, drive),
            Samples(stamps, position),
            (name, form.position_column),
            driven_by,
            lambda gap: (
                f"{table.entry(gap.sample, form.time_column)}: gap of {gap.seconds:.3g} s: use a "
                "stretch of the record without it"
            ),
        )
    except RefusalError as refusal:
        raise RefusalError(f"{path}: {refusal}") from None
    return RecordedValve(path, "", recording, table.notes)
