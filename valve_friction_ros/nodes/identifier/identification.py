"""One identification at a time, in its thread, and what becomes of its result."""

from rclpy.node import Node

from valve_friction_ros.health import (
    FrictionMonitor,
    IdentificationInput,
    RefusedRecordError,
    identify_snapshot,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.results import NumberTopics
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported, done_in
from valve_friction_ros.nodes.plumbing.worker import Worker

__all__ = ["Identification"]


class Identification:
    """Identifies what the monitor's buffer holds, and publishes the result.

    The worker gets a copy of the buffer. Its callback awaits the result, so the executor's thread
    alone touches the monitor.
    """

    def __init__(
        self, node: Node, monitor: FrictionMonitor, results: NumberTopics, worker: Worker
    ) -> None:
        self._node, self._monitor, self._results, self._worker = node, monitor, results, worker
        self._is_running = False
        self._until: int | None = None

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

        Raises RefusedRecordError if the record cannot be identified, InternalError if a bug is met;
        the monitor shows the bug until an identification succeeds. What a refused record shows of
        the valve is taken over, too.
        """
        self._is_running = True
        try:
            with bugs_reported(self._node, known=self._monitor.internal_error):
                result = await done_in(self._worker, identify_snapshot, *record)
                self._monitor.accept(result, self._node.get_clock().now().nanoseconds)
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
