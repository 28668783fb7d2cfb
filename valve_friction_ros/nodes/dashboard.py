# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A plant's valves in a browser: their diagnosis, history and signals, and their services."""

import asyncio
import contextlib
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.dashboard import (
    ESSENTIAL_KEYS,
    Answer,
    DashboardOptions,
    Plant,
    ServiceRequest,
    Status,
    Unread,
)
from valve_friction_ros.dashboard.accounts import Access, accounts_from
from valve_friction_ros.dashboard.context import INSTALL, DashboardContext
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.history import server_from
from valve_friction_ros.nodes.plumbing.managed_node import ManagedNode
from valve_friction_ros.nodes.plumbing.messages import positions_in, pressures_in, readable
from valve_friction_ros.nodes.plumbing.output_folder import folder_of
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters, values_of
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.processes import keep_little_memory
from valve_friction_ros.nodes.plumbing.qos import statuses, watched
from valve_friction_ros.nodes.plumbing.running import WRONG_REQUESTS, StopRequest, cannot_start
from valve_friction_ros.nodes.plumbing.worker import Companion
from valve_friction_ros.nodes.service_call import LateError, TriggerCall, UnansweredError
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.settings import NODES

_SPAN = 60.0
"""Length of the displayed signals, s."""


@dataclass
class _Watch:
    strip: LiveStrip
    lookers: int = 0
    sources: StreamNames = field(default_factory=StreamNames)
    streams: tuple[PolledSubscription, ...] = ()

    def follow(self, node: PolledNode, sources: StreamNames) -> None:
        """Subscribe to the topics of the valve, and again whenever they change."""
        if sources != self.sources:
            self.end()
            self.sources, self.strip.trouble = sources, ""
            if sources.pressure and sources.stem:
                self._begin(node)

    def _begin(self, node: PolledNode) -> None:
        """Subscribe to both topics or to neither: their names come from outside."""
        topics = self.sources[:2]
        for kind, topic in zip((FluidPressure, JointState), topics, strict=True):
            try:
                made = PolledSubscription(node, kind, topic, watched(), raw=True)
            except Exception as error:  # noqa: BLE001 - rclpy's, where the name is none of a topic
                self._destroy()
                about = printable(str(error).partition("\n")[0], 200)
                self.strip.trouble = f"{printable(topic, 100)!r} cannot be subscribed to: {about}"
                return
            self.streams += (made,)

    def _destroy(self) -> None:
        for stream in self.streams:
            stream.end()
        self.streams = ()

    def end(self) -> None:
        self._destroy()
        self.sources = StreamNames()

    def take(self) -> None:
        """Pass the received samples to the strip; skip malformed messages."""
        if not self.streams:
            return
        pressures, stems = (
            readable(stream.take(), kind)
            for stream, kind in zip(self.streams, (FluidPressure, JointState), strict=True)
        )
        if pressures:
            self.strip.add(0, *pressures_in([one.message for one in pressures]))
        if stems:
            found = positions_in([one.message for one in stems], self.sources.joint)
            known = np.isfinite(found.values)
            self.strip.add(1, found.stamps[known], found.values[known])


class WatchedSignals:
    """Subscribes to the inputs of an identifier while a page shows them.

    Pages register and unregister from any thread; the thread of the node subscribes.

    Parameters
    ----------
    sources_of : callable
        Returns the topics of a valve for the name of its identifier.
    """

    def __init__(self, sources_of: Callable[[str], StreamNames]) -> None:
        self._sources_of = sources_of
        self._lock = threading.Lock()
        self._watches: dict[str, _Watch] = {}
        self._dropped: list[_Watch] = []

    def watch(self, node: str) -> LiveStrip:
        """Register a page; return the strip that receives its samples."""
        with self._lock:
            watch = self._watches.setdefault(node, _Watch(LiveStrip(_SPAN)))
            watch.lookers += 1
            return watch.strip

    def unwatch(self, node: str) -> None:
        """Unregister a page."""
        with self._lock:
            watch = self._watches.get(node)
            if watch is None:
                return
            watch.lookers -= 1
            if watch.lookers <= 0:
                self._dropped.append(self._watches.pop(node))

    def rest(self) -> None:
        """Unsubscribe from all topics until the next step; call in the thread of the node."""
        with self._lock:
            watches = [*self._watches.values()]
        for watch in watches:
            watch.end()

    def step(self, node: PolledNode) -> None:
        """Subscribe, take samples and unsubscribe; call in the thread of the node."""
        with self._lock:
            watches, dropped = dict(self._watches), self._dropped
            self._dropped = []
        for watch in dropped:
            watch.end()
        for name, watch in watches.items():
            watch.follow(node, self._sources_of(name))
            watch.take()


_MEETING = 3.0
"""Longest time until a service is discovered, s."""
_PATIENCE = 600.0
"""Longest time until an answer, s."""


class ServiceCalls:
    """Calls services for pages: a page requests in its thread, the thread of the node calls."""

    def __init__(self) -> None:
        self._asked: SimpleQueue[tuple[str, ServiceRequest, Future[Answer]]] = SimpleQueue()
        self._under_way: list[tuple[TriggerCall, Future[Answer]]] = []

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Call a service of an identifier and await its answer, in the event loop of any thread."""
        answer: Future[Answer] = Future()
        answer.set_running_or_notify_cancel()
        self._asked.put((node, request, answer))
        return await asyncio.shield(asyncio.wrap_future(answer))

    def rest(self, node: Node) -> None:
        """Abandon all pending calls when the node rests; call in the thread of the node."""
        self.step(node)
        for call, answer in self._under_way:
            answer.set_result(
                Answer(False, "the dashboard is inactive: try again when it is active")
            )
            call.close()
        self._under_way = []

    def step(self, node: Node) -> None:
        """Continue all calls; call in the thread of the node."""
        while not self._asked.empty():
            identifier, (name, values, switch), answer = self._asked.get_nowait()
            call = TriggerCall(node, identifier, name, _MEETING, _PATIENCE, values, switch)
            self._under_way.append((call, answer))
        self._under_way = [one for one in self._under_way if not _has_ended(*one)]


def _has_ended(call: TriggerCall, answer: "Future[Answer]") -> bool:
    """Continue a call; return whether it has ended, and then set its answer."""
    try:
        if not call.step():
            return False
        said = Answer(call.answer.success, call.answer.message)
    except LateError as error:
        said = Answer(False, str(error))
    except UnansweredError as error:
        said = Answer(False, printable(str(error), 400))
    answer.set_result(said)
    call.close()
    return True


_LITTLE_ENDIAN = b"\x00\x01"
_AFTER_STAMP = 12
"""First byte after the encapsulation header (4 bytes) and the stamp (8)."""
_COUNT = struct.Struct("<I")
_KEYS = tuple(_COUNT.pack(len(key.encode()) + 1) + key.encode() + b"\0" for key in ESSENTIAL_KEYS)
"""The essential keys as encoded in a message: length, text and a zero byte."""


def statuses_in(message: bytes) -> Iterator[Unread]:
    """Yield each status of a diagnostic_msgs/DiagnosticArray, still unread.

    rclpy takes 0.2 ms to deserialise the status of an identifier, a tenth of a core for 500 valves
    per second. Here only the name is read on receipt, the rest once a page shows it.

    Raises ValueError if the bytes are not such a message.
    """
    try:
        if message[:2] == _LITTLE_ENDIAN:
            yield from _quickly(message)
        else:
            for one in deserialize_message(message, DiagnosticArray).status:
                yield Unread(one.name, partial(status_of, one))
    except (struct.error, IndexError, MemoryError, RuntimeError) as error:
        raise ValueError(f"no diagnostics: {error}") from None


def status_of(message: DiagnosticStatus) -> Status:
    """Convert a status message."""
    return Status(
        message.name,
        message.level[0],
        message.hardware_id,
        message.message,
        {one.key: one.value for one in message.values},
    )


def _quickly(message: bytes) -> Iterator[Unread]:
    _, at = _text(message, _AFTER_STAMP)
    count, at = _count(message, at)
    for left in range(count - 1, -1, -1):
        name, _ = _text(message, at + 1)
        begin, at = at, _read(message, at)[1] if left else len(message)
        yield Unread(name, partial(_status_at, message, begin), partial(_mark, message, begin, at))


def _status_at(message: bytes, at: int) -> Status:
    """Read a status; raises ValueError if the bytes do not encode a status."""
    try:
        return _read(message, at)[0]
    except (struct.error, IndexError) as error:
        raise ValueError(f"no status: {error}") from None


def _mark(message: bytes, begin: int, end: int) -> tuple[object, ...]:
    """Return level, message, tag and the values of the essential keys, a tenth of all keys.

    The padding between two texts is left out, because it is arbitrary.
    """
    try:
        _, at = _text(message, begin + 1)
        words, at = _text(message, at)
        tag, at = _text(message, at)
        values = [
            _text(message, found + len(key))[0] if (found := message.find(key, at, end)) > 0 else ""
            for key in _KEYS
        ]
    except (struct.error, IndexError) as error:
        raise ValueError(f"no status: {error}") from None
    return (message[begin], words, tag, *values)


def _count(message: bytes, at: int) -> tuple[int, int]:
    at += -at % 4  # the header has four bytes, so it does not shift the alignment
    return _COUNT.unpack_from(message, at)[0], at + 4


def _text(message: bytes, at: int) -> tuple[str, int]:
    size, at = _count(message, at)
    end = at + size
    if end > len(message):
        raise IndexError("the message ends before its text")
    return message[at : max(at, end - 1)].decode(errors="replace"), end


def _read(message: bytes, at: int) -> tuple[Status, int]:
    level = message[at]
    name, at = _text(message, at + 1)
    words, at = _text(message, at)
    hardware_id, at = _text(message, at)
    count, at = _count(message, at)
    values = {}
    for _ in range(count):
        key, at = _text(message, at)
        values[sys.intern(key)], at = _text(message, at)
    return Status(name, level, hardware_id, words, values), at


_PAUSE = 0.05
"""Time between two turns, s, during which messages accumulate."""
_MISSING = f"cannot start: the dashboard needs NiceGUI, which is not installed: run `{INSTALL}`"


def _options(values: Mapping[str, Any]) -> DashboardOptions:
    """Build the options from parameters; raises ValueError or OSError if they are wrong."""

    def file(name: str) -> Path | None:
        return Path(values[name]).expanduser() if values[name] else None

    return DashboardOptions(
        access=Access(
            host=values["host"],
            host_names=tuple(filter(None, map(str.strip, values["host_names"].split(",")))),
            accounts=accounts_from(file("accounts_file")),
            certificate=file("certificate_file"),
            key=file("key_file"),
            session_hours=values["session_hours"],
            session_file=file("session_file"),
        ),
        port=values["port"],
        history=server_from(values["history_url"]) or file("history_file"),
        reports=folder_of(values["report_folder"], "reports"),
        bags=folder_of(values["save_folder"], "saved"),
        alarms=folder_of(values["alarm_folder"], "alarms"),
        time_zone=values["time_zone"],
        silence=values["silence"],
    )


class Dashboard(ManagedNode):
    """Stores the diagnostics of the valves, and calls services for the pages.

    The executable `dashboard` also serves the pages. Raises ValueError or OSError for wrong
    parameters.

    Parameters
    ----------
    **named
        Arguments of `rclpy.node.Node`, such as `parameter_overrides`.
    """

    def __init__(self, **named: Any) -> None:
        super().__init__("dashboard", **named)
        with self.removed_if_refused():
            declare_parameters(self, NODES["dashboard"])
            self.options = _options(values_of(self, NODES["dashboard"]))
        self.plant = Plant(self.options.silence)
        self.calls = ServiceCalls()
        self.signals = WatchedSignals(self._sources_of)
        self._begun = time.monotonic()
        self.begin()

    def configure(self) -> None:
        """Subscribe to the diagnostics."""
        self._diagnostics = PolledSubscription(
            self, DiagnosticArray, "/diagnostics", statuses(), raw=True
        )
        self.opened.callback(self.calls.rest, self)
        self.opened.callback(self.signals.rest)

    def _sources_of(self, identifier: str) -> StreamNames:
        heard = self.plant.valve(identifier, time.monotonic())
        return StreamNames() if heard is None else heard.view.sources

    def may_be_heard(self, identifier: str) -> bool:
        """Return whether an identifier is heard, or this node has only just begun to listen."""
        now = time.monotonic()
        heard = self.plant.valve(identifier, now)
        is_heard = heard is not None and not heard.is_silent
        return is_heard or now < self._begun + self.options.silence

    def poll(self) -> None:
        """Process the diagnostics received and the requests of the pages."""
        now = time.monotonic()
        heard = self._diagnostics.take()
        if not self.is_active:
            return
        for taken in heard:
            with contextlib.suppress(ValueError):  # anyone can publish other bytes
                for status in statuses_in(taken.message):
                    self.plant.hear(status, now)
        self.calls.step(self)
        self.signals.step(self)


class _Turning(Companion):
    """Runs the turns of the node in a thread."""

    def __init__(self, node: Dashboard) -> None:
        super().__init__("graph")
        self._node = node
        self._executor = TurnExecutor()
        self._executor.add_node(node)

    def run(self) -> None:
        while not self.has_ended.wait(_PAUSE) and rclpy.ok():
            self._executor.turn()
            self._node.poll_guarded()

    def end(self) -> None:
        self.thread.join(1.0)
        self._executor.shutdown(0.1)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node and its web server until Ctrl-C or SIGTERM; return the exit code."""
    keep_little_memory()
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = Dashboard()
    except (*WRONG_REQUESTS, OSError) as error:
        rclpy.try_shutdown()
        return cannot_start(error)
    with contextlib.ExitStack() as limited:
        try:
            with _Turning(node):  # discovers the valves while the web library is imported
                return _serve(node, limited)
        finally:
            node.destroy_node()
            rclpy.try_shutdown()


def _serve(node: Dashboard, limited: contextlib.ExitStack) -> int:
    """Serve the pages of a node; return the exit code.

    Once the server runs, Ctrl-C limits the time of everything in `limited`.
    """
    # Optional libraries that engineio, httpx and uvicorn, imported below, do not need: 8 MB.
    for unused in ("aiohttp", "tornado", "requests", "httpx._main", "watchfiles"):
        sys.modules.setdefault(unused, None)  # type: ignore[arg-type]
    try:
        from valve_friction_ros.dashboard.pages import server  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name and error.name.startswith("valve_friction_ros."):
            raise
        print(_MISSING, file=sys.stderr)  # noqa: T201
        return 2
    options, log = node.options, node.get_logger().info
    stop = limited.enter_context(StopRequest())
    try:
        server.require_free(options.access.host, options.port)
        visitors = server.guarded(options.access, log)
    except (*WRONG_REQUESTS, OSError) as error:
        stop.is_followed = True
        return cannot_start(error)
    history = HistoryCache(options.history, node.may_be_heard)
    context = DashboardContext(
        options, node.plant, history, visitors, log, node.calls.call, node.signals
    )

    def tell() -> None:
        if options.access.warning:
            node.get_logger().warning(options.access.warning)
        log(f"ready: open {options.address}")

    if not stop.has_come:
        server.serve(context, tell, log, lambda: node.is_active)
    stop.is_followed = True
    return 0


if __name__ == "__main__":
    from valve_friction_ros.nodes.start import dashboard

    sys.exit(dashboard())
