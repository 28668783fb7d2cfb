# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recorded files of any kind, read by one function."""

from dataclasses import dataclass, field
from pathlib import Path

from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.storage import bag_libraries, is_bag
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.table_recording import holds_a_force, read_table
from valve_friction_ros.records.table_rows import readable


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
    return not _is_bag(path, options) and holds_a_force(path, options.columns)


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
    return read_table(path, valve, options.columns, options.stretch, options.topics.valve)
