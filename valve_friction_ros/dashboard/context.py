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
import math
import re
import time
from collections import defaultdict
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol
from urllib.parse import quote
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from valve_friction_ros.dashboard.accounts import Access
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.live_state import Plant
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.health.alarms import (
    AlarmAction,
    AlarmError,
    AlarmKind,
    AlarmRequest,
    alarm_summary,
)
from valve_friction_ros.history import HistoryError, KeptValve, Place, request_alarms, request_many
from valve_friction_ros.outside_text import printable
from valve_friction_ros.wording import numbered

if TYPE_CHECKING:
    from valve_friction_ros.dashboard.gate import Guard

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
        If the port is impossible, or the zone unknown.
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
        if not 0 < self.port < 65536:
            raise ValueError(f"port {self.port} is impossible: give one from 1 to 65535")
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


Services = Callable[[str, ServiceRequest], Awaitable[Answer]]
"""Calls a service of an identifier; if it cannot be reached, the unsuccessful answer says so."""


class Signals(Protocol):
    """Subscribes to the signals of a valve while a page shows them."""

    def watch(self, node: str) -> LiveStrip:
        """Subscribe to pressure and stem of an identifier's valve, once for all visitors."""
        ...

    def unwatch(self, node: str) -> None:
        """Release one use of the signals; the last release ends the subscriptions."""
        ...


_NOT_ALLOWED = Answer(False, "your account may only view: log in with one that may operate")
_NOTHING_HEARD = "this dashboard shows only a history: there is no identifier to call"
_ALARM_SERVICES = {
    AlarmAction.ACKNOWLEDGE: ("acknowledge", None),
    AlarmAction.SHELVE: ("shelve", None),
    AlarmAction.UNSHELVE: ("unshelve", None),
    AlarmAction.COMMENT: ("comment", None),
    AlarmAction.TAKE_OUT: ("out_of_service", True),
    AlarmAction.PUT_BACK: ("out_of_service", False),
}


@dataclass(frozen=True)
class DashboardContext:
    """Data sources and services of a dashboard.

    A request needs permission at that moment. One on an alarm carries the name of the logged-in
    account, whatever the page says.
    """

    options: DashboardOptions
    plant: Plant
    history: HistoryCache
    visitors: "Guard"
    """Knows the visitor and the visitor's permission."""
    log: Callable[[str], None]
    """Takes a line for each call by a visitor with an account."""
    services: Services | None = None
    """Calls the services of identifiers; None if none is heard and there is only the history."""
    signals: Signals | None = None
    """Receives the signals of valves."""

    @property
    def is_live(self) -> bool:
        """Whether identifiers are heard and can be called; else there is only the history."""
        return self.services is not None

    def _may_call(self, what: str) -> bool:
        """Return whether the visitor may call something now, and log who calls it."""
        if not self.visitors.may_operate():
            return False
        if name := self.visitors.name():
            self.log(f"{name} calls {printable(what)}")
        return True

    async def call(self, node: str, service: str) -> Answer:
        """Call a service of an identifier, or return a refusal."""
        if not self._may_call(f"{node}/{service}"):
            return _NOT_ALLOWED
        if self.services is None:
            return Answer(False, _NOTHING_HEARD)
        return await self.services(node, ServiceRequest(service))

    async def answer_alarm(
        self, node: str, kind: AlarmKind | None, request: AlarmRequest
    ) -> Answer:
        """Make a request on one alarm of a valve, or on all.

        It goes through a history file that holds the valve, because an identifier that shares its
        process with many valves offers no alarm services, but follows that file. Without such a
        file it goes through the identifier, or, if none is heard, through the history on a server.
        """
        if not self._may_call(f"{node}/{_ALARM_SERVICES[request.action][0]}"):
            return _NOT_ALLOWED
        return await self._answer(node, kind, self._signed(request))

    async def _answer(self, node: str, kind: AlarmKind | None, request: AlarmRequest) -> Answer:
        name, switch = _ALARM_SERVICES[request.action]
        file = self.history.file
        kept = next((one for one in self.history.valves if one.name == node), None)
        if self.services is not None and (kept is None or not self.history.is_file):
            values: dict[str, object] = {
                "alarm_kind": "all" if kind is None else kind.value,
                "alarm_who": request.who,
                "alarm_text": request.text,
            }
            if math.isfinite(request.duration):
                values["alarm_hours"] = request.duration / 3600
            return await self.services(node, ServiceRequest(name, values, switch))
        if file is None or kept is None:
            return Answer(False, f"{node}: the history has no such valve")
        now = time.time_ns()
        try:
            steps = await asyncio.to_thread(request_alarms, file, kept, kind, request, now)
        except (AlarmError, HistoryError) as error:
            return Answer(False, str(error))
        return Answer(True, alarm_summary(one.alarm for one in steps.events))

    async def answer_alarms(
        self, alarms: Sequence[tuple[KeptValve, AlarmKind]], request: AlarmRequest
    ) -> Answer:
        """Make a request on many alarms at once, through the history or the identifiers."""
        service = _ALARM_SERVICES[request.action][0]
        if not self._may_call(f"{service} for {numbered(len(alarms), 'alarm')}"):
            return _NOT_ALLOWED
        file, now, signed = self.history.file, time.time_ns(), self._signed(request)
        if file is None or (self.services is not None and not self.history.is_file):
            return await self._answer_each(alarms, signed)
        try:
            count = await asyncio.to_thread(request_many, file, alarms, signed, now)
        except HistoryError as error:
            return Answer(False, str(error))
        return Answer(count > 0, f"{count} of {len(alarms)} alarms {request.action.value}")

    async def _answer_each(
        self, alarms: Sequence[tuple[KeptValve, AlarmKind]], request: AlarmRequest
    ) -> Answer:
        """Make a request for each alarm: valves in parallel, alarms of one valve in turn."""
        by_valve: defaultdict[str, list[AlarmKind]] = defaultdict(list)
        for valve, kind in alarms:
            by_valve[valve.name].append(kind)

        async def of_valve(node: str, kinds: list[AlarmKind]) -> list[Answer]:
            return [await self._answer(node, kind, request) for kind in kinds]

        found = await asyncio.gather(*(of_valve(*each) for each in by_valve.items()))
        wrong = [one.message for some in found for one in some if not one.success]
        if wrong:
            return Answer(False, f"{len(wrong)} of {len(alarms)} refused: {wrong[0]}")
        return Answer(True, f"{len(alarms)} done")

    def _signed(self, request: AlarmRequest) -> AlarmRequest:
        return replace(request, who=self.visitors.name() or request.who)


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

    @property
    def address(self) -> str:
        """Path and query of its address."""
        return f"/files/{quote(self.kind)}/{quote(self.path)}"


def _stem(namespace: str) -> str:
    return namespace.strip("/").replace("/", "_")


@dataclass(frozen=True)
class ValveFiles:
    """The folders of reports, bags and alarms, by their names in addresses."""

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

    def report(self, path: str) -> str | None:
        """Return the address of a report by its path on the machine that wrote it, if it is here.

        Return None if this dashboard does not serve it.
        """
        name = Path(path).name
        return f"/files/reports/{quote(name)}" if self.found("reports", name) else None

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
