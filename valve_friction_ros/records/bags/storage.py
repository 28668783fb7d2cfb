# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What tells a bag, what reads one needs, and what its storage files offer."""

import contextlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Protocol

from valve_friction_ros.records.bags.topics import Topic

_LIBRARIES = ("rosbags", "lz4", "backports")
"""Top-level modules. rosbags itself asks for the others."""

_REMEDY = "run `pip install 'rosbags>=0.11.9,<0.12' lz4 backports.zstd`"


@contextlib.contextmanager
def bag_libraries() -> Iterator[None]:
    """Import modules of this room that need rosbags, lz4 and backports.zstd within this block.

    Raises ValueError, which says what to install, if one of these is not there, or is another
    version.
    """
    try:
        yield
    except ImportError as error:
        library = (error.name or "").partition(".")[0]
        if library not in _LIBRARIES:
            raise
        raise ValueError(
            f"bags need rosbags, lz4 and backports.zstd ({error}): {_REMEDY}"
        ) from None


MCAP = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"
ZSTD = b"\x28\xb5\x2f\xfd"
ROS_1 = b"#ROSBAG V"

_SUFFIXES = (".mcap", ".db3", ".zstd", ".bag")


def first_bytes(path: Path) -> bytes:
    """Return the bytes of a file that tell its format."""
    with path.open("rb") as stream:
        return stream.read(16)


def is_bag(path: Path) -> bool:
    """Return whether a file or folder is a bag, by its content or its ending, and no CSV file."""
    if path.is_dir() or path.suffix in _SUFFIXES:
        return True
    try:
        return first_bytes(path).startswith((MCAP, SQLITE, ZSTD, ROS_1))
    except OSError:
        return False


class DamagedFileError(Exception):
    """A storage file that cannot be read as it should be; the file is its first argument."""

    def __init__(self, path: Path, cause: str) -> None:
        super().__init__(path, cause)
        self.path = path
        self.cause = cause.rstrip(".")


class Storage(Protocol):
    """One storage file of a bag, open for reading."""

    topics: Collection[Topic]

    def messages(self, topics: Collection[Topic]) -> Iterator[tuple[Topic, bytes]]:
        """Go through the messages of some topics in the order of their recording."""
