"""Messages in a bag: from their bytes to their content and back."""

import struct
from typing import Any

from backports import zstd
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

__all__ = ["TYPES", "UndecodableError", "decode", "encode", "header", "stamp_of"]

TYPES = get_typestore(Stores.ROS2_JAZZY)
"""Message types; those of pressure and stem have not changed since ROS 2 began."""

_ZSTD = b"\x28\xb5\x2f\xfd"
_NANOSECONDS = 1_000_000_000


class UndecodableError(ValueError):
    """Bytes that are no message of their topic's type."""


def decode(data: bytes, kind: str) -> Any:
    """Decode a message, compressed by its recorder or not.

    Bytes after its end are ignored: rclpy's serialisation may leave some there, which the
    typestore's own `deserialize_cdr` would refuse.

    Raises
    ------
    UndecodableError
        If the bytes are no such message.
    """
    if data.startswith(_ZSTD):
        try:
            data = zstd.decompress(data)
        except zstd.ZstdError as error:
            raise UndecodableError(str(error)) from None
    if len(data) < 4 or data[0] != 0 or data[1] > 1:
        raise UndecodableError("not in CDR")
    definition = TYPES.get_msgdef(kind)
    read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
    try:
        message, _ = read(data[4:], 0, definition.cls, TYPES)
    except (SerdeError, struct.error, ValueError, IndexError) as error:
        raise UndecodableError(str(error)) from None
    return message


def encode(message: object, kind: str) -> bytes:
    """Encode a message."""
    return bytes(TYPES.serialize_cdr(message, kind))


def stamp_of(message: Any) -> int:
    """Header stamp of a message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)


def header(stamp: int) -> Any:
    """Header with a stamp in ns."""
    seconds, nanoseconds = divmod(stamp, _NANOSECONDS)
    time = TYPES.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    return TYPES.types["std_msgs/msg/Header"](stamp=time, frame_id="")
