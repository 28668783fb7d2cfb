"""Files that hold secrets."""

from pathlib import Path

__all__ = ["require_private"]


def require_private(file: Path) -> None:
    """Raise ValueError if others can read a file, or anybody but its owner can write it."""
    if file.stat().st_mode & 0o027:
        raise ValueError(f"{file} is open to others: run `chmod 600 {file}`")
