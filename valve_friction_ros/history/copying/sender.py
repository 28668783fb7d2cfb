"""The thread that sends what is new in a file to a server, one for all nodes of a process."""

import queue
import threading
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path

from valve_friction_ros.history.claim import Claim
from valve_friction_ros.history.copying.delivery import Delivery
from valve_friction_ros.history.copying.unsent import UnsentCount, count_unsent, follow
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.file_state import file_state
from valve_friction_ros.history.server.address import HistoryServer

__all__ = ["Sender", "SentState", "sender_of"]

_PAUSE = 1.0
"""Time, s, between two looks at the file. Chosen: a person does not wait for a row."""

_LONGEST_PAUSE = 30.0
"""Longest time, s, between two tries. Chosen: a server that returns is not overrun."""

_TAKING = 10.0
"""Time, s, that nodes of a process wait for the server at their start, all together. Chosen."""

_ENDING = 2.0
"""Time, s, for which the end of a node waits for what is sent. Chosen: the rest is in the file."""

_PLACE = "sender"
"""By what processes of one machine agree which of them sends."""


@dataclass(frozen=True)
class SentState:
    """What a sender knows.

    Attributes
    ----------
    count : UnsentCount
        Rows that wait.
    problem : str or None
        Why they are not sent; None: they are.
    is_sending : bool
        Whether this process sends the rows of the file; else another one does.
    """

    count: UnsentCount = field(default_factory=lambda: UnsentCount(0, None, 0))
    problem: str | None = None
    is_sending: bool = False


class _Taking:
    """A valve whose rows are to be taken from the server, until nobody waits for them any more."""

    def __init__(self, valve: KeptValve) -> None:
        self.valve = valve
        self.done: Future[None] = Future()
        self.is_over = False


class Sender:
    """Sends what is new in a file to a server, and takes the rows of valves that come from there.

    What is not sent waits in the file, so nothing is lost by whatever ends. One process of a
    machine sends the rows of a file.

    Parameters
    ----------
    path : Path
        The file.
    server : HistoryServer
        The server.
    """

    def __init__(self, path: Path, server: HistoryServer) -> None:
        self._path, self._server = path, server
        self._delivery = Delivery(path, server)
        self._claim = Claim(path, _PLACE)
        self._takings: queue.SimpleQueue[_Taking] = queue.SimpleQueue()
        self._wake, self._ends = threading.Event(), threading.Event()
        self._begun = time.monotonic()
        self._told: str | None = None
        self.users = 0
        self.state = SentState()
        self._thread = threading.Thread(target=self._run, name="history sender", daemon=True)
        self._thread.start()

    @property
    def server(self) -> HistoryServer:
        """The server."""
        return self._server

    def take(self, valve: KeptValve) -> str | None:
        """Take the rows of a valve from the server, where another file has kept it since.

        Returns why that could not be done, or None. It waits some seconds at most, for all valves
        of a process together.
        """
        taking = _Taking(valve)
        patience = max(_PAUSE, self._begun + _TAKING - time.monotonic())
        if self.state.problem is not None:
            return self.state.problem
        self._takings.put(taking)
        self._wake.set()
        try:
            taking.done.result(patience)
        except TimeoutError:
            taking.is_over = True
            return f"{self._server}: no answer for {patience:.0f} s"
        except HistoryError as error:
            return str(error)
        return None

    def news(self) -> str | None:
        """Return once what has changed between file and server, in words."""
        problem = self.state.problem
        if problem == self._told:
            return None
        before, self._told = self._told, problem
        if problem is None:
            return None if before is None else f"{self._server}: the history is sent again"
        return f"the history waits in {self._path}: {problem}"

    def end(self) -> None:
        """Send what can be sent at once, and stop, where no other node of the process goes on."""
        with _lock:
            self.users -= 1
            if self.users > 0:
                return
            _senders.pop((self._path, self._server), None)
        self._ends.set()
        self._wake.set()
        self._thread.join(_ENDING)

    def _run(self) -> None:
        failures, looked, seen = 0, -_LONGEST_PAUSE, None
        while True:
            ends, problem = self._ends.is_set(), None
            state, now = file_state(self._path), time.monotonic()
            if state == seen and now - looked < _LONGEST_PAUSE and not ends and not self._has_work:
                self._wake.wait(_PAUSE)
                self._wake.clear()
                continue
            seen, looked = state, now
            try:
                self._cycle()
                failures = 0
            except HistoryError as error:
                failures, problem = failures + 1, str(error)
            except Exception as bug:  # noqa: BLE001 - the thread lives on, and says what is wrong
                failures, problem = failures + 1, f"internal error: {type(bug).__name__}: {bug}"
            self._count(problem)
            self._give_up_takings(problem)
            if ends:
                break
            self._wake.wait(min(_PAUSE * 2 ** max(0, failures - 1), _LONGEST_PAUSE))
            self._wake.clear()
        self._delivery.close()
        self._claim.release()

    @property
    def _has_work(self) -> bool:
        state = self.state
        waits = state.count.waiting > 0 or not self._takings.empty()
        return waits or state.problem is not None or not state.is_sending

    def _cycle(self) -> None:
        follow(self._path)
        is_sending = self._claim.ask()
        if is_sending:
            self._delivery.send(self._ends.is_set)
        while not self._takings.empty():
            one = self._takings.get()
            try:
                self._delivery.take(one.valve, lambda: one.is_over)  # noqa: B023 - called at once
            except HistoryError as error:
                one.done.set_exception(error)
                raise
            one.done.set_result(None)

    def _count(self, problem: str | None) -> None:
        is_sending = self._claim.is_granted
        try:
            count = count_unsent(self._path)
        except HistoryError as error:
            count, problem = self.state.count, problem or str(error)
        self.state = SentState(count, problem, is_sending)

    def _give_up_takings(self, problem: str | None) -> None:
        while problem is not None and not self._takings.empty():
            self._takings.get().done.set_exception(HistoryError(problem))


_senders: dict[tuple[Path, HistoryServer], Sender] = {}
_lock = threading.Lock()


def sender_of(path: Path, server: HistoryServer) -> Sender:
    """Return the sender of a file, which all nodes of the process share; each calls `end`."""
    with _lock:
        key = (path.absolute(), server)
        one = _senders.get(key)
        if one is None:
            one = _senders[key] = Sender(*key)
        one.users += 1
        return one
