"""What tells whether a file of the history has changed, without opening it."""

from pathlib import Path
from typing import NamedTuple

__all__ = ["FileStamp", "file_state"]


class FileStamp(NamedTuple):
    """When a file was changed (ns), its size and its number; zeros where it is not there."""

    time: int = 0
    size: int = 0
    number: int = 0


def _stamp_of(path: Path) -> FileStamp:
    try:
        status = path.stat()
    except OSError:
        return FileStamp()
    return FileStamp(status.st_mtime_ns, status.st_size, status.st_ino)


def file_state(path: Path) -> tuple[FileStamp, FileStamp]:
    """Return the stamps of a history and of its journal: one changes when the history does."""
    return _stamp_of(path), _stamp_of(path.with_name(f"{path.name}-wal"))
