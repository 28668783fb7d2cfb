"""Nodes that look for their messages themselves, and the executor of their services."""

import contextlib
import time
from collections.abc import Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import (
    ConditionReachedException,
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

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported

__all__ = ["NeverReady", "PolledNode", "TurnExecutor"]


_LONGEST_TURN = 0.5
"""Time, s, after which what is still ready waits for the next turn."""
_NO_TYPE_DESCRIPTIONS = Parameter("start_type_description_service", value=False)
"""The types are those of ROS 2, which everybody has; the service would be two endpoints more."""


class NeverReady(CallbackGroup):
    """A callback group from which no executor waits for anything."""

    def can_execute(self, entity: object) -> bool:  # noqa: ARG002 - rclpy's signature
        """Return False."""
        return False

    def beginning_execution(self, entity: object) -> bool:  # noqa: ARG002
        """Return False."""
        return False

    def ending_execution(self, entity: object) -> None:
        """Do nothing: nothing has begun."""


class _Silence:
    """In place of a publisher: nothing is published."""

    def publish(self, message: object) -> None:
        pass


class PolledNode(Node):
    """A node whose streams and services are polled by `run_nodes` and `TurnExecutor`.

    Its publishers and subscriptions watch no events of the middleware, save where they are given
    callbacks for them. rclpy watches two events of each by default, only to log that a quality of
    service or a type does not match; each would be looked at in every turn of the executor, and
    rmw_fastrtps can lock up while it takes an event.

    Attributes
    ----------
    last_heard : float
        When a message of its streams was taken last, s of the monotonic clock; at first its start.
    """

    def __init__(
        self, *arguments: Any, start_parameter_services: bool = True, **named: Any
    ) -> None:
        self.last_heard = time.monotonic()
        self._failures: dict[str, str] = {}
        self._tells_parameters = start_parameter_services
        super().__init__(
            *arguments,
            start_parameter_services=start_parameter_services,
            parameter_overrides=[_NO_TYPE_DESCRIPTIONS],
            **named,
        )

    def create_publisher(self, kind: Any, topic: str, *arguments: Any, **named: Any) -> Publisher:
        """Create a publisher as rclpy does, without its default callbacks for events.

        Nobody is told of the parameters of a node that has no services for them.
        """
        if topic == "/parameter_events" and not self._tells_parameters:
            return _Silence()
        named.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(kind, topic, *arguments, **named)

    def create_subscription(self, *arguments: Any, **named: Any) -> Subscription:
        """Create a subscription as rclpy does, without its default callbacks for events."""
        named.setdefault("event_callbacks", SubscriptionEventCallbacks(use_default_callbacks=False))
        return super().create_subscription(*arguments, **named)

    def create_service(self, *arguments: Any, **named: Any) -> Service:
        """Create a service as rclpy does, whose requests are taken by `TurnExecutor` only."""
        return super().create_service(*arguments, **(named | {"callback_group": NeverReady()}))

    def poll(self) -> None:
        """Do the work that is due; called in every turn."""

    def close(self) -> None:
        """Do what the node has to do at its end; called once, before any node is destroyed."""

    @property
    def failures(self) -> tuple[str, ...]:
        """The bugs in the latest work of the node, one line each; none once that work succeeds."""
        return tuple(dict.fromkeys(self._failures.values()))

    def failure_of(self, work: str) -> str | None:
        """Return the bug in the latest work of this name; None if there was none."""
        return self._failures.get(work)

    @contextlib.contextmanager
    def guarded(self, work: str) -> Iterator[None]:
        """Keep a bug in some work to this node: it is logged once, and the process goes on.

        `failures` has it until work of the same name succeeds.
        """
        try:
            with bugs_reported(self, known=self._failures.get(work)):
                yield
        except (InternalError, RefusalError) as error:
            self._failures[work] = str(error)
        else:
            self._failures.pop(work, None)

    def poll_guarded(self) -> None:
        """Do the work that is due."""
        with self.guarded("poll"):
            self.poll()

    def overdue(self) -> str | None:
        """Say which work in another thread has not ended within its limit; None if there is none.

        May be called in any thread.
        """
        return None

    def stuck_status(self, problem: str) -> DiagnosticStatus | None:  # noqa: ARG002
        """Return what is published in the node's stead while it is stuck; None for nothing.

        May be called in any thread.
        """
        return None


class TurnExecutor(SingleThreadedExecutor):
    """Runs what is ready and returns; it never waits in the middleware.

    A bug in a callback costs the node that it belongs to, and no other.

    A wait of rclpy costs about 10 µs for each service of its nodes, and a look whether one has a
    request 2 µs. So the services of a `PolledNode` are no part of the wait: it is for the timers.

    rclpy offers no public method that takes a request. Its own executors use
    ``Service.handle.service_take_request``, and so does this class. Checked with rclpy 7.1.6.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._answers: list[Task] = []

    def turn(self) -> bool:
        """Run what is ready; return whether a service has a new or an unanswered request."""
        is_lively = False
        until = time.monotonic() + _LONGEST_TURN
        while True:
            asked = self._take_requests()
            self._run_ready()
            self._answers = [one for one in self._answers if not one.done()]
            is_lively |= asked or bool(self._answers)
            # A service that has answered may have more requests, but the streams have their turn.
            if not asked or time.monotonic() > until:
                return is_lively

    def answer(self) -> None:
        """Answer what has been asked of services; timers wait for the next turn."""
        self._take_requests()
        for task in self._answers:
            task()

    def _take_requests(self) -> bool:
        """Begin to answer the requests that have come; return whether there are any."""
        before = len(self._answers)
        for node in self.get_nodes():
            for service in node.services:
                if isinstance(service.callback_group, NeverReady):
                    self._take_request_of(node, service)
        return len(self._answers) > before

    def _take_request_of(self, node: Node, service: Service) -> None:
        # One at a time, as rclpy runs the newest of its tasks first.
        with service.handle:  # so that nothing destroys it meanwhile
            request, header = service.handle.service_take_request(service.srv_type.Request)
        if header is not None:
            self._answers.append(self.create_task(_answer, node, service, request, header))

    def _run_ready(self) -> None:
        """Run the tasks and the timers that are ready now."""
        has_run = False

        def is_done() -> bool:  # ends the look when all that was ready has run
            return has_run

        with contextlib.suppress(TimeoutException, ShutdownException, ConditionReachedException):
            while True:
                task, entity, node = self.wait_for_ready_callbacks(0.0, None, is_done)
                has_run = True
                with _kept_to(node, f"callback {id(entity)}"):
                    task()
                    task.result()  # raises what the callback has raised


def _kept_to(node: Node | None, work: str) -> contextlib.AbstractContextManager[None]:
    """Keep a bug in the work of a node to it, if it is a `PolledNode`."""
    return node.guarded(work) if isinstance(node, PolledNode) else contextlib.nullcontext()


async def _answer(node: Node, service: Service, request: object, header: object) -> None:
    """Answer a request; one that meets a bug stays without an answer."""
    with _kept_to(node, service.srv_name):
        response = await await_or_execute(service.callback, request, service.srv_type.Response())
        service.send_response(response, header)
