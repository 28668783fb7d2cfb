"""Storage files in SQLite3: the tables `topics` and `messages`."""

import os
import shutil
import sqlite3
import struct
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from valve_friction_ros.records.bags.storage import DamagedFileError
from valve_friction_ros.records.bags.topics import Topic

__all__ = ["SqliteFile"]

_HEADER = struct.Struct(">16xH10xI")
"""Page size, where 1 stands for 65536, and number of pages: https://sqlite.org/fileformat2.html"""


class SqliteFile:
    """A SQLite3 file, read row by row; if it is damaged, until SQLite meets the damage.

    Rows that are still in a write-ahead log beside the file are read as well. `path` is the file
    that messages name, `file` the same or what was unpacked of it. Without `salvage`, a damaged
    file raises DamagedFileError, now or while its messages are gone through.
    """

    def __init__(self, path: Path, file: Path, salvage: bool) -> None:
        self._path = path
        self._salvage = salvage
        with file.open("rb") as stream:
            page_size, pages = _HEADER.unpack(stream.read(32).ljust(32, b"\0"))
        page_size = 65536 if page_size == 1 else max(page_size, 1)
        there, surplus = divmod(file.stat().st_size, page_size)
        self._loss = f"; it holds {there} of {pages} pages" if there < pages else ""
        self._folder: TemporaryDirectory[str] | None = None
        is_logged = file.with_name(f"{file.name}-wal").exists()
        if is_logged and not salvage:
            raise DamagedFileError(path, "its recorder did not close it")
        if surplus and not is_logged and salvage:
            # SQLite would fill up the last page with zeros, and believe them.
            self._folder = TemporaryDirectory()
            file = Path(shutil.copy(file, self._folder.name))
            os.truncate(file, there * page_size)
        self._uri = f"{file.absolute().as_uri()}?{'mode=ro' if is_logged else 'immutable=1'}"
        rows = self._rows("SELECT id, name, type FROM topics")
        self._topics = {number: Topic(name, kind) for number, name, kind in rows}
        self.topics: Collection[Topic] = set(self._topics.values())

    def _rows(self, query: str, values: Sequence[int] = ()) -> Iterator[tuple[Any, ...]]:
        connection = sqlite3.connect(self._uri, uri=True)
        try:
            if self._salvage:
                # Else SQLite refuses to open a file that is shorter than its header says.
                connection.execute("PRAGMA writable_schema = ON")
            yield from connection.execute(query, values)
        except sqlite3.Error as error:
            if not self._salvage:
                raise DamagedFileError(self._path, f"{error}{self._loss}") from None
        finally:
            connection.close()

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        """Go through the messages of some topics in the order of their recording."""
        wanted = {number: topic for number, topic in self._topics.items() if topic in topics}
        order = "id" if self._salvage else "timestamp, id"
        query = (
            f"SELECT topic_id, data FROM messages {'NOT INDEXED' if self._salvage else ''} "  # noqa: S608
            f"WHERE topic_id IN ({','.join('?' * len(wanted))}) ORDER BY {order}"
        )
        for number, data in self._rows(query, [*wanted]):
            if isinstance(data, bytes):
                yield wanted[number], data

    def close(self) -> None:
        """Remove what was copied."""
        if self._folder is not None:
            self._folder.cleanup()
