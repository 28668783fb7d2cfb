"""One node at a time keeps the history of a valve."""

import fcntl
import hashlib
import os
import struct
from pathlib import Path

__all__ = ["Claim"]

_ENDING = "-nodes"
"""What the name of the file has behind that of the history; it has no content."""

_PLACES = 2**62


class Claim:
    """A claim on the history of one valve, which ends with its process, however that ends.

    It is a lock of one byte of a file beside the history, whose place follows from the name of the
    valve. Where the system has no such locks, or the file cannot be made, every claim is granted.

    Parameters
    ----------
    history : Path
        The history.
    valve : str
        Name of the valve.
    """

    def __init__(self, history: Path, valve: str) -> None:
        self._path = history.with_name(history.name + _ENDING)
        digest = hashlib.sha256(valve.encode()).digest()
        self._place = int.from_bytes(digest[:8], "big") % _PLACES
        self._file: int | None = None
        self.is_granted = False

    def ask(self) -> bool:
        """Ask for it, unless it is granted already; tell if it is."""
        if not self.is_granted:
            self.is_granted = self._locked()
        return self.is_granted

    def _locked(self) -> bool:
        command = getattr(fcntl, "F_OFD_SETLK", None)  # Linux
        if command is None:
            return True
        try:
            if self._file is None:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            lock = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, self._place, 1, 0)
            fcntl.fcntl(self._file, command, lock)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True

    def release(self) -> None:
        """Give it back."""
        self.is_granted = False
        if self._file is not None:
            os.close(self._file)
            self._file = None
