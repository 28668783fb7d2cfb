# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Writing of a buffer as a bag, which can be stored, sent and identified again."""

import contextlib
import errno
import heapq
import os
import shutil
import struct
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml
from rosbags.rosbag2 import StoragePlugin, Writer

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.rosbags_internals import TYPES
from valve_friction_ros.records.bags.topics import PRESSURE_TYPE, STEM_TYPE, VALVE_FILE, StreamNames
from valve_friction_ros.streams.record_buffer import Snapshot
from valve_friction_ros.streams.samples import Samples

_VERSION: Final = 9
"""Version of the metadata, as in ROS 2 Jazzy."""

_TAKEN = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)
"""Errors when the target name of a rename exists."""

_LARGEST_STAMP = (2**31 - 1) * 1_000_000_000

_NOTHING = np.zeros(0)

_STAMP, _VALUE = struct.Struct("<iI"), struct.Struct("<d")
_STAMP_PLACE = 4
"""Offset of the header, which begins a message after four bytes of encoding."""
_MARK = 1.2345e67
"""Placeholder for the value of a sample."""


def _messages(samples: Samples, message: object, kind: str) -> Iterator[tuple[int, str, bytes]]:
    """Yield stamp, type and bytes of each sample, patching stamp and value into `message`.

    Encoding each message separately would take five times as long.
    """
    data = bytearray(TYPES.serialize_cdr(message, kind))
    place = data.index(_VALUE.pack(_MARK))
    for stamp, value in zip(samples.stamps.tolist(), samples.values.tolist(), strict=True):
        _STAMP.pack_into(data, _STAMP_PLACE, *divmod(stamp, 1_000_000_000))
        _VALUE.pack_into(data, place, value)
        yield stamp, kind, bytes(data)


def _write(folder: Path, snapshot: Snapshot, names: StreamNames) -> None:
    time = TYPES.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = TYPES.types["std_msgs/msg/Header"](stamp=time, frame_id="")
    pressure = TYPES.types[PRESSURE_TYPE](header=header, fluid_pressure=_MARK, variance=0.0)
    stem = TYPES.types[STEM_TYPE](
        header=header,
        name=[names.joint] if names.joint else [],
        position=np.array([_MARK]),
        velocity=_NOTHING,
        effort=_NOTHING,
    )
    messages = heapq.merge(
        _messages(snapshot.pressure, pressure, PRESSURE_TYPE),
        _messages(snapshot.position, stem, STEM_TYPE),
    )
    with Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        if snapshot.rejections:
            writer.set_custom_data("rejected_samples", snapshot.causes())
        connections = {
            kind: writer.add_connection(topic, kind, typestore=TYPES)
            for topic, kind in ((names.pressure, PRESSURE_TYPE), (names.stem, STEM_TYPE))
        }
        for stamp, kind, data in messages:
            writer.write(connections[kind], max(stamp, 0), data)


def _flush(folder: Path) -> None:
    """Flush a folder to disk before its final name marks it as complete."""
    for path in (*folder.iterdir(), folder):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _moved(whole: Path, folder: Path, name: str) -> Path:
    """Move a finished bag to its name, numbered if the name is taken."""
    number, target = 1, folder / name
    while True:
        try:
            return whole.rename(target)
        except OSError as error:
            if error.errno not in _TAKEN:
                raise
        number += 1
        target = folder / f"{name}_{number}"


_WORKPLACE = ".saving_"
_STALE = 86_400.0
"""Prefix of the hidden folders, and the age, s, from which one is left of a killed process."""


def _remove_leftovers(folder: Path) -> None:
    """Remove the unfinished bags of killed processes, as far as that is possible."""
    for place in folder.glob(f"{_WORKPLACE}*"):
        with contextlib.suppress(OSError):
            is_stale = time.time() - place.stat().st_mtime > _STALE
            if is_stale and all(one.is_dir() for one in place.iterdir()):
                shutil.rmtree(place)


def write_bag(
    folder: Path,
    name: str,
    snapshot: Snapshot,
    names: StreamNames,
    valve: Valve,
    settings: Mapping[str, Any],
    replaced: Path | None = None,
) -> Path:
    """Write a snapshot as an MCAP bag with the received stamps; return its path.

    The bag is written in a hidden folder next to its place and then renamed, so that nobody reads
    an incomplete bag. The folder is created if missing; if the name is taken, a number is appended.
    Rejected samples are only counted, in the metadata. The bag includes a valve file with the
    settings of the identification by the names of `settings.IDENTIFICATION`, so that
    `valve_friction identify BAG` gives the same numbers as the snapshot. The bag `replaced` in this
    folder is removed once the new bag is complete.

    Raises RefusalError if there is nothing to write, and OSError if writing fails; then nothing is
    left behind.
    """
    stamps = np.concatenate((snapshot.pressure.stamps, snapshot.position.stamps))
    if stamps.size == 0:
        raise RefusalError("the buffer is empty: there is nothing to save")
    if np.abs(stamps).max() > _LARGEST_STAMP:
        raise RefusalError("there are stamps after the year 2038, which no message header can hold")
    folder.mkdir(parents=True, exist_ok=True)
    _remove_leftovers(folder)
    workplace = Path(tempfile.mkdtemp(prefix=_WORKPLACE, dir=folder))
    try:
        whole = workplace / name
        _write(whole, snapshot, names)
        description = yaml.safe_dump({**asdict(valve), **settings}, sort_keys=False)
        (whole / VALVE_FILE).write_text(description, encoding="utf-8")
        _flush(whole)
        if replaced is not None:
            with contextlib.suppress(FileNotFoundError):
                replaced.rename(workplace / "replaced")
        return _moved(whole, folder, name)
    finally:
        shutil.rmtree(workplace, ignore_errors=True)
