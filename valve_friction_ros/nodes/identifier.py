"""Node `identifier`: watches one valve and identifies its friction on demand."""

import sys
from collections.abc import Sequence
from concurrent.futures import Future as ThreadFuture
from concurrent.futures import ThreadPoolExecutor

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from rclpy.task import Future
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

from valve_friction_ros.identification import UNITS, Assessment, RefusalError
from valve_friction_ros.model import compile_kernels
from valve_friction_ros.monitoring import FrictionMonitor, dead_band, identify_snapshot
from valve_friction_ros.nodes.friction_status import friction_status
from valve_friction_ros.nodes.identifier_parameters import (
    CHANGEABLE,
    FIXED_AT_START,
    monitor_settings,
)
from valve_friction_ros.nodes.inputs import InputWatch
from valve_friction_ros.nodes.messages import position_of, stamp_of, sweep_message
from valve_friction_ros.nodes.parameters import declare_parameters, reject_invalid, values_of
from valve_friction_ros.nodes.running import run_node
from valve_friction_ros.nodes.streams import LATCHED, qos_overrides, stream
from valve_friction_ros.nodes.valve_parameters import JOINT

__all__ = ["Identifier", "main"]

_DIAGNOSTIC_PERIOD = 1.0
_LOG_EVERY = 5.0
_FIGURES = (
    "dead_band",
    "coulomb_friction_ratio",
    "fit",
    "rms",
    "threshold",
    "sigma",
    "r_squared",
)


class Identifier(Node):
    """Gathers pressure and stem position, identifies them on request, publishes the verdict.

    The identification runs in a thread of its own on a copy of the buffer, while the executor
    goes on receiving; its result comes back into the executor's thread, which alone touches the
    monitor.
    """

    def __init__(self) -> None:
        super().__init__("identifier")
        declare_parameters(self, (*CHANGEABLE, *FIXED_AT_START, JOINT))
        self._monitor = FrictionMonitor(monitor_settings(values_of(self, CHANGEABLE)))
        reject_invalid(self, CHANGEABLE, monitor_settings)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._joint = self.get_parameter(JOINT.name).value
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="identify")
        self._worker.submit(compile_kernels)
        self._identifying = False
        self._create_outputs()
        self._pressure_watch = self._subscribe(
            FluidPressure, "actuator_pressure", self._on_pressure
        )
        self._stem_watch = self._subscribe(JointState, "stem_state", self._on_stem)
        # While an identification is awaited, its group is taken: the default one has to go on.
        self.create_service(
            Trigger, "~/identify", self._identify, callback_group=ReentrantCallbackGroup()
        )
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

    def _subscribe(self, message_type: type, topic: str, callback: object) -> InputWatch:
        subscription: Subscription = self.create_subscription(
            message_type, topic, callback, stream(), qos_overriding_options=qos_overrides()
        )
        package, name = message_type.__module__.split(".")[0], message_type.__name__
        return InputWatch(self, subscription, f"{package}/msg/{name}")

    def destroy_node(self) -> None:
        """Stop the worker and the clock's callback, then the node."""
        self._worker.shutdown(wait=False, cancel_futures=True)
        self._jump_handle.unregister()
        super().destroy_node()

    def _take_parameters(self, _: object) -> None:
        self._monitor.change_settings(monitor_settings(values_of(self, CHANGEABLE)))

    def _on_time_jump(self, jump: TimeJump) -> None:
        cause = f"ROS time jumped by {jump.delta.nanoseconds / 1e9:.3g} s"
        self._monitor.buffer.clear(cause)
        self.get_logger().warning(f"{cause}: the buffer was cleared")

    def _on_pressure(self, message: FluidPressure) -> None:
        self._pressure_watch.arrived()
        buffer = self._monitor.buffer
        held = len(buffer)
        problem = buffer.add_pressure(stamp_of(message.header.stamp), message.fluid_pressure)
        self._report(problem, held)

    def _on_stem(self, message: JointState) -> None:
        self._stem_watch.arrived()
        buffer = self._monitor.buffer
        held = len(buffer)
        problem = buffer.add_position(
            stamp_of(message.header.stamp), position_of(message, self._joint)
        )
        self._report(problem, held)

    def _report(self, problem: str | None, held: int) -> None:
        """Log what was wrong with a sample that came when the buffer held `held` samples."""
        if problem is None:
            return
        # Each call is throttled for itself, so bad samples do not hide that the buffer was cleared.
        if len(self._monitor.buffer) < held:
            self.get_logger().warning(problem, throttle_duration_sec=_LOG_EVERY)
        else:
            self.get_logger().warning(problem, throttle_duration_sec=_LOG_EVERY)

    async def _identify(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._identifying:
            response.message = "an identification is already running: wait for it"
            return response
        self._identifying = True
        try:
            assessment = await self._in_worker()
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
        finally:
            self._identifying = False
        self._publish_diagnostics()
        return response

    def _in_worker(self) -> Future:
        """Identify a copy of the buffer in the worker; the result arrives in the executor."""
        executor = self.executor
        result = Future(executor=executor)

        def deliver(done: "ThreadFuture[Assessment]") -> None:
            error = done.exception()
            if error is not None:
                result.set_exception(error)
            else:
                result.set_result(done.result())

        job = self._worker.submit(
            identify_snapshot, self._monitor.buffer.snapshot(), self._monitor.settings
        )
        job.add_done_callback(lambda done: executor.create_task(deliver, done))
        return result

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
        timeout = self.get_parameter("input_timeout").value
        watches = (self._pressure_watch, self._stem_watch)
        return [problem for watch in watches if (problem := watch.problem(timeout)) is not None]

    def _publish_diagnostics(self) -> None:
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
    return run_node(Identifier, arguments)


if __name__ == "__main__":
    sys.exit(main())
