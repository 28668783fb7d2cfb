"""Files that hold secrets."""

from pathlib import Path

__all__ = ["require_private"]


def require_private(file: Path) -> None:
    """Raise ValueError if anybody but its owner can read or write a file."""
    if file.stat().st_mode & 0o077:
        raise ValueError(f"{file} is open to others: run `chmod 600 {file}`")
