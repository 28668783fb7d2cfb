"""Nodes that look for their messages themselves, and the executor of their services."""

import contextlib
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import (
    ConditionReachedException,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.service import Service
from rclpy.subscription import Subscription

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported

__all__ = ["PolledNode", "TurnExecutor"]


_LONGEST_TURN = 0.5
"""Time, s, after which what is still ready waits for the next turn."""


class PolledNode(Node):
    """A node whose streams are polled by `run_nodes`, between the callbacks of its services.

    Its publishers and subscriptions watch no events of the middleware, save where they are given
    callbacks for them. rclpy watches two events of each by default, only to log that a quality of
    service or a type does not match; each would be looked at in every turn of the executor, and
    rmw_fastrtps can lock up while it takes an event.

    Attributes
    ----------
    last_heard : float
        When a message of its streams was taken last, s of the monotonic clock; at first its start.
    poll_failure : str or None
        The bug in the latest work, if there was one.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        self.last_heard = time.monotonic()
        self.poll_failure: str | None = None
        super().__init__(*arguments, **named)

    def create_publisher(self, *arguments: Any, **named: Any) -> Publisher:
        """Create a publisher as rclpy does, without its default callbacks for events."""
        named.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(*arguments, **named)

    def create_subscription(self, *arguments: Any, **named: Any) -> Subscription:
        """Create a subscription as rclpy does, without its default callbacks for events."""
        named.setdefault("event_callbacks", SubscriptionEventCallbacks(use_default_callbacks=False))
        return super().create_subscription(*arguments, **named)

    def poll(self) -> None:
        """Do the work that is due; called in every turn."""

    def poll_guarded(self) -> None:
        """Do the work that is due; a bug in it is logged, and costs no other node anything."""
        try:
            with bugs_reported(self, known=self.poll_failure):
                self.poll()
        except (InternalError, RefusalError) as error:
            self.poll_failure = str(error)
        else:
            self.poll_failure = None

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

    A look at what is ready costs about 0.1 ms for a node with twelve services. `spin_once` looks
    once for each callback, this executor once for all callbacks that are ready.
    """

    def turn(self) -> bool:
        """Run what is ready; return whether a service has a new or an unanswered request."""
        is_lively = False
        until = time.monotonic() + _LONGEST_TURN
        while True:
            asked, answered = self._look()
            is_lively |= asked
            # A service that has answered may have more requests, but the streams have their turn.
            if not answered or time.monotonic() > until:
                return is_lively

    def _look(self) -> tuple[bool, bool]:
        """Run what is ready now; return whether a service has a request, and has answered it."""
        has_run = asked = answered = False

        def is_done() -> bool:  # ends the look when all that was ready has run
            return has_run

        with contextlib.suppress(TimeoutException, ShutdownException, ConditionReachedException):
            while True:
                task, entity, _ = self.wait_for_ready_callbacks(0.0, None, is_done)
                has_run = True
                task()
                task.result()  # raises what the callback has raised
                if isinstance(entity, Service):
                    asked, answered = True, answered or task.done()
        return asked, answered
