# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reading of rosbag2 bags without ROS, through the same buffer as in the node."""

import contextlib
import io
import os
import re
import shutil
import sqlite3
import struct
from binascii import crc32
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import yaml
from backports import zstd
from lz4.frame import LZ4FrameDecompressor

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.rosbags_internals import (
    McapFile,
    decode,
    stamp_of,
)
from valve_friction_ros.records.bags.topics import (
    MCAP,
    PRESSURE_TYPE,
    ROS_1,
    SQLITE,
    STEM_TYPE,
    ZSTD,
    DamagedFileError,
    Topic,
    TopicChoice,
    ValveTopics,
    first_bytes,
    valves_in,
)
from valve_friction_ros.records.recorded_valve import WITHOUT_GAP, RecordedValve, Stretch
from valve_friction_ros.streams.record_buffer import RecordBuffer
from valve_friction_ros.streams.samples import joint_position, only_joint, uniform_recording

_HEADER = struct.Struct(">16xH10xI")
"""Page size, with 1 for 65536, and number of pages: https://sqlite.org/fileformat2.html"""


class SqliteFile:
    """A SQLite3 file, read row by row; a damaged file is read up to the damage.

    Rows still in the write-ahead log next to the file are read too. `path` is the file named in
    messages, `file` the same file or its unpacked content. Without `salvage`, a damaged file raises
    DamagedFileError, at once or during iteration over its messages.
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
            raise DamagedFileError(path, "it was not closed by its recorder")
        if surplus and not is_logged and salvage:
            # SQLite would pad the last page with zeros and read these as data.
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
                # Otherwise SQLite refuses a file that is shorter than its header says.
                connection.execute("PRAGMA writable_schema = ON")
            yield from connection.execute(query, values)
        except sqlite3.Error as error:
            if not self._salvage:
                raise DamagedFileError(self._path, f"{error}{self._loss}") from None
        finally:
            connection.close()

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        """Yield the messages of some topics in the order of recording."""
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
        """Remove the temporary copy."""
        if self._folder is not None:
            self._folder.cleanup()


_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_ENDS = {0x00, 0x0F}
"""Zeros, which a disk leaves after a loss of power and which are not a record of MCAP; and the end
of the data."""
_MAGIC_SIZE = 8
_WANTED = {_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK}
_MESSAGE_HEADER = struct.Struct("<HIQQ")
_CHUNK_HEADER = struct.Struct("<QQQI")


def _text(stream: io.BytesIO) -> str:
    (size,) = struct.unpack("<I", stream.read(4))
    return stream.read(size).decode()


def _chunk_content(chunk: bytes) -> bytes:
    """Return the uncompressed content of a chunk; partial if truncated, empty if damaged."""
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
    """Yield opcode and content of MCAP records up to the first incomplete record.

    Chunks are unpacked; the readable part of a truncated chunk comes last.
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
    """An MCAP file, read without its index from the beginning to the end or first damage."""

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
        """Yield the messages of some topics in the order of recording."""
        wanted = {number: topic for number, topic in self._channels.items() if topic in topics}
        for opcode, content in self._walk():
            if opcode == _MESSAGE and len(content) >= _MESSAGE_HEADER.size:
                channel, *_ = _MESSAGE_HEADER.unpack_from(content)
                if channel in wanted:
                    yield wanted[channel], content[_MESSAGE_HEADER.size :]


_STORAGE = re.compile(r"\.(mcap|db3)(\.zstd)?$")


def _in_order(path: Path) -> list[str | int]:
    """Return a sort key that puts bag_2 before bag_10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.name)]


def _named_files(folder: Path) -> list[str] | None:
    """Return the names of the files in the metadata of a bag; None without readable metadata."""
    try:
        content = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        return [Path(name).name for name in names] or None
    except (OSError, ValueError, yaml.YAMLError, LookupError, TypeError):
        return None


def storage_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the storage files of a bag in order of time, and notes on missing files.

    Raises ValueError if there are no storage files.
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
            f"{path}: not a bag: the folder contains no .mcap or .db3 file: give the folder "
            "created by the recorder"
        )
    return files, notes


@contextlib.contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Unpack a file that was compressed as a whole; a truncated file only as far as possible."""
    if not first_bytes(path).startswith(ZSTD):
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


def _is_mcap(path: Path, start: bytes) -> bool:
    """Return True for MCAP and False for SQLite3, by the first bytes; refuse other formats."""
    if start.startswith((MCAP, SQLITE)):
        return start.startswith(MCAP)
    if not start and path.stat().st_size:
        raise ValueError(f"{path}: it cannot be unpacked: copy or record it again")
    if not start:
        raise ValueError(f"{path}: the file is empty: nothing was recorded or copied")
    if start.startswith(ROS_1):
        raise ValueError(f"{path}: a ROS 1 bag: convert it with rosbags-convert")
    raise ValueError(f"{path}: neither MCAP nor SQLite3, despite its name: record it again")


@contextlib.contextmanager
def opened(path: Path, salvage: bool) -> Iterator[McapFile | SqliteFile | SalvagedMcap]:
    """Open a storage file, compressed or not; its first bytes determine its format.

    With `salvage` it is read without its index as far as possible. Raises ValueError if it is not a
    storage file of ROS 2. Raises DamagedFileError if it cannot be read without salvage, at once or
    during iteration over its messages.
    """
    with _unpacked(path) as file:
        is_mcap = _is_mcap(path, first_bytes(file))
        if is_mcap and salvage:
            yield SalvagedMcap(file)
            return
        storage = McapFile(path, file) if is_mcap else SqliteFile(path, file, salvage)
        with contextlib.closing(storage):
            yield storage


_ALL = 1e9
"""Window longer than any recording, s."""


class ValveFeed:
    """Fills a `RecordBuffer` from the recorded messages of a valve.

    Without a `joint`, the stem is the only joint, or the joint called `stem`.
    """

    def __init__(
        self, topics: ValveTopics, valve: Valve, joint: str | None, stretch: Stretch
    ) -> None:
        self.name = topics.name
        self._topics = topics
        self._joint = joint
        self._joints_seen: set[str] = set()
        self._stretch = stretch
        self._buffer = RecordBuffer(valve, min(stretch.last, _ALL))
        self._first_stamp: int | None = None
        self._undecodable: dict[str, int] = {}
        self._refusal: str | None = None

    @property
    def inputs(self) -> Mapping[Topic, Callable[[bytes], None]]:
        """The function that takes the messages of each topic."""
        return {
            Topic(name, kind): take
            for name, kind, take in (
                (self._topics.pressure, PRESSURE_TYPE, self._take_pressure),
                (self._topics.stem, STEM_TYPE, self._take_stem),
            )
            if name is not None
        }

    def _read(self, data: bytes, topic: str | None, kind: str) -> tuple[int, Any] | None:
        """Decode a message; None if this fails or the stamp is outside the stretch."""
        message = decode(data, kind)
        if message is None:
            self._undecodable[str(topic)] = self._undecodable.get(str(topic), 0) + 1
            return None
        stamp = stamp_of(message)
        if self._first_stamp is None:
            self._first_stamp = stamp
        return (stamp, message) if self._stretch.contains(stamp - self._first_stamp) else None

    def _take_pressure(self, data: bytes) -> None:
        if read := self._read(data, self._topics.pressure, PRESSURE_TYPE):
            stamp, message = read
            self._buffer.add_pressure(stamp, float(message.fluid_pressure))

    def _take_stem(self, data: bytes) -> None:
        if not (read := self._read(data, self._topics.stem, STEM_TYPE)):
            return
        stamp, message = read
        self._joints_seen.update(message.name)
        if self._joint is None:
            try:
                self._joint = only_joint(message.name)
            except ValueError as error:
                self._refusal = self._refusal or f"{self._topics.stem}: {error}"
                return
        position = joint_position(message.name, message.position.tolist(), self._joint)
        self._buffer.add_position(stamp, position)

    def notes(self) -> list[str]:
        """Return notes on the messages left out, with the reasons."""
        notes = [
            f"{count} messages of {topic} cannot be decoded as its type, and were left out"
            for topic, count in self._undecodable.items()
        ]
        cause = self._buffer.snapshot().cleared_because
        if cause is not None:
            notes.append(f"{cause}: data recorded before that was left out")
        return notes

    def outcome(self) -> Recording | RefusalError:
        """Resample both signals on a common grid, as the node does; or return why not.

        The remedies of a refusal suit a file.
        """
        try:
            return self._recording()
        except RefusalError as refusal:
            return refusal

    def _recording(self) -> Recording:
        if self._topics.missing is not None:
            raise RefusalError(self._topics.missing)
        if self._refusal is not None:
            raise RefusalError(self._refusal)
        snapshot = self._buffer.snapshot()
        if self._joint and self._joints_seen and self._joint not in self._joints_seen:
            joints = ", ".join(sorted(self._joints_seen))
            raise RefusalError(f"{self._topics.stem}: no joint {self._joint!r} among {joints}")
        if snapshot.rejections:
            raise RefusalError(
                f"bad samples: {snapshot.causes()}: use a stretch of the record without them"
            )
        names = (str(self._topics.pressure), str(self._topics.stem))
        return uniform_recording(
            snapshot.pressure,
            snapshot.position,
            names,
            refusal_of=lambda gap: f"{gap.what}: {gap.remedy(WITHOUT_GAP)}",
        )


def _valves(
    path: Path, topics: Collection[Topic], choice: TopicChoice, damaged: Mapping[Path, str]
) -> list[ValveTopics]:
    if not topics:
        cause = "; ".join(f"{file.name}: {cause}" for file, cause in damaged.items())
        raise ValueError(
            f"{path}: it cannot be read ({cause}): copy or record it again"
            if damaged
            else f"{path}: the bag is empty: the recorder received no messages"
        )
    try:
        return valves_in(topics, choice)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _read(
    path: Path,
    files: Sequence[Path],
    damaged: Mapping[Path, str],
    valve: Valve,
    choice: TopicChoice,
    stretch: Stretch,
) -> list[ValveFeed]:
    """Read all valves from a bag; from damaged files only the part that can be salvaged."""
    with contextlib.ExitStack() as stack:
        storages = [stack.enter_context(opened(file, file in damaged)) for file in files]
        topics = {topic for storage in storages for topic in storage.topics}
        found = [
            ValveFeed(each, valve, choice.joint, stretch)
            for each in _valves(path, topics, choice, damaged)
        ]
        takers = {topic: take for feed in found for topic, take in feed.inputs.items()}
        for storage in storages:
            for topic, data in storage.messages(takers.keys() & set(storage.topics)):
                takers[topic](data)
    return found


def read_bag(
    path: Path, valve: Valve, choice: TopicChoice, stretch: Stretch
) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a bag, by namespace, in one pass over its messages.

    The messages pass through the buffer of the node by header stamp, in the order of recording of
    each topic, so that they give the same numbers as the node.

    `path` is the folder of a bag, or one of its files: MCAP or SQLite3, compressed or not. If
    metadata or index are missing, or the file is truncated, it is read as far as possible. Raises
    ValueError, one line with the remedy, if the file is not a bag of ROS 2 or contains no valve.
    """
    files, notes = storage_files(path)
    damaged: dict[Path, str] = {}
    while True:
        try:
            found = _read(path, files, damaged, valve, choice, stretch)
            break
        except DamagedFileError as damage:
            damaged[damage.path] = damage.cause
        except OSError as error:
            raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    notes += [
        f"{file.name} is truncated or damaged ({cause}): it was read as far as possible"
        for file, cause in damaged.items()
    ]
    return tuple(
        RecordedValve(path, feed.name, feed.outcome(), (*notes, *feed.notes())) for feed in found
    )
