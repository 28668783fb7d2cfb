# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes that are managed by their life cycle, where their parameter `lifecycle` asks for it.

The states and services are those of ROS 2 (``ros2 lifecycle``), by rclpy's own implementation.
"""

import contextlib
import inspect
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.timer import Timer

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.worker import bugs_reported

_WRONG = (ParameterException, RuntimeError, ValueError, OSError)
"""What a node raises where its parameters do not let it be configured."""


class ManagedNode(LifecycleNodeMixin, PolledNode):
    """A node that is active from its start, or from a transition that somebody asks for.

    A subclass declares its parameters, `lifecycle` among them, in its constructor, which ends with
    `begin`. *Unconfigured*, it has parameters and nothing else; *inactive*, it has all its topics
    and services, and takes, publishes and answers nothing; *active*, it works.

    Attributes
    ----------
    is_configured, is_active : bool
        Whether it has what it works with, and whether it works.
    opened : contextlib.ExitStack
        What `configure` has opened, and is closed with the node or its clean-up.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        self.is_active = self.is_configured = False
        self.opened = contextlib.ExitStack()
        PolledNode.__init__(self, *arguments, **named)

    def begin(self) -> None:
        """Configure and activate the node, unless its life cycle is managed.

        What `configure` raises leaves the graph without the node.
        """
        if self.get_parameter("lifecycle").value:
            LifecycleNodeMixin.__init__(self, callback_group=self._services_in_turns)
            self.get_logger().info("unconfigured: waiting for its first life-cycle transition")
            return
        try:
            self._configure()
        except BaseException:
            self.destroy_node()
            raise
        self.is_active = True

    def configure(self) -> None:
        """Build what the node works with; raises ValueError where parameters are wrong."""
        raise NotImplementedError

    def _configure(self) -> None:
        self._before = {id(one) for one, _ in self._entities()}
        self.configure()
        self.is_configured = True

    def _entities(self) -> list[tuple[Any, Callable[[Any], object]]]:
        """Return all publishers, services and so on, each with what destroys it."""
        return [
            (one, destroy)
            for entities, destroy in (
                (self.publishers, self.destroy_publisher),
                (self.subscriptions, self.destroy_subscription),
                (self.services, self.destroy_service),
                (self.timers, self.destroy_timer),
                (self.clients, self.destroy_client),
            )
            for one in entities
        ]

    def close(self) -> None:
        """Close what is open; the end of a node in whatever state."""
        self.is_active = self.is_configured = False
        self.opened.close()

    def _dissolve(self) -> None:
        """Go back to what the node was before it was configured."""
        self.close()
        for one, destroy in self._entities():
            if id(one) not in self._before and one is not self._poll_timer:
                destroy(one)

    def create_timer(
        self, timer_period_sec: float, callback: Callable[..., Any], *arguments: Any, **named: Any
    ) -> Timer:
        """Create a timer that rests while the node is inactive."""
        return super().create_timer(
            timer_period_sec, self._while_active(callback), *arguments, **named
        )

    def _while_active(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        if inspect.iscoroutinefunction(callback):

            async def awaited() -> None:
                if self.is_active:
                    await callback()

            return awaited

        def called() -> None:
            if self.is_active:
                callback()

        return called

    def poll_guarded(self) -> None:
        """Do the work that is due, once the node is configured."""
        if self.is_configured:
            super().poll_guarded()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build what the node works with; a wrong parameter leaves it unconfigured."""
        with self._callbacks_lock:
            try:
                with bugs_reported(self, *_WRONG):
                    self._configure()
            except _WRONG as error:
                self._dissolve()
                cause = " ".join(str(error).split())
                self.get_logger().error(f"cannot be configured: {cause}")
                return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to work."""
        self.is_active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rest; what is known is kept."""
        self.is_active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give up all but the parameters."""
        with self._callbacks_lock, self.guarded("cleanup"):
            self._dissolve()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give up all but the parameters, for good."""
        if self.is_configured:
            return self.on_cleanup(state)
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to unconfigured after a bug in a transition, which is in the log."""
        return self.on_cleanup(state)
