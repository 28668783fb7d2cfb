"""Bounds on connections: a request must arrive in time, and one client may not take them all.

uvicorn bounds neither: its time limits begin after a response, and its limit of concurrency counts
all clients together. So its protocol is given to it with both.
"""

import asyncio
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from valve_friction_ros.dashboard.access.log_in import network_of
from valve_friction_ros.outside_text import printable

__all__ = ["ARRIVAL_TIME", "MOST_OF_A_CLIENT", "ConnectionLog", "bounded_protocol"]

ARRIVAL_TIME = 10.0
"""Time for a request to arrive whole, s, from the connection or from its first byte."""

MOST_OF_A_CLIENT = 256
"""Open connections of one address. Chosen: a browser takes seven for a page and one to keep it, so
30 may open pages at once behind one proxy; a process may open 1024 files, as a rule."""

_SUMMARY = 60.0
"""Time between two lines of the log on one client, s."""


class ConnectionLog:
    """Logs that connections were ended: the first at once, then a sum each minute.

    Parameters
    ----------
    log : callable
        Takes a line.
    """

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._more: Counter[tuple[str, str]] | None = None

    def note(self, client: str, why: str) -> None:
        """Count that a connection of a client was ended."""
        if self._more is not None:
            self._more[client, why] += 1
            return
        self._log(f"a connection of {printable(client)} was ended: {why}")
        self._begin()

    def _begin(self) -> None:
        self._more = Counter()
        asyncio.get_running_loop().call_later(_SUMMARY, self._sum_up)

    def _sum_up(self) -> None:
        more, self._more = self._more, None
        if not more:
            return
        (client, why), _ = max(more.items(), key=lambda one: one[1])
        self._log(
            f"{sum(more.values())} more connections were ended in {_SUMMARY:g} s, most of "
            f"{printable(client)}: {why}"
        )
        self._begin()


class _Bounded(HttpToolsProtocol):
    """uvicorn's protocol of a connection, with a time for requests and a bound for each client."""

    def __init__(self, *arguments: Any, ended: ConnectionLog, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._ended = ended
        self._network = ""
        self._due: asyncio.TimerHandle | None = None
        self._has_begun = False

    @property
    def since(self) -> float:
        """Time at which its request is overdue, s of the loop's clock; infinite without one."""
        return float("inf") if self._due is None else self._due.when()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection; beyond the bound one of its client's that waits longest is ended."""
        super().connection_made(transport)
        self._network = network_of(_host(self))
        self._await_request()
        own = [one for one in self.connections if network_of(_host(one)) == self._network]
        if len(own) > MOST_OF_A_CLIENT:
            waiting = [one for one in own if isinstance(one, _Bounded)]
            oldest = min(waiting, key=lambda one: one.since)
            oldest.end(f"more than {MOST_OF_A_CLIENT} were open")

    def connection_lost(self, exc: Exception | None) -> None:
        """Give a connection up."""
        self._has_arrived()
        super().connection_lost(exc)

    def end(self, why: str) -> None:
        """End the connection at once, and note why."""
        self._has_arrived()
        self._ended.note(self._network, why)
        self.connections.discard(self)
        self.transport.abort()

    def _await_request(self) -> None:
        if self._due is None:
            self._due = self.loop.call_later(ARRIVAL_TIME, self._overdue)

    def _overdue(self) -> None:
        if self._has_begun:
            self.end(f"its request did not arrive within {ARRIVAL_TIME:g} s")
        else:  # browsers open connections in advance
            self.transport.abort()

    def _has_arrived(self) -> None:
        if self._due is not None:
            self._due.cancel()
            self._due = None

    def on_message_begin(self) -> None:
        """Begin a request."""
        self._has_begun = True
        self._await_request()
        super().on_message_begin()

    def on_message_complete(self) -> None:
        """End a request."""
        self._has_arrived()
        super().on_message_complete()


def _host(connection: object) -> str:
    """Return the address of the other side, of a WebSocket's protocol as well."""
    client = getattr(connection, "client", None)
    return client[0] if client else ""


def bounded_protocol(log: Callable[[str], None]) -> Callable[..., asyncio.Protocol]:
    """Return what uvicorn takes as ``http``; `log` takes the lines on ended connections."""
    return partial(_Bounded, ended=ConnectionLog(log))
