"""Messages in a bag: from their bytes to their content and back."""

import struct
from typing import Any

from backports import zstd
from rosbags.serde import SerdeError

from valve_friction_ros.records.bags.rosbags_internals import TYPES, decoded

__all__ = ["UndecodableError", "decode", "encode", "header", "stamp_of"]

_ZSTD = b"\x28\xb5\x2f\xfd"
_NANOSECONDS = 1_000_000_000


class UndecodableError(ValueError):
    """Bytes that are no message of their topic's type."""


def decode(data: bytes, kind: str) -> Any:
    """Decode a message, compressed by its recorder or not.

    Raises UndecodableError if the bytes are no such message.
    """
    if data.startswith(_ZSTD):
        try:
            data = zstd.decompress(data)
        except zstd.ZstdError as error:
            raise UndecodableError(str(error)) from None
    if len(data) < 4 or data[0] != 0 or data[1] > 1:
        raise UndecodableError("not in CDR")
    try:
        return decoded(data[4:], kind, bool(data[1]))
    except (SerdeError, struct.error, ValueError, IndexError) as error:
        raise UndecodableError(str(error)) from None


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
