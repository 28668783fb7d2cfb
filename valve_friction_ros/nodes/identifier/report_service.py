# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""``~/report``: a page on the identifier's last result."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.history import HistoryError, ValveHistory
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.response_watch import ResponseWatch
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.plumbing.memory import give_back_memory
from valve_friction_ros.nodes.plumbing.output_folder import (
    OutputFolder,
    file_name,
    free_path,
    require_room,
    valve_name,
)
from valve_friction_ros.nodes.plumbing.processes import ThisProcess, imported
from valve_friction_ros.nodes.plumbing.worker import done_in
from valve_friction_ros.streams import utc


class ReportWriter:
    """Writes pages on the last result, with what is known of the valve beside it.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(
        self,
        node: Node,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        usage: UsageWatch,
        response: ResponseWatch,
        apart: ThisProcess,
    ) -> None:
        self._node, self._apart = node, apart
        self._monitor, self._history = monitor, history
        self._usage, self._response = usage, response
        given = node.get_parameter("report_folder").value
        self._folder = OutputFolder(given, "reports", "a report")

    async def written(self, worker: ThreadPoolExecutor) -> Path:
        """Write a page on the last result, in a thread of `worker`; return its path.

        Raises RefusalError if there is no result, or the page cannot be written or has no room.
        """
        write_page = self.of_now()
        valve, name = valve_name(self._node), file_name(self._node, self._monitor.stamp or 0)
        room = 1e6 * self._node.get_parameter("save_megabytes").value

        def write() -> Path:
            with self._folder.opened() as folder:
                require_room(folder, valve, room)
                path = free_path(folder, name, ".html")
                write_page(path)
                try:
                    require_room(folder, valve, room, is_there=True)
                except RefusalError:
                    path.unlink()
                    raise
                return path

        return await done_in(worker, write)

    def of_now(self) -> Callable[[Path], None]:
        """Return what writes the page on the last result of now to a path, in any thread.

        Raises RefusalError if there is no result; what it returns raises OSError.
        """
        monitor, history = self._monitor, self._history
        result, stamp, refusal = monitor.result, monitor.stamp, monitor.refusal
        if result is None or stamp is None:
            raise RefusalError("the valve has no result to report: identify it first")
        time = utc(stamp)
        title = history.valve.tag or self._node.get_name()
        node_name = self._node.get_fully_qualified_name()
        baseline, limits, kept = monitor.baseline, monitor.settings.limits, history.baseline
        valve_limits, known = monitor.settings.valve_limits, monitor.known
        healthy = None if kept is None or kept.baseline != baseline else kept.record
        notes = () if refusal is None else (f"a later record was refused: {refusal}",)
        if (diagnosis := monitor.diagnosis()).alarm is not None:
            notes = (*notes, f"an alarm of an earlier record stands: {diagnosis.message}")
        usage, response = self._usage.usage(), self._response.summary
        usage_limits = self._usage.limits()

        def write(path: Path) -> None:
            before, unread = _read(history)
            facts = {
                "name": title,
                "source": f"node {node_name}, identified {time:%Y-%m-%d %H:%M:%S} UTC",
                "dated": f"identified {time:%Y-%m-%d %H:%M} UTC",
                "result": result,
                "baseline": baseline,
                "limits": limits,
                "valve_limits": valve_limits,
                "known": known,
                "notes": (*notes, *unread),
                "healthy": healthy,
                "history": before,
                "usage": usage,
                "usage_limits": usage_limits,
                "response": response,
            }
            # Its libraries cost memory, and most nodes never report.
            room = "valve_friction_ros.reports"
            self._apart.done(imported, room, "write_identification_report", path, facts)
            give_back_memory()

        return write


def _read(history: HistoryWriter) -> tuple[ValveHistory | None, list[str]]:
    """Return the history, or why it cannot be read."""
    try:
        return history.read(), []
    except HistoryError as error:
        return None, [f"no trend, as the history cannot be read: {error}"]
