"""Node `identifier`: watches one valve and identifies its friction on demand."""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future as ThreadFuture
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from valve_friction_ros.health import FrictionMonitor, identify_snapshot
from valve_friction_ros.identification import RefusalError, Result
from valve_friction_ros.model import compile_kernels
from valve_friction_ros.nodes.identifier.keeping import Job, Keeping
from valve_friction_ros.nodes.identifier.parameters import (
    CHANGEABLE,
    FIXED_AT_START,
    monitor_settings,
)
from valve_friction_ros.nodes.identifier.reporting import Reporting
from valve_friction_ros.nodes.identifier.results import ResultTopics
from valve_friction_ros.nodes.identifier.saving import saving
from valve_friction_ros.nodes.identifier.schedule import Schedule
from valve_friction_ros.nodes.identifier.status import friction_status, trend_values
from valve_friction_ros.nodes.identifier.valve_inputs import ValveInputs
from valve_friction_ros.nodes.plumbing.guarded_work import guarded
from valve_friction_ros.nodes.plumbing.late_answers import create_service_with_late_answers
from valve_friction_ros.nodes.plumbing.parameters import (
    declare_parameters,
    reject_invalid,
    values_of,
)
from valve_friction_ros.nodes.plumbing.running import run_nodes
from valve_friction_ros.nodes.plumbing.valve_parameters import JOINT
from valve_friction_ros.streams import Arrivals

__all__ = ["PAUSE", "Identifier", "identification_worker", "main"]

_DIAGNOSTIC_PERIOD = 1.0
_LOG_EVERY = 5.0
PAUSE = 0.05
"""Time, s, for which messages gather before they are taken."""


@contextlib.contextmanager
def identification_worker() -> Iterator[ThreadPoolExecutor]:
    """Provide the thread that identifies; what waits for it at the end is dropped."""
    worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="identify")
    worker.submit(compile_kernels)
    try:
        yield worker
    finally:
        worker.shutdown(wait=False, cancel_futures=True)


class Identifier(Node):
    """Gathers pressure and stem position, identifies them on request, publishes the verdict.

    The identification runs in a thread of its own on a copy of the buffer, while the executor
    goes on receiving; its result comes back into the executor's thread, which alone touches the
    monitor.

    Parameters
    ----------
    worker : ThreadPoolExecutor
        Identifies.
    namespace : str, optional
        Namespace of the valve, where it is not given by a ROS argument.
    """

    def __init__(self, worker: ThreadPoolExecutor, namespace: str | None = None) -> None:
        super().__init__("identifier", namespace=namespace)
        declare_parameters(self, (*CHANGEABLE, *FIXED_AT_START, JOINT))
        self._monitor = FrictionMonitor(monitor_settings(values_of(self, CHANGEABLE)))
        self._reporting = Reporting(self, self._monitor)
        reject_invalid(self, CHANGEABLE, monitor_settings)
        self._worker = worker
        self._results = ResultTopics(self)
        self._diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        joint = self.get_parameter(JOINT.name).value
        self._inputs = ValveInputs(self, joint, self._take_samples)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._identifying = False
        self._identified_until: int | None = None
        self._schedule = Schedule(self, self._identify_as_scheduled)
        tag = self.get_parameter("valve_tag").value or self.get_namespace().strip("/")
        self._keeping = Keeping(self, self._monitor, tag)
        self._keeping.begin()
        create_service_with_late_answers(self, Trigger, "~/identify", self._identify)
        create_service_with_late_answers(self, Trigger, "~/save", self._save)
        create_service_with_late_answers(self, Trigger, "~/report", self._report)
        create_service_with_late_answers(self, Trigger, "~/set_baseline", self._set_baseline)
        self.create_service(Trigger, "~/clear", self._clear)
        self.create_timer(_DIAGNOSTIC_PERIOD, self._publish_diagnostics)
        self._jump_handle = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._on_time_jump,
        )

    def destroy_node(self) -> None:
        """Stop the clock's callback, then the node."""
        self._jump_handle.unregister()
        super().destroy_node()

    def _take_parameters(self, _: object) -> None:
        self._inputs.flush()
        self._monitor.change_settings(monitor_settings(values_of(self, CHANGEABLE)))
        self._schedule.follow()

    def _on_time_jump(self, jump: TimeJump) -> None:
        cause = f"ROS time jumped by {jump.delta.nanoseconds / 1e9:.3g} s"
        self._inputs.flush()
        self._monitor.buffer.clear(cause)
        self.get_logger().warning(f"{cause}: the buffer was cleared")

    def _take_samples(self, arrivals: Arrivals) -> None:
        rejected, cleared = self._monitor.buffer.add_arrivals(arrivals)
        # Each call is throttled for itself, so bad samples do not hide that the buffer was cleared.
        if rejected is not None:
            self.get_logger().warning(rejected, throttle_duration_sec=_LOG_EVERY)
        if cleared is not None:
            self.get_logger().warning(cleared, throttle_duration_sec=_LOG_EVERY)

    def _identify(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> "Trigger.Response | Future":
        """Begin to identify a copy of the buffer; its result arrives in the executor's thread."""
        if self._identifying:
            response.message = "an identification is already running: wait for it"
            return response
        answer = Future()
        self._begin(lambda done, job: self._conclude(done, job, answer))
        return answer

    def _identify_as_scheduled(self) -> None:
        self._inputs.flush()
        newest = self._monitor.buffer.newest_stamp
        if self._identifying:
            self._schedule.skip("an identification was already running")
        elif newest is not None and newest == self._identified_until:
            self._schedule.stall()
        else:
            self._begin(self._conclude_scheduled)

    def _begin(self, conclude: "Callable[[ThreadFuture[Result], Job], None]") -> None:
        """Identify a copy of the buffer in the worker, then conclude in the executor's thread."""
        self._inputs.flush()
        self._identifying = True
        self._identified_until = self._monitor.buffer.newest_stamp
        job = Job(self._monitor.buffer.snapshot(), self._monitor.settings)
        self._in_worker(lambda done: conclude(done, job), identify_snapshot, *job)

    def _in_worker(
        self,
        conclude: Callable[["ThreadFuture[Any]"], None],
        work: Callable[..., Any],
        *arguments: object,
    ) -> None:
        """Do some work in the worker; `conclude` takes over in the executor's thread."""
        executor = self.executor
        submitted = self._worker.submit(guarded(work), *arguments)
        submitted.add_done_callback(lambda done: executor.create_task(conclude, done))

    def _conclude(self, done: "ThreadFuture[Result]", job: Job, answer: Future) -> None:
        """Take over what was asked for, and answer when it has been kept."""
        self._identifying = False
        response = Trigger.Response()
        try:
            self._accept(done.result(), job)
        except RefusalError as refusal:
            self._monitor.refuse(refusal)
            self.get_logger().warning(f"identification refused: {refusal}")
            response.message = str(refusal)
        else:
            response.success = True
            told = (*self._input_problems(), self._monitor.diagnosis().message)
            response.message = "; ".join(told)

        def respond() -> None:
            answer.set_result(response)
            self._publish_diagnostics()

        self._keeping.keep(job, respond)

    def _conclude_scheduled(self, done: "ThreadFuture[Result]", job: Job) -> None:
        """Take over a success; a record that cannot be identified leaves everything as it is."""
        self._identifying = False
        try:
            self._accept(done.result(), job)
        except RefusalError as refusal:
            self._schedule.skip(str(refusal))
        else:
            self._schedule.succeed()
            self._keeping.keep(job, self._publish_diagnostics)

    def _accept(self, assessment: Result, job: Job) -> None:
        now = self.get_clock().now().nanoseconds
        self._monitor.accept(assessment, now)
        self._reporting.remember(job, assessment, now)
        self._results.publish(assessment, self._monitor)

    def _save(self, _: Trigger.Request, __: Trigger.Response) -> Future:
        answer = Future()
        self._inputs.flush()
        self._in_worker(
            lambda done: answer.set_result(self._saved(done)),
            saving(self, self._monitor, self._inputs.names),
        )
        return answer

    def _saved(self, done: "ThreadFuture[Path]") -> Trigger.Response:
        try:
            return Trigger.Response(success=True, message=str(done.result()))
        except RefusalError as refusal:
            self.get_logger().warning(f"the buffer was not saved: {refusal}")
            return Trigger.Response(message=str(refusal))

    def _report(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> "Trigger.Response | Future":
        try:
            writing = self._reporting.writing()
        except RefusalError as refusal:
            response.message = str(refusal)
            return response
        answer = Future()
        self._in_worker(lambda done: answer.set_result(self._reported(done)), writing)
        return answer

    def _reported(self, done: "ThreadFuture[Path]") -> Trigger.Response:
        try:
            return Trigger.Response(success=True, message=str(done.result()))
        except RefusalError as refusal:
            self.get_logger().warning(f"no report was written: {refusal}")
            return Trigger.Response(message=str(refusal))

    def _set_baseline(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> "Trigger.Response | Future":
        try:
            baseline = self._monitor.set_baseline()
        except RefusalError as refusal:
            response.message = str(refusal)
            return response
        self._keeping.put_in_force(baseline)
        answer = Future()

        def respond() -> None:
            response.success = True
            response.message = (
                f"baseline: coulomb_friction {baseline.coulomb_friction:.6g} "
                f"± {baseline.half_width:.2g} N{self._keeping.reservation}"
            )
            answer.set_result(response)
            self._publish_diagnostics()

        self._keeping.keep_baseline(baseline, respond)
        return answer

    def _clear(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._inputs.flush()
        self._monitor.buffer.clear("on request")
        response.success = True
        response.message = "the buffer is empty; estimate and baseline are kept"
        return response

    def _input_problems(self) -> list[str]:
        return self._inputs.problems(self.get_parameter("input_timeout").value)

    def _publish_diagnostics(self) -> None:
        self._inputs.flush()
        now = self.get_clock().now()
        status = friction_status(
            self._monitor,
            f"{self.get_fully_qualified_name()}: friction",
            self._keeping.valve.tag,
            now.nanoseconds,
            self._input_problems(),
            self._keeping.problems,
            {**trend_values(self._keeping.trend), **self._schedule.values()},
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = now.to_msg()
        self._diagnostics_publisher.publish(message)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node."""
    with identification_worker() as worker:
        return run_nodes(lambda: [Identifier(worker)], arguments, pause=PAUSE)


if __name__ == "__main__":
    sys.exit(main())
