"""Messages of a SQLite3 bag, page by page, where the tree that leads to its pages is cut off.

The inner pages of that tree are written after the leaves that they lead to, so that a file which
was cut off may have lost the way to all of them. The format: https://sqlite.org/fileformat2.html
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

__all__ = ["StoredMessage", "messages_after"]

_LEAF = 0x0D
_LARGEST = 65536
"""Page size that the header tells by a 1."""
_SIZES = {0: 0, 1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 8: 0, 9: 0}
"""Bytes of an integer by its serial type."""
_NULL, _ONE, _SMALLEST_BLOB = 0, 9, 12


class StoredMessage(NamedTuple):
    """A row of the table `messages`."""

    id: int
    topic: int
    data: bytes


def _varint(content: bytes, at: int) -> tuple[int, int]:
    """Return a number of variable length, and where it ends."""
    value = 0
    for place in range(at, at + 8):
        value = value << 7 | content[place] & 0x7F
        if content[place] < 0x80:
            return value, place + 1
    return value << 8 | content[at + 8], at + 9


class _Pages:
    """The pages of a file."""

    def __init__(self, stream: BinaryIO, file_size: int) -> None:
        header = stream.read(100)
        (size,) = struct.unpack_from(">H", header, 16)
        self._size = _LARGEST if size == 1 else size
        self._usable = self._size - header[20]
        self._stream = stream
        self.count = file_size // self._size

    def page(self, number: int) -> bytes:
        self._stream.seek((number - 1) * self._size)
        return self._stream.read(self._size)

    def rows(self, number: int) -> Iterator[StoredMessage]:
        """Go through the messages of a page; there are none in a page of something else."""
        page = self.page(number)
        if page[0] != _LEAF:
            return
        (count,) = struct.unpack_from(">H", page, 3)
        for at in struct.unpack_from(f">{count}H", page, 8):
            size, at_id = _varint(page, at)
            row, begin = _varint(page, at_id)
            message = _message(row, self._payload(page, begin, size))
            if message is None:
                return
            yield message

    def _payload(self, page: bytes, begin: int, size: int) -> bytes:
        """Return what a row holds, of which the end of a long one is on further pages."""
        usable = self._usable
        local = size
        if size > usable - 35:
            least = (usable - 12) * 32 // 255 - 23
            local = least + (size - least) % (usable - 4)
            local = local if local <= usable - 35 else least
        content = page[begin : begin + local]
        if local < size:
            (following,) = struct.unpack_from(">I", page, begin + local)
            while following and len(content) < size:
                page = self.page(following)
                (following,) = struct.unpack_from(">I", page)
                content += page[4:usable]
        return content[:size]


def _message(row: int, payload: bytes) -> StoredMessage | None:
    """Read a row of the columns id, topic_id, timestamp and data; None if it has others."""
    end, at = _varint(payload, 0)
    types = []
    while at < end:
        kind, at = _varint(payload, at)
        types.append(kind)
    if len(types) != 4:
        return None
    key, topic, stamp, data = types
    if key != _NULL or topic not in _SIZES or stamp not in _SIZES:
        return None
    begin = end + _SIZES[topic] + _SIZES[stamp]
    size, is_text = divmod(data - _SMALLEST_BLOB, 2)
    if size < 0 or is_text or len(payload) != begin + size:
        return None
    number = int.from_bytes(payload[end : end + _SIZES[topic]], "big", signed=True)
    return StoredMessage(row, 1 if topic == _ONE else number, payload[begin:])


def messages_after(path: Path, last: int) -> Iterator[StoredMessage]:
    """Go through the messages after the one with the id `last`, up to the first that is missing.

    Parameters
    ----------
    path : Path
        A SQLite3 bag.
    last : int
        Id of the last message that is not wanted; 0 to begin with the first one.
    """
    with path.open("rb") as stream:
        try:
            pages = _Pages(stream, path.stat().st_size)
            begins = []
            for number in range(2, pages.count + 1):
                first = _first(pages, number)
                if first is not None:
                    begins.append((first, number))
            for _, number in sorted(begins):
                for message in pages.rows(number):
                    if message.id <= last:
                        continue
                    if message.id != last + 1:
                        return
                    last = message.id
                    yield message
        except (struct.error, LookupError, ArithmeticError):
            return


def _first(pages: _Pages, number: int) -> int | None:
    """Return the id of the first message of a page, None if there is none."""
    try:
        first = next(pages.rows(number), None)
    except (struct.error, LookupError):
        return None
    return None if first is None else first.id
