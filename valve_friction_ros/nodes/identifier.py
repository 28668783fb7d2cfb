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
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

from valve_friction_ros.identification import UNITS, Assessment, RefusalError
from valve_friction_ros.model import compile_kernels
from valve_friction_ros.monitoring import Arrivals, FrictionMonitor, dead_band, identify_snapshot
from valve_friction_ros.nodes.friction_status import friction_status
from valve_friction_ros.nodes.identifier_parameters import (
    CHANGEABLE,
    FIXED_AT_START,
    monitor_settings,
)
from valve_friction_ros.nodes.late_answers import create_service_with_late_answers
from valve_friction_ros.nodes.messages import sweep_message
from valve_friction_ros.nodes.parameters import declare_parameters, reject_invalid, values_of
from valve_friction_ros.nodes.running import run_nodes
from valve_friction_ros.nodes.saving import saving
from valve_friction_ros.nodes.streams import LATCHED
from valve_friction_ros.nodes.valve_inputs import ValveInputs
from valve_friction_ros.nodes.valve_parameters import JOINT

__all__ = ["PAUSE", "Identifier", "identification_worker", "main"]

_DIAGNOSTIC_PERIOD = 1.0
_LOG_EVERY = 5.0
PAUSE = 0.05
"""Time, s, for which messages gather before they are taken."""

_FIGURES = (
    "dead_band",
    "coulomb_friction_ratio",
    "fit",
    "rms",
    "threshold",
    "sigma",
    "r_squared",
)


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
        reject_invalid(self, CHANGEABLE, monitor_settings)
        self._worker = worker
        self._create_outputs()
        joint = self.get_parameter(JOINT.name).value
        self._inputs = ValveInputs(self, joint, self._take_samples)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._identifying = False
        create_service_with_late_answers(self, Trigger, "~/identify", self._identify)
        create_service_with_late_answers(self, Trigger, "~/save", self._save)
        self.create_service(Trigger, "~/set_baseline", self._set_baseline)
        self.create_service(Trigger, "~/clear", self._clear)
        self.create_timer(_DIAGNOSTIC_PERIOD, self._publish_diagnostics)
        self._jump_handle = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._on_time_jump,
        )

    def _create_outputs(self) -> None:
        self._friction_publishers = {
            name: self.create_publisher(Float64, f"~/friction/{name}", LATCHED)
            for name in (*UNITS, *_FIGURES)
        }
        self._half_width_publishers, self._published_publishers = (
            {name: self.create_publisher(Float64, f"~/{kind}/{name}", LATCHED) for name in UNITS}
            for kind in ("half_width", "published")
        )
        self._sweep_publisher = self.create_publisher(Float64MultiArray, "~/sweep", LATCHED)
        self._diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def destroy_node(self) -> None:
        """Stop the clock's callback, then the node."""
        self._jump_handle.unregister()
        super().destroy_node()

    def _take_parameters(self, _: object) -> None:
        self._inputs.flush()
        self._monitor.change_settings(monitor_settings(values_of(self, CHANGEABLE)))

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
        self._inputs.flush()
        self._identifying = True
        return self._in_worker(
            self._conclude,
            identify_snapshot,
            self._monitor.buffer.snapshot(),
            self._monitor.settings,
        )

    def _conclude(self, done: "ThreadFuture[Assessment]") -> Trigger.Response:
        """Take over a finished identification, and answer the request for it."""
        self._identifying = False
        response = Trigger.Response()
        try:
            assessment = done.result()
        except RefusalError as refusal:
            self._monitor.refuse(refusal)
            self.get_logger().warning(f"identification refused: {refusal}")
            response.message = str(refusal)
        else:
            self._monitor.accept(assessment, self.get_clock().now().nanoseconds)
            self._publish_results(assessment)
            response.success = True
            told = (*self._input_problems(), self._monitor.diagnosis().message)
            response.message = "; ".join(told)
        self._publish_diagnostics()
        return response

    def _save(self, _: Trigger.Request, __: Trigger.Response) -> Future:
        self._inputs.flush()
        return self._in_worker(self._saved, saving(self, self._monitor, self._inputs.names))

    def _saved(self, done: "ThreadFuture[Path]") -> Trigger.Response:
        try:
            return Trigger.Response(success=True, message=str(done.result()))
        except RefusalError as refusal:
            self.get_logger().warning(f"the buffer was not saved: {refusal}")
            return Trigger.Response(message=str(refusal))

    def _in_worker(
        self,
        conclude: Callable[["ThreadFuture[Any]"], Trigger.Response],
        job: Callable[..., Any],
        *arguments: object,
    ) -> Future:
        """Do a job in the worker; `conclude` makes the answer of it, in the executor's thread."""
        answer, executor = Future(), self.executor

        def deliver(done: "ThreadFuture[Any]") -> None:
            answer.set_result(conclude(done))

        submitted = self._worker.submit(job, *arguments)
        submitted.add_done_callback(lambda done: executor.create_task(deliver, done))
        return answer

    def _set_baseline(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            baseline = self._monitor.set_baseline()
        except RefusalError as refusal:
            response.message = str(refusal)
            return response
        # The parameter shows the baseline in force; its new value stands for an exact baseline,
        # so the one with its interval is taken again.
        self.set_parameters(
            [Parameter("baseline_coulomb_friction", value=baseline.coulomb_friction)]
        )
        baseline = self._monitor.set_baseline()
        response.success = True
        response.message = (
            f"baseline: coulomb_friction {baseline.coulomb_friction:.6g} "
            f"± {baseline.half_width:.2g} N"
        )
        self._publish_diagnostics()
        return response

    def _clear(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._inputs.flush()
        self._monitor.buffer.clear("on request")
        response.success = True
        response.message = "the buffer is empty; estimate and baseline are kept"
        return response

    def _publish_results(self, assessment: Assessment) -> None:
        ratio = self._monitor.diagnosis().ratio
        published = assessment.published
        unknown = float("nan")
        figures = {
            **assessment.values,
            "dead_band": dead_band(assessment, self._monitor.settings.valve),
            "coulomb_friction_ratio": unknown if ratio is None else ratio.value,
            "fit": assessment.fit,
            "rms": assessment.rms,
            "threshold": unknown if published is None else published.threshold,
            "sigma": unknown if published is None else published.sigma,
            "r_squared": unknown if published is None else published.r_squared,
        }
        for name, publisher in self._friction_publishers.items():
            publisher.publish(Float64(data=figures[name]))
        for name, publisher in self._half_width_publishers.items():
            publisher.publish(Float64(data=assessment.parameters[name].half_width))
        for name, publisher in self._published_publishers.items():
            value = unknown if published is None else published.values[name]
            publisher.publish(Float64(data=value))
        self._sweep_publisher.publish(sweep_message(assessment.sweep))

    def _input_problems(self) -> list[str]:
        return self._inputs.problems(self.get_parameter("input_timeout").value)

    def _publish_diagnostics(self) -> None:
        self._inputs.flush()
        now = self.get_clock().now()
        status = friction_status(
            self._monitor,
            f"{self.get_fully_qualified_name()}: friction",
            self.get_parameter("valve_tag").value or self.get_namespace().strip("/"),
            now.nanoseconds,
            self._input_problems(),
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
