# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reading of recordings from tables and bags."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import LONG_PAUSE, Pauses, numbers_in_runs
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.topics import TopicChoice, bag_libraries, is_bag
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.header_words import plain_name
from valve_friction_ros.records.layout import TableSignal
from valve_friction_ros.records.recorded_valve import WITHOUT_GAP, RecordedValve, Stretch
from valve_friction_ros.records.table import (
    OpenTables,
    ReadSignal,
    fault_of,
    jumps_to_zero,
    left_out,
)
from valve_friction_ros.records.table_rows import readable
from valve_friction_ros.records.units import (
    FORCE_UNITS,
    POSITION_UNITS,
    PRESSURE_UNITS,
    SHARES,
    span,
)
from valve_friction_ros.streams.samples import Samples, uniform_recording
from valve_friction_ros.wording import lasting


def _share(read: ReadSignal) -> NDArray[np.float64]:
    low, high = SHARES[read.signal.unit]
    return (read.values - low) / (high - low)


def _pressure_range(valve: Valve, form: Columns) -> tuple[float, float]:
    if form.pressure_range:
        return span(form.pressure_range, PRESSURE_UNITS)
    return valve.pressure_minimum, valve.pressure_maximum


def _require_ranges(signals: Sequence[TableSignal], valve: Valve, form: Columns) -> None:
    """Refuse shares of an unknown range or travel, and name both if both are unknown."""
    lacking = {}
    for one in signals:
        is_share = one.unit in SHARES
        if is_share and one.quantity == "pressure":
            if not all(map(math.isfinite, _pressure_range(valve, form))):
                lacking[
                    f"a pressure in {one.unit} is a share of the transmitter's range: specify the "
                    "range (--pressure-range '0..2.5 bar', or pressure_minimum and "
                    "pressure_maximum of the valve file)"
                ] = one
        elif one.quantity == "position" and (is_share or form.inverted_position):
            needs = f"a position in {one.unit}" if is_share else "an inverted position"
            if not math.isfinite(valve.travel):
                lacking[f"{needs} is a share of the travel: give the travel in the valve file"] = (
                    one
                )
    if lacking:
        path = next(iter(lacking.values())).path
        raise ValueError(f"{path}: {'; '.join(lacking)}")


def _position(read: ReadSignal, form: Columns, valve: Valve) -> NDArray[np.float64]:
    """Return the position in m, positive in the direction in which the pressure pushes the stem."""
    is_share = read.signal.unit in SHARES
    if is_share and read.signal.unit != "percent":
        position = _share(read) * valve.travel
    elif is_share:
        position = read.values * valve.travel / 100
    else:
        position = POSITION_UNITS[read.signal.unit].to_si(read.values)
    return valve.travel - position if form.inverted_position else position


def _pressure(read: ReadSignal, valve: Valve, form: Columns) -> NDArray[np.float64]:
    """Return a pressure in Pa; refuse values outside the range of the sensor."""
    unit = read.signal.unit
    if unit in SHARES:
        low, high = _pressure_range(valve, form)
        pressure = low + _share(read) * (high - low)
    else:
        pressure = PRESSURE_UNITS[unit].to_si(read.values)
    _require_readable(read, valve, pressure)
    return pressure


def _require_readable(read: ReadSignal, valve: Valve, pressure: NDArray[np.float64]) -> None:
    readable = valve.sensor_reads(pressure)
    if not readable.all():
        sample, unit = int(np.argmin(readable)), read.signal.unit
        raise ValueError(
            f"{read.signal.path}: {read.place(sample)}: {read.values[sample]:g} {unit} is outside "
            f"the sensor's range {valve.pressure_minimum:g} to {valve.pressure_maximum:g} Pa: use "
            "a stretch of the record without it, specify its unit, or correct the range"
        )


def _drive(
    reads: Sequence[ReadSignal], valve: Valve, form: Columns
) -> tuple[NDArray[np.float64], Drive]:
    """Return the drive in its SI unit.

    A force on the diaphragm of a valve is converted to the pressure that exerts it. For a
    double-acting actuator the drive is the single pressure that would exert the net force.
    """
    read, *others = reads
    if read.signal.quantity == "force":
        force = FORCE_UNITS[read.signal.unit].to_si(read.values)
        drive = valve.actuator_drive(force)
        _require_readable(read, valve, drive)
        return drive, valve.driven_by
    drive = _pressure(read, valve, form)
    for other in others:
        opposing = _pressure(other, valve, form)
        own = np.interp(read.stamps, other.stamps, opposing)
        drive = drive - form.opposing_area_ratio * (own - valve.pressure_reference)
    return drive, Drive.PRESSURE


_MANY = 0.1
_MOST_HELD = 300_000
"""Share of the pauses, or of the time in pauses, that is long in a signal stored on change; and the
values that are held at most, about: some 10 MB."""


def _is_irregular(pauses: Pauses) -> bool:
    """Return whether no clock has sampled a signal: a historian stored it on change."""
    return bool(np.quantile(pauses.length, 1.0 - _MANY) >= LONG_PAUSE * pauses.scan)


def _held(read: ReadSignal, pauses: Pauses, gaps: NDArray[np.bool_]) -> ReadSignal:
    """Repeat each stored value of a signal, scan by scan, up to the next, outside gaps.

    A value after a long pause that is no usual step away was stored as the end of a line.
    """
    length = pauses.length
    step = max(pauses.scan, float(np.sum(length[~gaps])) / _MOST_HELD)
    times = np.maximum(np.rint(length / step).astype(np.intp), 1)
    times = np.append(np.where(gaps, 1, times), 1)
    which = np.repeat(np.arange(times.size), times)
    after = numbers_in_runs(times) / times[which]
    moves = np.where(pauses.is_long & ~pauses.is_usual, np.diff(read.values), 0.0)
    held = read.where(which)
    return replace(
        held,
        stamps=held.stamps + (after * np.append(length, 0)[which]).astype(np.int64),
        values=held.values + after * np.append(moves, 0.0)[which],
    )


def _filled(reads: Sequence[ReadSignal]) -> tuple[list[ReadSignal], list[str]]:
    """Hold the values of signals that are stored on change, and name these.

    They have many long pauses, as no clock makes them, or rest in a share of their time.
    A pause is a gap if all signals have lost most of it, as a historian that is off loses all; and
    after a bad value, as nothing is known then.
    """
    if min(each.stamps.size for each in reads) < StampedSignal.FEWEST:
        return [*reads], []
    judged = [Pauses.of(each.stamps, each.values) for each in reads]
    lost = [one.is_long & ~one.silences & (not _is_irregular(one)) for one in judged]
    found, notes = [], []
    for read, pauses, own in zip(reads, judged, lost, strict=True):
        gaps, length = own.copy(), pauses.length
        for other, its, gone in zip(reads, judged, lost, strict=True):
            until = np.append(0, np.cumsum(np.where(gone, its.length, 0)))
            gaps &= 2.0 * np.diff(np.interp(read.stamps, other.stamps, until)) > length
        after_bad = np.searchsorted(read.stamps, read.bad_at)
        gaps |= pauses.is_long & np.isin(np.arange(1, read.stamps.size), after_bad)
        held = float(np.sum(length[pauses.is_long & ~gaps]))
        is_stored = _is_irregular(pauses) or held > _MANY * np.sum(length)
        found.append(_held(read, pauses, gaps) if is_stored else read)
        if is_stored:
            lines = np.count_nonzero(pauses.is_long & ~pauses.is_usual & ~gaps)
            notes.append(
                f"{read.signal.name!r} is compressed: each of its {read.stamps.size} stored "
                "values is held until the next"
                + (f"; {lines} long lines are kept" if lines else "")
            )
    return found, notes


def _recorded(
    table: OpenTables, reads: Sequence[ReadSignal], valve: Valve
) -> tuple[Recording, tuple[str, ...]]:
    """Build the recording of one valve, with notes, from drive, position and opposing pressure."""
    form = table.layout.form
    for each in reads:
        if fault := fault_of(each, form):
            raise ValueError(fault)
    if doubts := table.doubts(reads):
        raise ValueError(table.asked(doubts))
    notes = [] if table.layout.is_own else [table.layout.words]
    notes += [told for each in reads for told in (left_out(each), jumps_to_zero(each)) if told]
    reads, told = _filled(reads)
    notes += told
    drives = [each for each in reads if each.signal.quantity != "position"]
    (stem,) = (each for each in reads if each.signal.quantity == "position")
    drive, driven_by = _drive(drives, valve, form)
    position = _position(stem, form, valve)
    names = (drives[0].signal.name, stem.signal.name)
    by_name = dict(zip(names, (drives[0], stem), strict=True))
    try:
        recording = uniform_recording(
            Samples(drives[0].stamps, drive),
            Samples(stem.stamps, position),
            names,
            driven_by,
            lambda gap: (
                f"row {by_name[gap.name].rows[gap.sample]}, column "
                f"{table.clock_of(by_name[gap.name].signal)!r}: gap of "
                f"{lasting(gap.seconds)}: {gap.remedy(WITHOUT_GAP)}"
            ),
            (drives[0].bad_at, stem.bad_at),
        )
    except RefusalError as refusal:
        raise RefusalError(f"{table.name}: {refusal}") from None
    return recording, tuple(notes)


@dataclass(frozen=True)
class ReadingOptions:
    """Options for properties that a file does not state itself.

    Attributes
    ----------
    columns : Columns
        Columns, units and layout of a table.
    topics : TopicChoice
        The topics to read from a bag.
    stretch : Stretch
        The part to read.
    beside : tuple of Path
        Further tables of the same valve, if each signal has its own file.
    """

    columns: Columns = field(default_factory=Columns)
    topics: TopicChoice = field(default_factory=TopicChoice)
    stretch: Stretch = field(default_factory=Stretch)
    beside: tuple[Path, ...] = ()


def _read_table(path: Path, valve: Valve, options: ReadingOptions) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a table; their first note tells how it was read.

    The samples are resampled like those of topics, with stamps in whole nanoseconds, so that a
    recording gives the same numbers from a file and from topics, unless it is compressed.
    """
    table = OpenTables((path, *options.beside), options.columns)
    table.require_settled()
    valves, name = table.layout.valves, options.topics.valve
    if name is not None and len(valves) > 1:
        chosen = {one: each for one, each in valves.items() if plain_name(one) == plain_name(name)}
        if not chosen:
            known = ", ".join(valves)
            raise ValueError(f"{path}: no valve is called {name!r}: choose one of {known}")
        valves = chosen
    every = [signal for signals in valves.values() for signal in signals]
    _require_ranges(every, valve, table.layout.form)
    read = dict(zip(every, table.read(every, options.stretch), strict=True))
    found = []
    for label, signals in valves.items():
        outcome: tuple[Recording | RefusalError, tuple[str, ...]]
        try:
            outcome = _recorded(table, [read[each] for each in signals], valve)
        except (ValueError, RefusalError) as error:
            if len(valves) == 1:
                raise
            outcome = RefusalError(str(error).removeprefix(f"{path}: ")), ()
        found.append(RecordedValve(path, label, *outcome))
    return tuple(found)


def holds_force(path: Path, options: ReadingOptions) -> bool:
    """Return whether a file has the force of a machine without a diaphragm, and no pressure.

    Raises ValueError if a table cannot be read or leaves a question open.
    """
    if _is_bag(path, options):
        return False
    table = OpenTables((path, *options.beside), options.columns)
    table.require_settled()
    signals = (signal for group in table.layout.valves.values() for signal in group)
    return any(signal.quantity == "force" for signal in signals)


def _is_bag(path: Path, options: ReadingOptions) -> bool:
    place = readable(path, options.columns.maximum_megabytes)
    if not is_bag(place):
        return False
    if options.beside:
        raise ValueError(f"{path}: a bag contains all signals of its valves: give it alone")
    if place != path:
        raise ValueError(f"{path}: a bag cannot be read from a pipe: give its folder or file")
    if options.columns.opposing_pressure_column:
        raise ValueError(
            f"{path}: the actuator is double-acting (opposing_pressure_column), but a bag has one "
            "pressure per valve: record the difference of the two, or export both as CSV"
        )
    return True


def read_recordings(
    path: Path, valve: Valve, options: ReadingOptions | None = None
) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a table or a bag, recognized by content.

    Parameters
    ----------
    path : Path
        CSV file, gzipped or not, ``-`` for standard input, Excel or Parquet; or bag: folder or
        file, MCAP or SQLite3, compressed or not.
    valve : Valve
        Range of the sensor, travel and diaphragm, for all valves of a bag.
    options : ReadingOptions, optional
        Format, topics and stretch.

    Returns
    -------
    tuple of RecordedValve
        One recording per valve. In a bag, a valve with bad signals has a refusal instead.

    Raises
    ------
    ValueError, RefusalError
        If nothing can be read, or the libraries for bags are missing. The message is one line with
        cause and remedy.
    """
    options = options or ReadingOptions()
    if _is_bag(path, options):
        with bag_libraries():
            from valve_friction_ros.records.bags.reading import read_bag  # noqa: PLC0415
        return read_bag(path, valve, options.topics, options.stretch)
    return _read_table(path, valve, options)
