"""What can still be read of an MCAP file that is damaged, or whose recorder was killed."""

import io
import struct
from binascii import crc32
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from backports import zstd
from lz4.frame import LZ4FrameDecompressor

from valve_friction_ros.records.bags.topics import Topic

__all__ = ["SalvagedMcap"]

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_ENDS = {0x00, 0x0F}
"""No record of MCAP, but what a disk leaves after a loss of power; and the end of the data."""
_MAGIC_SIZE = 8
_WANTED = {_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK}
_MESSAGE_HEADER = struct.Struct("<HIQQ")
_CHUNK_HEADER = struct.Struct("<QQQI")


def _text(stream: io.BytesIO) -> str:
    (size,) = struct.unpack("<I", stream.read(4))
    return stream.read(size).decode()


def _chunk_content(chunk: bytes) -> bytes:
    """Uncompressed content of a chunk; of a cut chunk, the part that is there; empty if damaged."""
    stream = io.BytesIO(chunk)
    try:
        *_, size, checksum = _CHUNK_HEADER.unpack(stream.read(_CHUNK_HEADER.size))
        compression = _text(stream)
        stream.read(8)
        content = stream.read()
        if compression == "zstd":
            content = zstd.ZstdDecompressor().decompress(content)
        elif compression == "lz4":
            content = LZ4FrameDecompressor().decompress(content)
    except (struct.error, UnicodeDecodeError, zstd.ZstdError, RuntimeError):
        return b""
    is_damaged = len(content) == size and checksum and crc32(content) != checksum
    return b"" if is_damaged else content


def _records(stream: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    """Go through records of MCAP, opcode and content, up to the first that is not whole.

    A chunk is opened; of one that is cut, what there is of it comes last.
    """
    while len(head := stream.read(9)) == 9:
        opcode, length = struct.unpack("<BQ", head)
        rest = size - stream.tell()
        if opcode in _ENDS or (length > rest and opcode != _CHUNK):
            return
        if opcode not in _WANTED:
            stream.seek(length, io.SEEK_CUR)
            continue
        content = stream.read(min(length, rest))
        if opcode != _CHUNK:
            yield opcode, content
            continue
        records = _chunk_content(content)
        yield from _records(io.BytesIO(records), len(records))
        if not records:
            return


class SalvagedMcap:
    """An MCAP file read from its beginning to its end or first damage, without its index."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._channels: dict[int, Topic] = {}
        types: dict[int, str] = {}
        for opcode, content in self._walk():
            record = io.BytesIO(content)
            try:
                if opcode == _SCHEMA:
                    (schema,) = struct.unpack("<H", record.read(2))
                    types[schema] = _text(record)
                elif opcode == _CHANNEL:
                    channel, schema = struct.unpack("<HH", record.read(4))
                    self._channels[channel] = Topic(_text(record), types.get(schema, ""))
            except (struct.error, UnicodeDecodeError):
                break
        self.topics: Collection[Topic] = set(self._channels.values())

    def _walk(self) -> Iterator[tuple[int, bytes]]:
        with self._path.open("rb") as stream:
            stream.seek(_MAGIC_SIZE)
            yield from _records(stream, self._path.stat().st_size)

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        """Go through the messages of some topics in the order of their recording."""
        wanted = {number: topic for number, topic in self._channels.items() if topic in topics}
        for opcode, content in self._walk():
            if opcode == _MESSAGE and len(content) >= _MESSAGE_HEADER.size:
                channel, *_ = _MESSAGE_HEADER.unpack_from(content)
                if channel in wanted:
                    yield wanted[channel], content[_MESSAGE_HEADER.size :]
