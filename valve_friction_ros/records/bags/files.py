"""Storage files of a bag: which they are, what they are, and how each is opened."""

import contextlib
import os
import re
import shutil
import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import apsw
import yaml
from backports import zstd
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from valve_friction_ros.records.bags.salvage import (
    SalvagedMcap,
    SalvagedSqlite,
    Storage,
    write_ahead_log,
)
from valve_friction_ros.records.bags.topics import Topic

__all__ = ["DamagedFileError", "is_bag", "opened", "storage_files"]

_MCAP = b"\x89MCAP0\r\n"
_SQLITE = b"SQLite format 3\0"
_ZSTD = b"\x28\xb5\x2f\xfd"
_ROS_1 = b"#ROSBAG V"
_LARGEST_PAGE = 65536
"""Page size of SQLite that its header of two bytes tells by a 1."""

_STORAGE = re.compile(r"\.(mcap|db3)(\.zstd)?$")
_SUFFIXES = (".mcap", ".db3", ".zstd", ".bag")
_DAMAGE = (
    ReaderError,
    apsw.Error,
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
"""What the readers of rosbags let through when a file is damaged."""


class DamagedFileError(Exception):
    """A storage file that cannot be read as it should be; the file is its first argument."""

    def __init__(self, path: Path, cause: str) -> None:
        super().__init__(path, cause)
        self.path = path
        self.cause = cause.rstrip(".")


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(16)


def is_bag(path: Path) -> bool:
    """Tell whether a file or folder is a bag, or means to be one, and no CSV file."""
    if path.is_dir() or path.suffix in _SUFFIXES:
        return True
    try:
        return _first_bytes(path).startswith((_MCAP, _SQLITE, _ZSTD, _ROS_1))
    except OSError:
        return False


def _in_order(path: Path) -> list[str | int]:
    """Key that sorts bag_2 before bag_10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.name)]


def _named_files(folder: Path) -> list[str] | None:
    """Names of the files in a bag's metadata; None where there is none that can be read."""
    try:
        content = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        return [Path(name).name for name in names] or None
    except (OSError, ValueError, yaml.YAMLError, LookupError, TypeError):
        return None


def storage_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the storage files of a bag in the order of time, and what was odd about them.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if not path.is_dir():
        return [path], []
    names = _named_files(path)
    there = sorted((file for file in path.iterdir() if _STORAGE.search(file.name)), key=_in_order)
    if names is None:
        files = there
        notes = ["without a metadata.yaml that can be read: took all storage files in the folder"]
    else:
        files = [path / name for name in names if (path / name).exists()]
        absent = [name for name in names if not (path / name).exists()]
        surplus = [file.name for file in there if file.name not in names]
        notes = [f"{', '.join(absent)} of metadata.yaml is not there"] if absent else []
        if surplus:
            notes.append(f"{', '.join(surplus)} is not in metadata.yaml, and was left out")
    if not files:
        raise ValueError(
            f"{path}: no bag: the folder holds no .mcap or .db3 file: name the folder that the "
            "recorder made"
        )
    return files, notes


def _is_indexed(reader: McapReader) -> bool:
    return bool(reader.chunks) and all(chunk.channel_count for chunk in reader.chunks)


class _Intact:
    """A storage file as rosbags reads it."""

    def __init__(self, path: Path, reader: McapReader | Sqlite3Reader) -> None:
        self._path = path
        self._reader = reader
        self.topics: Collection[Topic] = {
            Topic(connection.topic, connection.msgtype) for connection in reader.connections
        }

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        reader = self._reader
        connections = [
            connection
            for connection in reader.connections
            if Topic(connection.topic, connection.msgtype) in topics
        ]
        if not connections:
            return
        read = reader.messages
        if isinstance(reader, McapReader) and not _is_indexed(reader):
            # Here `messages` would demand that receive times never go back, which those of
            # several topics may.
            read = reader.messages_scan
        try:
            for connection, _, data in read(connections):
                yield Topic(connection.topic, connection.msgtype), data
        except _DAMAGE as error:
            raise DamagedFileError(self._path, str(error)) from None


@contextlib.contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Unpack a file that was compressed as a whole, of a cut one what there is."""
    if not _first_bytes(path).startswith(_ZSTD):
        yield path
        return
    with TemporaryDirectory() as folder:
        unpacked = Path(folder, path.stem)
        with (
            contextlib.suppress(EOFError, zstd.ZstdError),
            zstd.open(path) as packed,
            unpacked.open("wb") as whole,
        ):
            shutil.copyfileobj(packed, whole)
        yield unpacked


@contextlib.contextmanager
def _whole_pages(path: Path) -> Iterator[Path]:
    """Leave out a last page that is cut: SQLite would fill it up with zeros, and believe them."""
    with path.open("rb") as stream:
        (page_size,) = struct.unpack(">16xH", stream.read(18).ljust(18, b"\0"))
    page_size = _LARGEST_PAGE if page_size == 1 else max(page_size, 1)
    surplus = path.stat().st_size % page_size
    if surplus == 0 or write_ahead_log(path).exists():
        yield path
        return
    with TemporaryDirectory() as folder:
        whole = Path(folder, path.name)
        shutil.copyfile(path, whole)
        os.truncate(whole, path.stat().st_size - surplus)
        yield whole


def _reader_of(path: Path, start: bytes) -> type[McapReader | Sqlite3Reader]:
    if start.startswith(_MCAP):
        return McapReader
    if start.startswith(_SQLITE):
        return Sqlite3Reader
    if not start and path.stat().st_size:
        raise ValueError(f"{path}: nothing of it can be unpacked: copy or record it anew")
    if not start:
        raise ValueError(f"{path}: the file is empty: nothing was recorded, or copied")
    if start.startswith(_ROS_1):
        raise ValueError(f"{path}: a bag of ROS 1: convert it by rosbags-convert")
    raise ValueError(f"{path}: neither MCAP nor SQLite3, whatever its name says: record it anew")


def _intact(path: Path, file: Path, kind: type[McapReader | Sqlite3Reader]) -> Iterator[Storage]:
    """Open a storage file by rosbags; `file` is what was unpacked of `path`."""
    if write_ahead_log(file).exists():
        raise DamagedFileError(path, "its recorder did not close it")
    reader = kind(file)
    try:
        reader.open()
    except _DAMAGE as error:
        raise DamagedFileError(path, str(error).replace(str(file), path.name)) from None
    try:
        yield _Intact(path, reader)
    finally:
        reader.close()


@contextlib.contextmanager
def opened(path: Path, salvage: bool) -> Iterator[Storage]:
    """Open a storage file, compressed or not.

    Parameters
    ----------
    path : Path
        The file; what it is is told by its first bytes.
    salvage : bool
        True to read it without its index as far as it goes.

    Raises
    ------
    ValueError
        If it is no storage file of ROS 2.
    DamagedFileError
        If it cannot be read without salvage, now or while its messages are gone through.
    """
    with _unpacked(path) as file:
        kind = _reader_of(path, _first_bytes(file))
        if salvage and kind is McapReader:
            yield SalvagedMcap(file)
        elif salvage:
            with _whole_pages(file) as pages:
                yield SalvagedSqlite(pages)
        else:
            yield from _intact(path, file, kind)
