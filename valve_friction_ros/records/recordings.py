"""Recorded files of any kind, read by one function."""

from dataclasses import dataclass, field
from pathlib import Path

from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.kind import is_bag
from valve_friction_ros.records.bags.libraries import bag_libraries
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.csv_recording import CsvFormat, drive_column, read_csv
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch

__all__ = ["ReadingOptions", "holds_force", "read_recordings"]


@dataclass(frozen=True)
class ReadingOptions:
    """Options for what a file does not state itself.

    Attributes
    ----------
    csv : CsvFormat
        Format of a CSV file.
    topics : TopicChoice
        The topics to read from a bag.
    stretch : Stretch
        The part of the time to read.
    """

    csv: CsvFormat = field(default_factory=CsvFormat)
    topics: TopicChoice = field(default_factory=TopicChoice)
    stretch: Stretch = field(default_factory=Stretch)


def holds_force(path: Path, options: ReadingOptions) -> bool:
    """Return whether a file holds the force of a machine without a diaphragm, and no pressure.

    Raises
    ------
    ValueError
        If it is a CSV file that cannot be read, or has neither pressure nor force.
    """
    return not is_bag(path) and drive_column(path, options.csv) != options.csv.columns.pressure


def read_recordings(
    path: Path, valve: Valve, options: ReadingOptions | None = None
) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a CSV file or a bag; its content decides which it is.

    Parameters
    ----------
    path : Path
        CSV file, gzipped or not; or bag: folder or file, MCAP or SQLite3, compressed or not.
    valve : Valve
        Range of the sensor, travel, and diaphragm; for all valves of a bag.
    options : ReadingOptions, optional
        Format, topics and stretch.

    Returns
    -------
    tuple of RecordedValve
        One from a CSV file; from a bag one for each valve, with a refusal where its signals are
        bad.

    Raises
    ------
    ValueError, RefusalError
        If nothing can be read: one line with cause and remedy. So also for a bag without the
        libraries that bags need.
    """
    options = options or ReadingOptions()
    if is_bag(path):
        with bag_libraries():
            from valve_friction_ros.records.bags.reading import read_bag  # noqa: PLC0415
        return read_bag(path, valve, options.topics, options.stretch)
    return (RecordedValve(path, "", read_csv(path, valve, options.csv, options.stretch)),)
