"""Recorded files of any kind, read by one function."""

from dataclasses import dataclass, field
from pathlib import Path

from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.kind import is_bag
from valve_friction_ros.records.bags.libraries import bag_libraries
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.table_recording import drive_column, read_table
from valve_friction_ros.records.tables.pipes import readable

__all__ = ["ReadingOptions", "holds_force", "read_recordings"]


@dataclass(frozen=True)
class ReadingOptions:
    """Options for what a file does not state itself.

    Attributes
    ----------
    columns : Columns
        Columns, units and layout of a table.
    topics : TopicChoice
        The topics to read from a bag.
    stretch : Stretch
        The part of the time to read.
    """

    columns: Columns = field(default_factory=Columns)
    topics: TopicChoice = field(default_factory=TopicChoice)
    stretch: Stretch = field(default_factory=Stretch)


def holds_force(path: Path, options: ReadingOptions) -> bool:
    """Return whether a file holds the force of a machine without a diaphragm, and no pressure.

    Raises
    ------
    ValueError
        If it is a table that cannot be read, or has neither pressure nor force.
    """
    return not _is_bag(path, options) and (
        drive_column(path, options.columns) != options.columns.pressure_column
    )


def _is_bag(path: Path, options: ReadingOptions) -> bool:
    place = readable(path, options.columns.maximum_megabytes)
    if not is_bag(place):
        return False
    if place != path:
        raise ValueError(f"{path}: a bag cannot come through a pipe: name its folder or file")
    if options.columns.opposing_pressure_column:
        raise ValueError(
            f"{path}: the actuator is double-acting (opposing_pressure_column), and a bag has one "
            "pressure a valve: record the difference of the two, or export both as CSV"
        )
    return True


def read_recordings(
    path: Path, valve: Valve, options: ReadingOptions | None = None
) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a table or a bag; its content decides which it is.

    Parameters
    ----------
    path : Path
        CSV file, gzipped or not, ``-`` for standard input, Excel or Parquet; or bag: folder or
        file, MCAP or SQLite3, compressed or not.
    valve : Valve
        Range of the sensor, travel, and diaphragm; for all valves of a bag.
    options : ReadingOptions, optional
        Format, topics and stretch.

    Returns
    -------
    tuple of RecordedValve
        One from a table; from a bag one for each valve, with a refusal where its signals are
        bad.

    Raises
    ------
    ValueError, RefusalError
        If nothing can be read: one line with cause and remedy. So also for a bag without the
        libraries that bags need.
    """
    options = options or ReadingOptions()
    if _is_bag(path, options):
        with bag_libraries():
            from valve_friction_ros.records.bags.reading import read_bag  # noqa: PLC0415
        return read_bag(path, valve, options.topics, options.stretch)
    return (read_table(path, valve, options.columns, options.stretch),)
