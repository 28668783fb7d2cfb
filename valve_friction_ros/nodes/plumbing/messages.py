# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Conversion between messages and plain numbers, also in blocks of serialised messages.

In the messages of a publisher only stamps and numbers change; frame, joint names and counts are the
same bytes at the same offsets. The first message therefore shows the offset of the numbers, and
NumPy reads them from all messages at once if the other bytes are equal. If the layouts differ,
rclpy deserialises the messages.
"""

import struct
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.nodes.plumbing.polled_subscription import TakenMessage
from valve_friction_ros.streams import Arrivals, Kind, Samples, rows_arrived
from valve_friction_ros.streams.samples import joint_index, joint_position

_NANOSECONDS = 1_000_000_000


def stamp_of(time: Time) -> int:
    """Convert the time of a message to whole nanoseconds."""
    stamp: int = time.sec * _NANOSECONDS + time.nanosec
    return stamp


def time_message(stamp: int) -> Time:
    """Convert a time in whole nanoseconds to a message."""
    seconds, nanoseconds = divmod(stamp, _NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def position_of(message: JointState, joint: str) -> float | None:
    """Return the position of `joint`, m, or None; an empty name means the first joint."""
    return joint_position(message.name, message.position, joint)


def rows_of(messages: Sequence[Float64MultiArray]) -> Arrivals:
    """Return the samples of consecutive blocks, each with one row of s, Pa and m per sample.

    Raises ValueError if the layout of a block is wrong; the message describes the correct layout.
    """
    tables, labels = zip(*map(_table_of, messages), strict=True)
    if any(one != labels[0] for one in labels):
        raise ValueError("the columns differ between blocks")
    return rows_arrived(np.concatenate(tables), labels[0])


def _table_of(message: Float64MultiArray) -> tuple[NDArray[np.float64], list[str]]:
    """Return the numbers of a block, one row per sample, and the labels of its columns."""
    dimensions = message.layout.dim
    if len(dimensions) != 2:
        raise ValueError(f"the layout has {len(dimensions)} dimensions, not sample × columns")
    rows, columns = dimensions
    if rows.label != "sample":
        raise ValueError(f"the first dimension is labelled {rows.label!r}, not 'sample'")
    count = rows.size * columns.size
    if message.layout.data_offset or len(message.data) != count:
        raise ValueError(
            f"there are {len(message.data)} numbers from offset {message.layout.data_offset}, "
            f"not {rows.size} × {columns.size} from 0"
        )
    table = np.asarray(message.data, dtype=np.float64).reshape(rows.size, columns.size)
    return table, columns.label.split(",")


_LITTLE_ENDIAN = b"\x00\x01"
_BODY = 4
"""First byte after the encapsulation header; the origin of the alignment."""
_STAMP = slice(_BODY, _BODY + 8)
_DOUBLE = 8


class _Layout(NamedTuple):
    """Offset of the number in a message, and the bytes before it that every message repeats."""

    number: int
    repeated: NDArray[np.bool_]


class _Reader:
    """Reads the beginning of a serialised message (CDR, little endian).

    Raises struct.error or ValueError if the bytes are not a message.
    """

    def __init__(self, message: bytes) -> None:
        if message[:2] != _LITTLE_ENDIAN:
            raise ValueError("not little endian")
        self._message = message
        self._at = _STAMP.stop
        self._repeated = np.zeros(len(message), dtype=bool)
        self._repeated[:2] = True

    def _align(self, size: int) -> None:
        self._at += -(self._at - _BODY) % size

    def _take(self, size: int) -> bytes:
        taken = slice(self._at, self._at + size)
        self._repeated[taken] = True
        self._at += size
        return self._message[taken]

    def count(self) -> int:
        self._align(4)
        number: int = struct.unpack("<I", self._take(4))[0]
        return number

    def string(self) -> str:
        return self._take(self.count()).rstrip(b"\0").decode()

    def double(self, index: int = 0) -> _Layout:
        self._align(_DOUBLE)
        number = self._at + _DOUBLE * index
        if number + _DOUBLE > len(self._message):
            raise ValueError("the message ends before its number")
        return _Layout(number, self._repeated[:number])


def _pressure_layout(message: bytes) -> _Layout:
    reader = _Reader(message)
    reader.string()
    return reader.double()


def _position_layout(message: bytes, joint: str) -> _Layout:
    reader = _Reader(message)
    reader.string()
    names = [reader.string() for _ in range(reader.count())]
    index = joint_index(names, reader.count(), joint)
    if index is None:
        raise ValueError("no position for the joint")
    return reader.double(index)


def _alike(
    messages: Sequence[bytes], layout_of: Callable[[bytes], _Layout]
) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
    """Return the stamps and numbers of messages with equal layouts, or None if they differ."""
    try:
        layout = layout_of(messages[0])
    except (struct.error, ValueError):
        return None
    end = layout.number + _DOUBLE
    joined = b"".join([message[:end] for message in messages])
    if len(joined) != len(messages) * end:
        return None
    table = np.frombuffer(joined, np.uint8).reshape(-1, end)
    repeated = np.flatnonzero(layout.repeated)
    if (table[1:, repeated] != table[0, repeated]).any():
        return None
    seconds, nanoseconds = table[:, _STAMP].copy().view(np.dtype("<u4")).astype(np.int64).T
    seconds = seconds.astype(np.int32).astype(np.int64)
    values = table[:, layout.number : end].copy().view(np.dtype("<f8"))[:, 0]
    return seconds * 1_000_000_000 + nanoseconds, values.astype(np.float64)


def readable(taken: Sequence[TakenMessage], kind: type) -> list[TakenMessage]:
    """Return the serialised messages that are valid; anyone can publish other bytes."""

    def is_readable(data: bytes) -> bool:
        try:
            deserialize_message(data, kind)
        except RuntimeError:  # of rclpy
            return False
        return True

    return [one for one in taken if is_readable(one.message)]


def pressures_in(messages: Sequence[bytes]) -> Samples:
    """Return the samples of serialised sensor_msgs/FluidPressure messages, Pa."""
    if not messages:
        return Samples.joined()
    alike = _alike(messages, _pressure_layout)
    if alike is not None:
        return Samples(*alike)
    read: list[Any] = [deserialize_message(message, FluidPressure) for message in messages]
    return Samples(
        np.array([stamp_of(message.header.stamp) for message in read], dtype=np.int64),
        np.array([message.fluid_pressure for message in read], dtype=np.float64),
    )


def positions_in(messages: Sequence[bytes], joint: str) -> Arrivals:
    """Return the positions of `joint` in serialised sensor_msgs/JointState messages, m."""
    alike = _alike(messages, lambda one: _position_layout(one, joint)) if messages else None
    if alike is not None:
        return Arrivals(np.full(len(messages), Kind.POSITION, np.uint8), *alike)
    read: list[Any] = [deserialize_message(message, JointState) for message in messages]
    found = [position_of(message, joint) for message in read]
    return Arrivals(
        np.array([Kind.NO_POSITION if one is None else Kind.POSITION for one in found], np.uint8),
        np.array([stamp_of(message.header.stamp) for message in read], dtype=np.int64),
        np.array([np.nan if one is None else one for one in found], dtype=np.float64),
    )


def arrivals_of(
    pressures: Sequence[TakenMessage], stems: Sequence[TakenMessage], joint: str
) -> Arrivals:
    """Return the samples of serialised messages from both topics, in order of receipt.

    The messages are sensor_msgs/FluidPressure and sensor_msgs/JointState; an empty `joint` means
    the first joint. Raises RuntimeError if a message has another type.
    """
    pressure = pressures_in([one.message for one in pressures])
    stem = positions_in([one.message for one in stems], joint)
    kinds = np.concatenate([np.full(len(pressures), Kind.PRESSURE, np.uint8), stem.kinds])
    # The messages of a topic keep their order even if the clock of the receipts is set back.
    receipts = [np.array([one.received for one in part], np.int64) for part in (pressures, stems)]
    received = np.concatenate([np.maximum.accumulate(part) for part in receipts])
    order = np.argsort(received, kind="stable")
    stamps = np.concatenate([pressure.stamps, stem.stamps])
    values = np.concatenate([pressure.values, stem.values])
    return Arrivals(kinds[order], stamps[order], values[order])
