"""Whether a file or folder is a bag: the first bytes and the endings of storage files."""

from pathlib import Path

__all__ = ["MCAP", "ROS_1", "SQLITE", "ZSTD", "first_bytes", "is_bag"]

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
