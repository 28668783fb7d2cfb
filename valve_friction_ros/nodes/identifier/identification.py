# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One identification at a time, in its thread, and what becomes of its result."""

from rclpy.node import Node

from valve_friction_ros.health import (
    FrictionMonitor,
    IdentificationInput,
    RefusedRecordError,
    identify_with_numbers,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.results import NumberTopics
from valve_friction_ros.nodes.identifier.workers import Workers
from valve_friction_ros.nodes.plumbing.worker import InternalError, bugs_reported, done_in


class Identification:
    """Identifies what the monitor's buffer holds, and publishes the result.

    The worker gets a copy of the buffer. Its callback awaits the result, so the executor's thread
    alone touches the monitor.
    """

    def __init__(
        self, node: Node, monitor: FrictionMonitor, results: NumberTopics, workers: Workers
    ) -> None:
        self._node, self._monitor, self._results, self._workers = node, monitor, results, workers
        self._is_running = False
        self._until: int | None = None
        self._last_stamps: tuple[int | None, int | None] = (None, None)
        self._came = [0, 0]

    def follow(self) -> None:
        """Note when usable samples of either signal have come, by the node's clock.

        Stamps tell no age: those of a bag that is played without its clock are of another day.
        """
        now, last_stamps = (
            self._node.get_clock().now().nanoseconds,
            self._monitor.buffer.last_stamps,
        )
        for signal, (before, last) in enumerate(zip(self._last_stamps, last_stamps, strict=True)):
            if last != before:
                self._came[signal] = now
        self._last_stamps = last_stamps

    def _require_recent(self) -> None:
        """Refuse a record of which a signal has ended longer ago than it may be silent."""
        longest = max(
            self._monitor.settings.window, self._node.get_parameter("input_timeout").value
        )
        now = self._node.get_clock().now().nanoseconds
        for name, came, stamp in zip(
            ("actuator_pressure", "stem_state"), self._came, self._last_stamps, strict=True
        ):
            age = (now - came) / 1e9
            if stamp is not None and age > longest:
                raise RefusedRecordError(
                    f"the record is old: its last usable sample of {name} came {age:.0f} s ago, "
                    f"and window and input_timeout allow {longest:g} s: check the source of {name}"
                    ", or set a longer window for a sensor that reports rarely",
                    {},
                )

    @property
    def has_nothing_new(self) -> bool:
        """Whether no sample has come since the last identification."""
        newest = self._monitor.buffer.newest_stamp
        return not self._is_running and newest is not None and newest == self._until

    def record(self) -> IdentificationInput:
        """Copy the buffer, to be identified.

        Raises RefusalError if an identification is running.
        """
        if self._is_running:
            raise RefusalError("an identification is already running: wait for it")
        self._until = self._monitor.buffer.newest_stamp
        return self._monitor.input()

    async def run(self, record: IdentificationInput) -> None:
        """Identify a record in the worker; take over and publish the result.

        Raises RefusedRecordError if the record cannot be identified or is old, InternalError if a
        bug is met; the monitor shows the bug until an identification succeeds. What a refused
        record shows of the valve is taken over, too.
        """
        self._require_recent()
        self._is_running = True
        try:
            with bugs_reported(self._node, known=self._monitor.internal_error):
                workers = self._workers
                result, numbers = await done_in(
                    workers.identify,
                    workers.apart.done,
                    identify_with_numbers,
                    record.snapshot,
                    record.settings,
                )
                now = self._node.get_clock().now().nanoseconds
                self._monitor.accept(result, now, numbers)
                self._results.publish(result, self._monitor)
                message = self._monitor.diagnosis().message
                self._node.get_logger().info(f"identified: {message}")
        except RefusedRecordError as refused:
            self._monitor.learn(refused.numbers, self._node.get_clock().now().nanoseconds)
            raise
        except InternalError as error:
            self._monitor.fail(str(error))
            raise
        finally:
            self._is_running = False
