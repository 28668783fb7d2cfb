# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Messages of a bag, and all uses of private names of rosbags.

Checked with rosbags 0.11.9; used are:

- `McapReader`: the documented `Reader` infers the format of a file from its ending. It also refuses
  an MCAP file without index whose receive times go back, as those of several topics may.
- The decoders of `Typestore.get_msgdef`: the documented `deserialize_cdr` refuses a message with
  bytes after its end, which rclpy's serialisation may leave.
"""

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from backports import zstd
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from valve_friction_ros.records.bags.topics import ZSTD, DamagedFileError, Topic

TYPES = get_typestore(Stores.ROS2_JAZZY)
"""Message types; those of pressure and stem have never changed in ROS 2."""

_DAMAGE = (
    ReaderError,
    zstd.ZstdError,
    struct.error,
    ArithmeticError,
    AssertionError,
    EOFError,
    MemoryError,
    OSError,
    LookupError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""Exceptions that `McapReader` raises for a damaged file."""


class McapFile:
    """An undamaged MCAP file: `file`, which is `path` or its unpacked content.

    Raises DamagedFileError, which names `path`, if it is damaged, at once or during iteration over
    its messages.
    """

    def __init__(self, path: Path, file: Path) -> None:
        self._path = path
        self._reader = McapReader(file)
        try:
            self._reader.open()
        except _DAMAGE as error:
            cause = str(error).replace(str(file), path.name)
            raise DamagedFileError(path, cause) from None
        self._topics = {
            connection.id: Topic(connection.topic, connection.msgtype)
            for connection in self._reader.connections
        }
        self.topics: Collection[Topic] = set(self._topics.values())

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        """Yield the messages of some topics in the order of recording."""
        reader = self._reader
        connections = [each for each in reader.connections if self._topics[each.id] in topics]
        if not connections:
            return
        indexed = reader.chunks and all(chunk.channel_count for chunk in reader.chunks)
        read = reader.messages if indexed else reader.messages_scan
        try:
            for connection, _, data in read(connections):
                yield self._topics[connection.id], data
        except _DAMAGE as error:
            raise DamagedFileError(self._path, str(error)) from None

    def close(self) -> None:
        """Close the file."""
        self._reader.close()


def decode(data: bytes, kind: str) -> Any | None:
    """Decode a message, compressed by its recorder or not, ignoring bytes after its end.

    Returns None if the bytes are not such a message.
    """
    try:
        if data.startswith(ZSTD):
            data = zstd.decompress(data)
        if len(data) < 4 or data[0] != 0 or data[1] > 1:  # not in CDR
            return None
        definition = TYPES.get_msgdef(kind)
        read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        message, _ = read(data[4:], 0, definition.cls, TYPES)
    except (SerdeError, zstd.ZstdError, struct.error, ValueError, IndexError):
        return None
    return message


def stamp_of(message: Any) -> int:
    """Return the header stamp of a message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
