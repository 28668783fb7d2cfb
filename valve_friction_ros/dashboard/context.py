# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Context of the pages: options, valves, history, files, service calls and visitors."""

import asyncio
import contextlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, Protocol
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from valve_friction_ros.dashboard.accounts import Access
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.live_state import Plant
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.health import AlarmKind, AlarmRequest
from valve_friction_ros.history import HistoryError, KeptValve, Place
from valve_friction_ros.outside_text import printable

INSTALL = "pip install 'nicegui>=3.18,<4'"
"""Command that installs the web framework, which rosdep does not know."""


def zone_of(name: str) -> ZoneInfo:
    """Return a time zone by its IANA name; raises ValueError for an unknown one."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise ValueError(
            f"time_zone {name!r} is unknown: give an IANA name such as UTC or Europe/Berlin"
        ) from None


@dataclass(frozen=True)
class DashboardOptions:
    """Address, files and times of a dashboard.

    Attributes
    ----------
    access : Access
        Address to listen on, and access control.
    port : int
        Port to listen on.
    history : Path or HistoryServer or None
        The history of the valves; None without a history.
    reports, bags, alarms : Path or None
        The folders of files to serve; None without a folder.
    time_zone : str
        Default time zone; the address of a page can name another.
    silence : float
        Time without a message after which a valve is silent, s.

    Raises
    ------
    ValueError
        If port or silence is impossible, or the zone unknown.
    """

    access: Access = field(default_factory=Access)
    port: int = 8080
    history: Place | None = None
    reports: Path | None = None
    bags: Path | None = None
    alarms: Path | None = None
    time_zone: str = "UTC"
    silence: float = 5.0

    def __post_init__(self) -> None:
        """Refuse impossible options."""
        if not 0 < self.port < 65536:
            raise ValueError(f"port {self.port} is impossible: give one from 1 to 65535")
        if not self.silence > 0:
            raise ValueError(f"silence must be above 0 s, got {self.silence:g}")
        zone_of(self.time_zone)

    @property
    def address(self) -> str:
        """The address to open in a browser on this machine."""
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.access.host, self.access.host)  # noqa: S104
        scheme = "https" if self.access.is_encrypted else "http"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{self.port}/"


class Answer(NamedTuple):
    """Answer of a service."""

    success: bool
    message: str


class ServiceRequest(NamedTuple):
    """A service call.

    Attributes
    ----------
    name : str
        Name of the service, without the node.
    values : mapping of str to object
        Parameters to set on the identifier for this call.
    switch : bool or None
        Argument of a std_srvs/SetBool service; None for a service without argument.
    """

    name: str
    values: Mapping[str, object] = MappingProxyType({})
    switch: bool | None = None


class Operator(Protocol):
    """Calls the services of identifiers."""

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Call a service of an identifier and wait for its answer.

        If the identifier cannot be reached, return an unsuccessful answer that says so.
        """
        ...


class Signals(Protocol):
    """Subscribes to the signals of a valve while a page shows them."""

    def watch(self, node: str) -> LiveStrip:
        """Subscribe to pressure and stem of an identifier's valve, once for all visitors."""
        ...

    def unwatch(self, node: str) -> None:
        """Release one use of the signals; the last release ends the subscriptions."""
        ...


class NoSignals:
    """Signals of a dashboard without ROS: none arrive."""

    def watch(self, _node: str) -> LiveStrip:
        """Return an empty strip."""
        return LiveStrip(60.0)

    def unwatch(self, _node: str) -> None:
        """Do nothing."""


class Visitors(Protocol):
    """Knows the visitor of the page whose code is running."""

    def name(self) -> str:
        """Return the name of the visitor's account; empty if no account is needed."""
        ...

    def may_operate(self) -> bool:
        """Return whether the visitor may call services now."""
        ...

    def log_out(self) -> None:
        """End the visitor's session."""
        ...


NOT_ALLOWED = "your account may not operate: log in with one that may"


class GuardedOperator:
    """Calls services only for a visitor with permission to operate at that moment.

    Parameters
    ----------
    operator : Operator
        Calls the services.
    visitors : Visitors
        Knows the visitor.
    log : callable
        Takes a line for each call by a visitor with an account.
    """

    def __init__(self, operator: Operator, visitors: Visitors, log: Callable[[str], None]) -> None:
        self._operator, self._visitors, self._log = operator, visitors, log

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Call a service of an identifier, or return a refusal without permission.

        A request on an alarm carries the name of the logged-in account, whatever the page says.
        """
        if not self._visitors.may_operate():
            return Answer(False, NOT_ALLOWED)
        if name := self._visitors.name():
            self._log(f"{name} calls {printable(node)}/{printable(request.name)}")
            if "alarm_who" in request.values:
                request = request._replace(values={**request.values, "alarm_who": name})
        return await self._operator.call(node, request)


@dataclass(frozen=True)
class DashboardContext:
    """Data sources and services of a dashboard.

    Attributes
    ----------
    options : DashboardOptions
        Options of the dashboard.
    plant : Plant
        Live state of the valves.
    history : HistoryCache
        History of the valves.
    operator : Operator
        Calls the services of identifiers.
    signals : Signals
        Receives the signals of valves.
    visitors : Visitors
        Knows the visitor and the visitor's permission.
    is_live : bool
        Whether identifiers are heard and can be called; else there is only the history.
    """

    options: DashboardOptions
    plant: Plant
    history: HistoryCache
    operator: Operator
    signals: Signals
    visitors: Visitors
    is_live: bool = True

    async def answer_alarms(
        self, alarms: Sequence[tuple[KeptValve, AlarmKind]], request: AlarmRequest
    ) -> Answer:
        """Make a request on many alarms at once, through the history."""
        if not self.visitors.may_operate():
            return Answer(False, NOT_ALLOWED)
        name = self.visitors.name() or request.who
        try:
            count = await asyncio.to_thread(self.history.answer, alarms, replace(request, who=name))
        except HistoryError as error:
            return Answer(False, str(error))
        return Answer(count > 0, f"{count} of {len(alarms)} alarms {request.action.value}")


_ENDINGS = (".html", ".mcap", ".db3", ".yaml")
_MOST_FILES = 40
_MOST_LOOKED = 20_000


class OfferedFile(NamedTuple):
    """A file: name of its folder, path below it, label, size, bytes, and time, s."""

    kind: str
    path: str
    label: str
    size: int
    time: float


def _stem(namespace: str) -> str:
    return namespace.strip("/").replace("/", "_")


@dataclass(frozen=True)
class ValveFiles:
    """The folders of reports, bags and alarms.

    Attributes
    ----------
    folders : mapping of str to Path
        The folders by their names in addresses.
    """

    folders: Mapping[str, Path]

    @classmethod
    def of(cls, options: DashboardOptions) -> "ValveFiles":
        """Return the folders of a dashboard."""
        named = {"reports": options.reports, "bags": options.bags, "alarms": options.alarms}
        return cls({name: path for name, path in named.items() if path is not None})

    def found(self, kind: str, path: str) -> Path | None:
        """Return a file by the name of its folder and its path there.

        Return None if the file does not exist, is neither a report nor part of a bag, or lies
        outside the folder, even through a link.
        """
        folder = self.folders.get(kind)
        if folder is None or "\0" in path:
            return None
        try:
            root = folder.resolve(strict=True)
            wanted = (root / path).resolve(strict=True)
        except (OSError, RuntimeError):
            return None
        is_inside = wanted.is_relative_to(root) and wanted.suffix.lower() in _ENDINGS
        return wanted if is_inside and wanted.is_file() else None

    def offered(self, namespace: str) -> list[OfferedFile]:
        """Return the reports and bags of a valve by its namespace, the newest first."""
        stem = _stem(namespace)
        found: list[OfferedFile] = []
        for kind, folder in self.folders.items():
            start = f"alarm_{stem}_" if kind == "alarms" else f"{stem}_"
            name = re.compile(rf"{re.escape(start)}\d{{8}}T\d{{6}}Z")
            with contextlib.suppress(OSError):
                places = sorted(folder.iterdir(), key=lambda one: one.name, reverse=True)
                mine = [p for p in places[:_MOST_LOOKED] if name.match(p.name)]
                for place in mine[:_MOST_FILES]:
                    found += self._files(kind, folder, place)
        return sorted(found, key=lambda one: -one.time)[: 2 * _MOST_FILES]

    @staticmethod
    def sharing(namespace: str, others: Iterable[str]) -> tuple[str, ...]:
        """Return other namespaces with the same file names, such as /a_b for /a/b."""
        stem = _stem(namespace)
        found = {one for one in others if one != namespace and _stem(one) == stem}
        return tuple(sorted(found))

    def _files(self, kind: str, folder: Path, place: Path) -> list[OfferedFile]:
        found = []
        try:
            for one in [place] if place.is_file() else sorted(place.iterdir())[:20]:
                if one.suffix.lower() in _ENDINGS and one.is_file():
                    path, about = one.relative_to(folder).as_posix(), one.stat()
                    label = printable(path, 200)
                    found.append(OfferedFile(kind, path, label, about.st_size, about.st_mtime))
        except OSError:
            return []
        return found
