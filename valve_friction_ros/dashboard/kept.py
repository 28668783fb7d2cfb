"""The history as the pages read it: in a thread, and again only when the file has changed."""

import threading
import time
from collections import OrderedDict, defaultdict, deque
from pathlib import Path

from valve_friction_ros.dashboard.sparkline import Sparkline, sparkline
from valve_friction_ros.history import (
    HistoryError,
    HistoryFile,
    HistoryMark,
    KeptRatio,
    KeptValve,
    ValveHistory,
    history_mark,
    ratios_after,
    valve_histories,
)
from valve_friction_ros.streams import DAY

__all__ = ["KeptHistory"]

_SPARK_DAYS = 400
_MOST_RATIOS = 800
"""Ratios of a valve that its sparkline is drawn from."""
_DEPTH = 1100 * DAY
"""Time, ns, of a valve's history that is read at most."""
_CACHED = 8
"""Valves whose histories are kept in memory."""


def _stamp_of(path: Path) -> tuple[int, int, int]:
    """Return time, size and number of a file, zeros where it is not there."""
    try:
        status = path.stat()
    except OSError:
        return (0, 0, 0)
    return (status.st_mtime_ns, status.st_size, status.st_ino)


class KeptHistory:
    """What the history file says of all valves and of each.

    `refresh` and `valve` read the file, so they are called in a thread of their own; all else
    returns at once. What cannot be read is a `problem`, and what was read before stays.

    Parameters
    ----------
    path : Path or None
        The file of the history; None: there is none.
    """

    def __init__(self, path: Path | None) -> None:
        self._file = None if path is None else HistoryFile(path)
        self._lock = threading.Lock()
        self._seen: tuple[object, ...] = ()
        self._mark: HistoryMark | None = None
        self._row = 0
        self._number = 0
        self._ratios: defaultdict[str, deque[KeptRatio]] = defaultdict(
            lambda: deque(maxlen=_MOST_RATIOS)
        )
        self._sparks: dict[str, Sparkline | None] = {}
        self._histories: OrderedDict[str, ValveHistory | None] = OrderedDict()
        self.valves: tuple[KeptValve, ...] = ()
        self.problem: str | None = None if path else "no history_file is named: nothing is kept"
        self.revision = 0

    def _state(self) -> tuple[object, ...]:
        """Return what changes when the file does, its journal included."""
        if self._file is None:
            return ()
        path = self._file.path
        return tuple(map(_stamp_of, (path, path.with_name(path.name + "-wal"))))

    def refresh(self) -> bool:
        """Read what is new, if the file has changed; return whether it has."""
        with self._lock:
            state = self._state()
            if self._file is None or state == self._seen:
                return False
            since = time.time_ns() - _SPARK_DAYS * DAY
            self._seen = state
            self._begin_anew_for_another_file()
            try:
                mark = history_mark(self._file)
                if mark == self._mark and self.problem is None:
                    return False
                self.valves = self._file.valves()
                found = ratios_after(self._file, self._row, since)
            except HistoryError as error:
                is_new, self.problem = str(error) != self.problem, str(error)
                self.revision += is_new
                return is_new
            self.problem, self._mark = None, mark
            for one in found:
                self._ratios[one.valve].append(one)
                self._row = max(self._row, one.row)
            for valve in {one.valve for one in found}:
                ratios = list(self._ratios[valve])
                self._sparks[valve] = sparkline([r.time for r in ratios], [r.ratio for r in ratios])
            self._histories.clear()
            self.revision += 1
            return True

    def _begin_anew_for_another_file(self) -> None:
        """Forget what was read where another file stands at the path: its rows count from 1."""
        if self._file is None:
            return
        number = _stamp_of(self._file.path)[2]
        if number and self._number and number != self._number:
            self._mark, self._row = None, 0
            self._ratios.clear()
            self._sparks.clear()
        self._number = number or self._number

    def spark(self, node: str) -> Sparkline | None:
        """Return the picture of a valve's ratios, if there are some."""
        return self._sparks.get(node)

    def valve(self, node: str) -> ValveHistory | None:
        """Read the history of a valve; None if nothing is kept of it.

        Raises HistoryError if the file cannot be read.
        """
        if self._file is None:
            return None
        with self._lock:
            if node not in self._histories:
                kept = next((one for one in self.valves if one.name == node), None)
                now = time.time_ns()
                found = (
                    ()
                    if kept is None
                    else valve_histories(self._file, (kept,), now - _DEPTH, now + _DEPTH)
                )
                self._histories[node] = found[0] if found else None
                while len(self._histories) > _CACHED:
                    self._histories.popitem(last=False)
            return self._histories[node]
