# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Statuses out of serialised diagnostics, each read only when somebody looks.

rclpy takes 0.2 ms to turn the status of an identifier into objects, a tenth of a core for 500
valves a second. Here the name is read as the message comes, and the rest once a page shows it.
"""

import struct
import sys
from collections.abc import Iterator
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.serialization import deserialize_message

from valve_friction_ros.dashboard import ESSENTIAL_KEYS, Status, Unread

_LITTLE_ENDIAN = b"\x00\x01"
_AFTER_STAMP = 12
"""First byte after the representation's header (4 bytes) and the stamp (8)."""
_COUNT = struct.Struct("<I")
_KEYS = tuple(_COUNT.pack(len(key.encode()) + 1) + key.encode() + b"\0" for key in ESSENTIAL_KEYS)
"""The essential keys as they stand in a message: their length, their text and a zero byte."""


def statuses_in(message: bytes) -> Iterator[Unread]:
    """Yield each status of a diagnostic_msgs/DiagnosticArray, still unread.

    Raises ValueError if the bytes are no such message.
    """
    try:
        if message[:2] == _LITTLE_ENDIAN:
            yield from _quickly(message)
        else:
            for one in deserialize_message(message, DiagnosticArray).status:
                yield Unread(one.name, partial(status_of, one))
    except (struct.error, IndexError, MemoryError, RuntimeError) as error:
        raise ValueError(f"no diagnostics: {error}") from None


def status_of(message: DiagnosticStatus) -> Status:
    """Return a status of a message."""
    return Status(
        message.name,
        message.level[0],
        message.hardware_id,
        message.message,
        {one.key: one.value for one in message.values},
    )


def _quickly(message: bytes) -> Iterator[Unread]:
    frame, at = _text(message, _AFTER_STAMP)
    del frame
    count, at = _count(message, at)
    for left in range(count - 1, -1, -1):
        name, _ = _text(message, at + 1)
        begin, at = at, _read(message, at)[1] if left else len(message)
        yield Unread(name, partial(_status_at, message, begin), partial(_mark, message, begin, at))


def _status_at(message: bytes, at: int) -> Status:
    """Read a status; raises ValueError if the bytes are none."""
    try:
        return _read(message, at)[0]
    except (struct.error, IndexError) as error:
        raise ValueError(f"no status: {error}") from None


def _mark(message: bytes, begin: int, end: int) -> tuple[object, ...]:
    """Return level, message, tag and the values of the essential keys, a tenth of all.

    The bytes between two texts are left out: they may be any.
    """
    try:
        _, at = _text(message, begin + 1)
        words, at = _text(message, at)
        tag, at = _text(message, at)
        values = [
            _text(message, found + len(key))[0] if (found := message.find(key, at, end)) > 0 else ""
            for key in _KEYS
        ]
    except (struct.error, IndexError) as error:
        raise ValueError(f"no status: {error}") from None
    return (message[begin], words, tag, *values)


def _count(message: bytes, at: int) -> tuple[int, int]:
    at += -at % 4  # the representation's header takes four bytes, so alignment counts from zero
    return _COUNT.unpack_from(message, at)[0], at + 4


def _text(message: bytes, at: int) -> tuple[str, int]:
    size, at = _count(message, at)
    end = at + size
    if end > len(message):
        raise IndexError("the message ends before its text")
    return message[at : max(at, end - 1)].decode(errors="replace"), end


def _read(message: bytes, at: int) -> tuple[Status, int]:
    level = message[at]
    name, at = _text(message, at + 1)
    words, at = _text(message, at)
    hardware_id, at = _text(message, at)
    count, at = _count(message, at)
    values = {}
    for _ in range(count):
        key, at = _text(message, at)
        values[sys.intern(key)], at = _text(message, at)
    return Status(name, level, hardware_id, words, values), at
