"""What every storage file of a bag offers, whatever its format."""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Protocol

from valve_friction_ros.records.bags.topics import Topic

__all__ = ["DamagedFileError", "Storage"]


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
