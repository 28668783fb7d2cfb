"""The valves of a plant as they were heard last: filled by callbacks, drained by pages."""

import itertools
import math
import threading
from collections.abc import Iterable
from dataclasses import dataclass, replace

from valve_friction_ros.dashboard.heard.status_reading import (
    Essence,
    essence_of,
    identifier_in,
    view_of,
)
from valve_friction_ros.dashboard.heard.valve_view import Status, Unread, ValveView

__all__ = ["MOST_VALVES", "Heard", "Plant"]

MOST_VALVES = 5000
"""Most valves that are kept: the names come from outside, and might never end."""

_FORGETTING = 3600.0
"""Silence, s, after which a valve is forgotten that the history does not keep."""
_TIDYING = 60.0
"""Time between two looks for valves to forget, s."""


@dataclass(frozen=True)
class Heard:
    """A valve, and how long ago it was heard.

    Attributes
    ----------
    number : int
        Number of the valve in this run of the dashboard.
    view : ValveView
        What is known of it.
    silent_for : float or None
        Time since its last message, s; None where it has never been heard.
    is_silent : bool
        Whether that is too long.
    revision : int
        Grows with each change of what a table shows of the valve.
    """

    number: int
    view: ValveView
    silent_for: float | None
    is_silent: bool
    revision: int = 0


class _Valve:
    """The newest status of a valve; its view is made when somebody looks."""

    def __init__(self, number: int, view: ValveView) -> None:
        self.number = number
        self.at: float | None = None
        self.latest: Unread | None = None
        self.revision = 0
        self.is_kept = False
        self.view = view
        self._mark: object = None
        self._essence: Essence = ()
        self._read: Unread | None = None

    def look(self, node: str, with_values: bool) -> None:
        """Read what came last; without its values where nothing else can have changed.

        What is no status changes nothing.
        """
        latest = self.latest
        if latest is None or latest is self._read:
            return
        try:
            mark = None if latest.mark is None else latest.mark()
            if mark is not None and mark == self._mark and not with_values:
                return
            status = latest.read()
        except ValueError:
            self.latest = None
            return
        self._mark = mark
        essence = essence_of(status)
        if essence != self._essence:
            self.view, self._essence = view_of(node, status), essence
            self.revision += 1
        self._read = latest if with_values else None
        self.view = replace(self.view, values=status.values if with_values else {})


class Plant:
    """What is known of each valve, behind a lock: any thread may write and read.

    A page never draws in a callback of ROS: it takes `valves` in a timer of its own.

    Parameters
    ----------
    silence : float
        Time without a message, s, after which a valve counts as silent.
    """

    def __init__(self, silence: float) -> None:
        self._silence = silence
        self._lock = threading.Lock()
        self._valves: dict[str, _Valve] = {}
        self._numbers = itertools.count()
        self._tidied = -math.inf

    def hear(self, status: Unread, at: float) -> None:
        """Take a status that came at a time, s of the monotonic clock.

        It is read when somebody looks. That of another node than an identifier is ignored.
        """
        node = identifier_in(status.name)
        if node is None:
            return
        with self._lock:
            self._tidy(at)
            if (valve := self._entry(node, "")) is not None:
                valve.at, valve.latest = at, status

    def expect(self, valves: Iterable[tuple[str, str]]) -> None:
        """Show valves, (identifier, tag) each, that the history keeps, also before they are heard.

        They are never forgotten.
        """
        with self._lock:
            for node, tag in valves:
                if (valve := self._entry(node, tag)) is not None:
                    valve.is_kept = True

    def _tidy(self, now: float) -> None:
        """Forget the valves that nothing keeps and that have been silent for long."""
        if now < self._tidied + _TIDYING:
            return
        self._tidied = now
        gone = [
            node
            for node, valve in self._valves.items()
            if not valve.is_kept and valve.at is not None and now > valve.at + _FORGETTING
        ]
        for node in gone:
            del self._valves[node]

    def _entry(self, node: str, tag: str) -> _Valve | None:
        valve = self._valves.get(node)
        if valve is None and len(self._valves) < MOST_VALVES:
            view = view_of(node, Status("", 3, tag, "", {}))
            valve = self._valves[node] = _Valve(next(self._numbers), view)
        return valve

    def valves(self, now: float) -> list[Heard]:
        """Return all valves as they are at a time, s of the monotonic clock, in a fixed order.

        Their views are without `values`.
        """
        with self._lock:
            self._tidy(now)
            return [self._heard(node, valve, now, False) for node, valve in self._valves.items()]

    def valve(self, node: str, now: float) -> Heard | None:
        """Return the valve of an identifier, if it is known."""
        with self._lock:
            valve = self._valves.get(node)
            return None if valve is None else self._heard(node, valve, now, True)

    def _heard(self, node: str, valve: _Valve, now: float, with_values: bool) -> Heard:
        valve.look(node, with_values)
        age = None if valve.at is None else max(0.0, now - valve.at)
        silent = age is None or age > self._silence
        return Heard(valve.number, valve.view, age, silent, valve.revision)
