# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes that poll their messages, and the executor of their services.

In `TurnExecutor`, which the executables use, a node costs little. In any executor of rclpy it
behaves the same: services work as those of other nodes, and a timer polls the streams.
"""

import contextlib
import functools
import inspect
import os
import threading
import time
import types
from collections.abc import Awaitable, Callable, Coroutine, Generator, Iterable, Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ConditionReachedException,
    Executor,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
    await_or_execute,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Task
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.plumbing.parameters import UNSET, set_each, set_together
from valve_friction_ros.nodes.plumbing.qos import REQUESTS
from valve_friction_ros.nodes.plumbing.rclpy_private import (
    awaits_coroutines,
    take_request,
    takes_directly,
    tasks_of,
)
from valve_friction_ros.nodes.plumbing.worker import InternalError, bugs_reported

_LONGEST_TURN = 0.5
"""Longest time of a turn, s; callbacks that are still ready wait for the next turn."""
_OF_PARAMETERS = {SetParameters: set_each, SetParametersAtomically: set_together}
"""Services whose requests this package answers in place of rclpy."""
_NO_TYPE_DESCRIPTIONS = Parameter("start_type_description_service", value=False)
_POLL_PERIOD = 0.05
"""Period of polling in an executor of rclpy, s."""
_ANSWER_PATIENCE, _ANSWER_PAUSE = 1.0, 1e-3
"""Time, s, that the end allows other threads of the executor to answer, and between two looks."""
_STEP_PATIENCE = 1.0
"""Time that the end allows for a step blocked by a full queue of the middleware, s."""


class NeverReady(CallbackGroup):
    """A callback group that no executor waits for."""

    def can_execute(self, entity: Any) -> bool:  # noqa: ARG002 - rclpy's signature
        """Return False."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Return whether an executor may run the callback of an entity it has waited for."""
        return self.can_execute(entity)

    def ending_execution(self, entity: Any) -> None:
        """Do nothing: other callbacks may start at any time."""


class _TakenInTurns(NeverReady):
    """The callback group of services: a `TurnExecutor` takes their requests without waiting.

    Other executors wait for them as usual. A callback lets others run while it awaits something;
    otherwise the lock of the node keeps them apart.
    """

    has_turns = False

    def can_execute(self, entity: Any) -> bool:
        return not (self.has_turns and takes_directly(entity))


class PolledNode(Node):
    """A node that polls its streams, in `run_nodes` and `TurnExecutor` or in any executor.

    Publishers and subscriptions watch events of the middleware only if they are given callbacks for
    them. By default rclpy watches two events of each, only to log that a quality of service or a
    type does not match. Every turn of the executor would check each of these, and rmw_fastrtps can
    deadlock while it takes an event.

    Callbacks exclude each other, even in an executor with several threads, except while one awaits
    something.

    Parameters
    ----------
    *arguments, **named
        Arguments of `rclpy.node.Node`.
    start_type_description_service : bool
        Whether the node has the service ``~/get_type_description``, if its parameter allows.
    """

    is_active = True
    """Whether it works; only a `ManagedNode` may be inactive."""

    def __init__(
        self,
        *arguments: Any,
        start_parameter_services: bool = True,
        start_type_description_service: bool = True,
        **named: Any,
    ) -> None:
        self.last_heard = time.monotonic()
        """Time of the last message taken from its streams, s of the monotonic clock; initially the
        start."""
        self.awaited: dict[str, str] = {}
        """Topics to which it subscribes once they have a publisher, with their types."""
        self.offered: dict[str, str] = {}
        """Topics that it publishes once they have a subscriber, with their types."""
        self._failures: dict[str, str] = {}
        self.tells_parameters = start_parameter_services
        """Whether it has services for its parameters."""
        self._services_in_turns = _TakenInTurns()
        self._callbacks_lock = threading.RLock()
        self._poll_timer: Timer | None = None
        self._is_closed = False
        if not start_type_description_service:
            overrides = named.get("parameter_overrides") or ()
            named["parameter_overrides"] = [*overrides, _NO_TYPE_DESCRIPTIONS]
        super().__init__(*arguments, start_parameter_services=start_parameter_services, **named)

    @contextlib.contextmanager
    def removed_if_refused(self) -> Iterator[None]:
        """Remove the node from the graph if its construction fails, as for a wrong parameter."""
        try:
            yield
        except BaseException:
            super().destroy_node()
            raise

    @property
    def executor(self) -> Executor | None:
        """The executor of the node, or None."""
        return Node.executor.fget(self)

    @executor.setter
    def executor(self, executor: Executor | None) -> None:
        Node.executor.fset(self, executor)
        has_turns = isinstance(executor, TurnExecutor)
        self._services_in_turns.has_turns = has_turns
        for service in self.services:  # including those made by rclpy
            service.callback_group = self._services_in_turns
        for entity in (*self.services, *self.timers):
            if (callback := getattr(entity.callback, "__wrapped__", None)) is not None:
                entity.callback = self.exclusive(callback)
        if self._poll_timer is None and executor is not None and not has_turns:
            steady = Clock(clock_type=ClockType.STEADY_TIME)  # sim time may stand still
            poll = self.exclusive(self.poll_guarded)
            self._poll_timer = Node.create_timer(self, _POLL_PERIOD, poll, clock=steady)
        elif self._poll_timer is not None and (executor is None or has_turns):
            self.destroy_timer(self._poll_timer)
            self._poll_timer = None

    def create_publisher(self, kind: Any, topic: str, *arguments: Any, **named: Any) -> Publisher:
        """Create a publisher as rclpy does, without its default callbacks for events.

        A node without services for its parameters publishes no parameter events.
        """
        if topic == "/parameter_events" and not self.tells_parameters:
            return types.SimpleNamespace(publish=lambda _: None)
        named.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(kind, topic, *arguments, **named)

    def create_subscription(self, *arguments: Any, **named: Any) -> Subscription:
        """Create a subscription as rclpy does, without its default callbacks for events."""
        named.setdefault("event_callbacks", SubscriptionEventCallbacks(use_default_callbacks=False))
        return super().create_subscription(*arguments, **named)

    def create_service(
        self, kind: Any, name: str, callback: Callable[..., Any], **named: Any
    ) -> Service:
        """Create a service as rclpy does; a `TurnExecutor` polls its requests."""
        if kind in _OF_PARAMETERS:
            callback = functools.partial(_OF_PARAMETERS[kind], self)
        named["callback_group"] = self._services_in_turns
        service = super().create_service(kind, name, self.exclusive(callback), **named)
        drop_late_answers(service)
        return service

    def answer_the_rest(self, services: Iterable[Service]) -> None:
        """Answer the requests whose work `close` has ended, before the services are destroyed."""
        ending, deadline = {*services}, time.monotonic() + _ANSWER_PATIENCE
        executor = self.executor
        if isinstance(executor, TurnExecutor):
            held = [*executor.answers.items()]
        else:
            held = tasks_of(executor)
        tasks = [task for task, service in held if service in ending]
        while tasks and time.monotonic() < deadline:
            for task in tasks:
                task()
            tasks = [task for task in tasks if not task.done()]  # another thread is just at them
            time.sleep(_ANSWER_PAUSE if tasks else 0.0)

    def create_timer(
        self, timer_period_sec: float, callback: Callable[..., Any], *arguments: Any, **named: Any
    ) -> Timer:
        """Create a timer as rclpy does, with an exclusive callback."""
        made = self.exclusive(callback)
        return super().create_timer(timer_period_sec, made, *arguments, **named)

    def set_parameters_atomically(self, changes: list[Parameter]) -> SetParametersResult:
        """Set parameters as rclpy does, but ignore those that keep their value.

        ``ros2 param load`` can thus load the output of ``ros2 param dump``, although rclpy refuses
        to set a read-only parameter.
        """
        new = [one for one in changes if not self._has(one)]
        return (
            super().set_parameters_atomically(new) if new else SetParametersResult(successful=True)
        )

    def _has(self, parameter: Parameter) -> bool:
        if not self.has_parameter(parameter.name):
            return False
        now, wanted = self.get_parameter(parameter.name).value, parameter.value
        return wanted == now or (now is None and wanted in UNSET)

    def exclusive(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback that excludes all others of this node, in any thread.

        A coroutine lets the others run while it awaits something. If the executor does not support
        coroutines, it blocks the executor and polls the streams meanwhile.
        """
        if inspect.iscoroutinefunction(callback):

            @functools.wraps(callback)
            async def step_by_step(*arguments: Any) -> Any:
                return await _stepwise(callback(*arguments), self._callbacks_lock)

            @functools.wraps(callback)
            def to_its_end(*arguments: Any) -> Any:
                steps = _stepwise(callback(*arguments), self._callbacks_lock)
                while True:
                    try:
                        steps.send(None)
                    except StopIteration as end:
                        return end.value
                    time.sleep(_POLL_PERIOD)
                    self.poll_guarded()

            return step_by_step if awaits_coroutines(self.executor) else to_its_end

        @functools.wraps(callback)
        def alone(*arguments: Any) -> Any:
            with self._callbacks_lock:
                return callback(*arguments)

        return alone

    def poll(self) -> None:
        """Do the work that is due; called every turn."""

    def close(self) -> None:
        """Finish the work of the node; called once, before the node is destroyed."""

    def finish(self) -> None:
        """Close the node if it is not yet closed."""
        if not self._is_closed:
            self._is_closed = True
            with self._callbacks_lock, self.guarded("close"):
                self.close()
            self.answer_the_rest(self.services)

    def destroy_node(self) -> None:
        """Close the node and remove it from the graph."""
        self.finish()
        super().destroy_node()

    @property
    def failures(self) -> tuple[str, ...]:
        """Bugs in the latest work of the node, one line each, until that work succeeds."""
        return tuple(dict.fromkeys(self._failures.values()))

    @contextlib.contextmanager
    def guarded(self, work: str) -> Iterator[None]:
        """Confine a bug in some work to this node: log it once, and let the process continue.

        The bug is in `failures` until work of the same name succeeds. Work that the end of rclpy
        interrupts has no bug.
        """
        try:
            with bugs_reported(self, known=self._failures.get(work)):
                try:
                    yield
                except RuntimeError:  # RCLError, which is not public
                    if self.context.ok():
                        raise
        except (InternalError, RefusalError) as error:
            self._failures[work] = str(error)
        else:
            self._failures.pop(work, None)

    def poll_guarded(self) -> None:
        """Do the work that is due."""
        with self._callbacks_lock, self.guarded("poll"):
            self.poll()

    def overdue(self) -> str | None:
        """Describe work in another thread that exceeds its time limit, or return None.

        May be called in any thread.
        """
        return None

    def stuck_status(self, problem: str) -> DiagnosticStatus | None:  # noqa: ARG002
        """Return the status to publish on behalf of the node while it is stuck, or None.

        May be called in any thread.
        """
        return None


class PacedNode(PolledNode):
    """A node that runs its steps in its own thread, from its first turn to its end.

    A loop with a turn every 20 ms would send all due messages in a burst, and a subscriber with the
    usual queue of 10 would lose some. A bug in a step is logged once and is one of the `failures`.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._has_ended = False
        self._thread = threading.Thread(target=self._take_steps, name="steps", daemon=True)

    def step(self) -> float:
        """Do the work that is due; return the time of the next step, s of the monotonic clock."""
        raise NotImplementedError

    def poll(self) -> None:
        """Start the steps on the first turn."""
        if self._thread.ident is None:
            self._thread.start()

    def close(self) -> None:
        """Stop the steps."""
        self._has_ended = True
        if self._thread.is_alive():
            self._thread.join(_STEP_PATIENCE)

    def _take_steps(self) -> None:
        while not self._has_ended and self.context.ok():
            following = time.monotonic() + _STEP_PATIENCE
            with self.guarded("step"):
                try:
                    following = self.step()
                except InvalidHandle:
                    if not self._has_ended:  # else the node was destroyed during a long step
                        raise
            # Waiting for an event costs twice as much.
            if (pause := following - time.monotonic()) > 0:
                time.sleep(pause)


@types.coroutine
def _stepwise(work: Coroutine[Any, Any, Any], lock: threading.RLock) -> Generator[Any, Any, Any]:
    """Run a coroutine under a lock that is released while it awaits something.

    While another thread has the lock, it awaits that too, so that this thread can end its task.
    """
    awaited = told = None
    while True:
        if lock.acquire(blocking=False):
            try:
                awaited = work.send(told)
            except StopIteration as end:
                return end.value
            finally:
                lock.release()
        told = yield awaited


def drop_late_answers(service: Service) -> None:
    """Drop the answers that cannot be sent: the service, rclpy or the client has ended."""
    send = service.send_response

    def send_response(response: Any, header: Any) -> None:
        with contextlib.suppress(RuntimeError):  # InvalidHandle, or RCLError, which is not public
            send(response, header)

    service.send_response = send_response  # rclpy would end its executor


class TurnExecutor(SingleThreadedExecutor):
    """Runs the callbacks that are ready and returns; it never waits in the middleware.

    A bug in a callback affects only the node of this callback.

    A wait of rclpy costs about 10 µs per service of its nodes, a check for a request only 2 µs. The
    services of a `PolledNode` are therefore excluded from the wait, which serves the timers.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.answers: dict[Task, Service] = {}
        """The tasks that answer a request, each with its service."""

    def turn(self) -> bool:
        """Run the ready callbacks; return whether a service has a new or unanswered request."""
        is_lively = False
        until = time.monotonic() + _LONGEST_TURN
        while True:
            asked = self._take_requests()
            self._run_ready()
            self.answers = {task: of for task, of in self.answers.items() if not task.done()}
            is_lively |= asked or bool(self.answers)
            # A service may have more requests after its answer, but the streams must have a turn.
            if not asked or time.monotonic() > until:
                return is_lively

    def answer(self) -> None:
        """Answer requests to services; timers wait for the next turn."""
        self._take_requests()
        for task in self.answers:
            task()

    def _take_requests(self) -> bool:
        """Start to answer the new requests; return whether there are any."""
        before = len(self.answers)
        for node in self.get_nodes():
            for service in node.services:
                is_mine = isinstance(service.callback_group, _TakenInTurns)
                # One request at a time, because rclpy runs the newest of its tasks first.
                if is_mine and takes_directly(service) and (found := take_request(service)):
                    self.answers[self.create_task(_answer, node, service, *found)] = service
        return len(self.answers) > before

    def _run_ready(self) -> None:
        has_run = False

        def is_done() -> bool:  # ends the loop when all ready callbacks have run
            return has_run

        with contextlib.suppress(TimeoutException, ShutdownException, ConditionReachedException):
            while True:
                task, entity, node = self.wait_for_ready_callbacks(0.0, None, is_done)
                has_run = True
                with _kept_to(node, f"callback {id(entity)}"):
                    task()
                    task.result()  # reraises exceptions of the callback


def _kept_to(node: Node | None, work: str) -> contextlib.AbstractContextManager[None]:
    """Confine a bug in the work of a node to this node, if it is a `PolledNode`."""
    return node.guarded(work) if isinstance(node, PolledNode) else contextlib.nullcontext()


async def _answer(node: Node, service: Service, request: object, header: object) -> None:
    """Answer a request; after a bug there is no answer."""
    with _kept_to(node, service.srv_name):
        response = await await_or_execute(service.callback, request, service.srv_type.Response())
        service.send_response(response, header)


def learns_of_all_topics() -> bool:
    """Return whether a node learns of topics that it neither publishes nor subscribes to.

    A discovery server of Fast DDS tells it of no others.
    """
    sees_all = os.environ.get("ROS_SUPER_CLIENT", "").lower() in ("true", "1")
    return sees_all or not os.environ.get("ROS_DISCOVERY_SERVER")


def lack_of_time(node: Node) -> str:
    """Return the problem of a node whose simulated time has not started, or ''."""
    clock = node.get_clock()
    if not clock.ros_time_is_active or clock.now().nanoseconds:
        return ""
    return "no time on /clock although use_sim_time is set: publish a clock, or unset use_sim_time"


def create_service(
    node: PolledNode,
    name: str,
    work: Callable[..., Awaitable[str]],
    failure: str = "",
    kind: type = Trigger,
    is_dated: bool = False,
) -> None:
    """Create a std_srvs/Trigger service, or a SetBool service whose value `work` receives.

    The coroutine `work` returns the message of a success, or raises RefusalError with the reason;
    any other exception is answered as an internal error. If `failure` is given, a refusal is logged
    after this text. Work whose result `is_dated` is refused until simulated time has started.
    """

    async def answer(request: Any, response: Any) -> Any:
        try:
            if not node.is_active:
                raise RefusalError(
                    f"{node.get_fully_qualified_name()} is inactive: activate it, for example "
                    f"with `ros2 lifecycle set {node.get_fully_qualified_name()} activate`"
                )
            if is_dated and (problem := lack_of_time(node)):
                raise RefusalError(problem)
            with bugs_reported(node):
                response.message = await (work() if kind is Trigger else work(request.data))
            response.success = True
        except (RefusalError, InternalError) as error:
            response.message = str(error)
            if failure and isinstance(error, RefusalError):
                node.get_logger().warning(f"{failure}: {error}")
        return response

    node.create_service(kind, name, answer, qos_profile=REQUESTS)
