# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""``~/save`` and ``~/report``: the buffer as a bag, and a page on the last result."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.history import HistoryError
from valve_friction_ros.identification import STATED, RefusalError
from valve_friction_ros.model import Valve
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.response_watch import ResponseWatch
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.plumbing.output_folder import OutputFolder, free_path
from valve_friction_ros.nodes.plumbing.processes import give_back_memory, imported
from valve_friction_ros.records.bags.topics import StreamNames, bag_libraries
from valve_friction_ros.settings import IDENTIFICATION
from valve_friction_ros.streams import Snapshot, utc


def bag_writer(
    node: Node, valve: Valve, names: StreamNames
) -> Callable[[Path, str, Snapshot, Path | None], Path]:
    """Return a function that writes a snapshot as a named bag into a folder, in any thread.

    Its last argument is the bag to replace, if any. It returns the path of the bag. It raises
    RefusalError if the libraries for bags are missing or the snapshot is empty, and OSError.
    """
    names_of = (*(one.name for one in IDENTIFICATION), *STATED)
    described = {name: node.get_parameter(name).value for name in names_of}
    described = {name: value for name, value in described.items() if value is not None}

    def write(folder: Path, name: str, snapshot: Snapshot, replaced: Path | None) -> Path:
        # Imported late, because it costs memory and time, and most nodes never save.
        try:
            with bag_libraries():
                from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415
        except ValueError as error:
            raise RefusalError(str(error)) from None

        return write_bag(folder, name, snapshot, names, valve, described, replaced)

    return write


class BagSaver:
    """Writes the buffer as bags within a limit of disk space.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor) -> None:
        self._node, self._monitor = node, monitor
        self._folder = OutputFolder(node.get_parameter("save_folder").value, "saved", "a bag")

    async def saved(self, names: StreamNames, worker: ThreadPoolExecutor) -> Path:
        """Write the present buffer in a thread of `worker`; return the path of the bag.

        Raises RefusalError if it cannot be written, there is not enough space, or the libraries for
        bags are missing.
        """
        now = self._node.get_clock().now().nanoseconds
        snapshot, settings = self._monitor.input()
        write = bag_writer(self._node, settings.valve, names)
        return await self._folder.kept(
            self._node, now, worker, lambda folder, name: write(folder, name, snapshot, None)
        )


class ReportWriter:
    """Writes pages on the last result, with all further data on the valve.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(
        self,
        node: Node,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        usage: UsageWatch,
        response: ResponseWatch,
        apart: Callable[..., Any],
    ) -> None:
        self._node, self._apart = node, apart
        self._monitor, self._history = monitor, history
        self._usage, self._response = usage, response
        given = node.get_parameter("report_folder").value
        self._folder = OutputFolder(given, "reports", "a report")

    async def written(self, worker: ThreadPoolExecutor) -> Path:
        """Write a page on the last result, in a thread of `worker`; return its path.

        Raises RefusalError if there is no result, the page cannot be written, or there is not
        enough space.
        """
        write_page = self.of_now()

        def write(folder: Path, name: str) -> Path:
            path = free_path(folder, name, ".html")
            write_page(path)
            return path

        return await self._folder.kept(self._node, self._monitor.stamp or 0, worker, write)

    def of_now(self) -> Callable[[Path], None]:
        """Return a function that writes a page on the present last result to a path, in any thread.

        Raises RefusalError if there is no result. The function itself may raise OSError.
        """
        monitor, history = self._monitor, self._history
        if monitor.result is None or monitor.stamp is None:
            raise RefusalError("the valve has no result to report: identify it first")
        time, kept, notes = utc(monitor.stamp), history.baseline, list[str]()
        healthy = kept.record if kept is not None and kept.baseline == monitor.baseline else None
        if monitor.refusal is not None:
            notes.append(f"a later record was refused: {monitor.refusal}")
        if (diagnosis := monitor.diagnosis()).alarm is not None:
            notes.append(f"an alarm from an earlier record is still active: {diagnosis.message}")
        facts = {
            "name": history.valve.tag or self._node.get_name(),
            "source": f"node {self._node.get_fully_qualified_name()}, "
            f"identified {time:%Y-%m-%d %H:%M:%S} UTC",
            "dated": f"identified {time:%Y-%m-%d %H:%M} UTC",
            "result": monitor.result,
            "baseline": monitor.baseline,
            "limits": monitor.settings.limits,
            "valve_limits": monitor.settings.valve_limits,
            "known": monitor.known,
            "healthy": healthy,
            "usage": self._usage.usage(),
            "usage_limits": self._usage.limits(),
            "response": self._response.summary,
        }

        def write(path: Path) -> None:
            before, unread = None, []
            try:
                before = history.read()
            except HistoryError as error:
                unread = [f"no trend, because the history cannot be read: {error}"]
            told = facts | {"history": before, "notes": (*notes, *unread)}
            # Imported late, because its libraries cost memory, and most nodes never report.
            room = "valve_friction_ros.reports"
            self._apart(imported, room, "write_identification_report", path, told)
            give_back_memory()

        return write
