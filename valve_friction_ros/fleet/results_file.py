"""The output file of many identifications, which outlives the death of its writer."""

import csv
import fcntl
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from valve_friction_ros.fleet.row import Cell
from valve_friction_ros.fleet.row_format import row_format

__all__ = ["Entry", "ResultsFile"]

_Row = Mapping[str, Cell]


@dataclass(frozen=True, eq=False)
class Entry:
    """All rows of one recording.

    Attributes
    ----------
    recording : str
        Its name.
    content, settings : str
        Fingerprints of its files and of the options it was identified with.
    rows : tuple of mapping
        A row for each valve.
    """

    recording: str
    content: str
    settings: str
    rows: tuple[_Row, ...]

    @property
    def failed(self) -> bool:
        """True if a valve of it was refused."""
        return any(row["error"] for row in self.rows)

    @property
    def refused(self) -> bool:
        """True if all valves of it were refused."""
        return all(row["error"] for row in self.rows)


def _entry(rows: Sequence[_Row]) -> Entry:
    recording, content, settings = (
        str(rows[0][column] or "") for column in ("recording", "content", "settings")
    )
    return Entry(recording, content, settings, tuple(rows))


def _flush(stream: BinaryIO) -> None:
    stream.flush()
    os.fsync(stream.fileno())


class ResultsFile:
    """Rows that are appended as they finish, and are on the disk when `append` returns.

    The rows of a recording stand together. Those that a killed writer left incomplete, a torn
    line or some of a bag's valves, are at the end of the file and are cut off when it is opened.
    Only one process at a time can open it.

    Parameters
    ----------
    path : Path
        The file, made if it is not there; its ending tells the format.

    Raises
    ------
    ValueError
        If the file is another program's, is damaged elsewhere than at its end, or another process
        writes it.
    OSError
        If it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._format = row_format(path)
        self._stream: BinaryIO = path.open("a+b")  # leaves the time of change of a stranger alone
        try:
            self._lock(self._stream)
            self._recover()
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> "ResultsFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the file."""
        self._stream.close()

    def _lock(self, stream: BinaryIO) -> None:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"{self.path}: another run is writing it: wait for its end") from None

    def _recover(self) -> None:
        """Cut off what is incomplete; begin a new file with its header."""
        end = max((place for place, _ in self._scan()), default=0)
        self._stream.truncate(end)
        if end == 0:
            self._stream.write(self._format.header)
        _flush(self._stream)
        self._flush_folder()

    def _flush_folder(self) -> None:
        descriptor = os.open(self.path.resolve().parent, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def _stranger(self, number: int) -> ValueError:
        return ValueError(
            f"{self.path}: line {number} is no row of this command and version: give another "
            "output, or mend the file"
        )

    def _row(self, line: bytes, number: int) -> _Row:
        try:
            row = self._format.decode(line)
            if not row["recording"] or int(row["valves"] or 0) < 1:
                raise self._stranger(number)
        except (ValueError, csv.Error, TypeError):
            raise self._stranger(number) from None
        return row

    def _scan(self) -> Iterator[tuple[int, Entry | None]]:
        """Go through the complete entries, each with the place where it ends in the file.

        The header counts as an entry of nothing.
        """
        form = self._format
        self._stream.seek(0)
        rows: list[_Row] = []
        place = 0
        for number, line in enumerate(self._stream, start=1):
            in_header = number == 1 and form.header
            if not line.endswith(b"\n"):
                expected = form.header if in_header else form.beginning
                length = min(len(line), len(expected))
                if line[:length] != expected[:length] or (in_header and len(line) > length):
                    raise self._stranger(number)
                return
            place += len(line)
            if in_header:
                if line != form.header:
                    raise self._stranger(number)
                yield place, None
                continue
            rows.append(self._row(line, number))
            entry = _entry(rows)
            if rows[-1]["recording"] != entry.recording:
                raise self._stranger(number)
            if len(rows) == int(rows[-1]["valves"] or 0):
                rows = []
                yield place, entry

    def entries(self) -> Iterator[Entry]:
        """Read the complete entries, one by one."""
        return (entry for _, entry in self._scan() if entry is not None)

    def keep(self, wanted: Callable[[Entry], bool]) -> int:
        """Drop the entries that are not wanted, all at once; return their number.

        The file is written anew beside its place and renamed, so that a kill leaves the one or
        the other.
        """
        dropped = sum(not wanted(entry) for entry in self.entries())
        if dropped == 0:
            return 0
        place = self.path.resolve()
        draft = place.with_name(f".{place.name}.draft")
        stream: BinaryIO = draft.open("a+b")
        try:
            self._lock(stream)
            stream.truncate(0)  # of what a kill left
            stream.write(self._format.header)
            for entry in self.entries():
                if wanted(entry):
                    stream.writelines(map(self._format.encode, entry.rows))
            _flush(stream)
            draft.rename(place)
        except BaseException:
            stream.close()
            draft.unlink(missing_ok=True)
            raise
        self._stream.close()
        self._stream = stream
        self._flush_folder()
        return dropped

    def append(self, rows: Sequence[_Row]) -> None:
        """Write the rows of a recording at the end; they are on the disk on return."""
        self._stream.write(b"".join(map(self._format.encode, rows)))
        _flush(self._stream)
