# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes with a managed life cycle, if their parameter `lifecycle` is true.

States and services are those of ROS 2 (``ros2 lifecycle``) in rclpy's own implementation.
"""

import contextlib
import inspect
import types
from collections.abc import Callable, Coroutine, Generator
from typing import Any

from lifecycle_msgs.msg import Transition
from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.service import Service
from rclpy.timer import Timer

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, drop_late_answers
from valve_friction_ros.nodes.plumbing.worker import Worker, bugs_reported, done_in

_WRONG = (ParameterException, RuntimeError, ValueError, OSError)
"""Exceptions of a node that cannot be configured with its parameters."""


class ManagedNode(LifecycleNodeMixin, PolledNode):
    """A node that is active from its start, or after a requested transition.

    The constructor of a subclass declares its parameters, including `lifecycle`, and ends with
    `begin`. An *unconfigured* node has only parameters. An *inactive* node has all its topics and
    services, but takes, publishes and answers nothing. An *active* node works.

    Attributes
    ----------
    is_configured, is_active : bool
        Whether the node is configured, and whether it is active.
    opened : contextlib.ExitStack
        Resources that `configure` has opened; closed with the node or by its clean-up.
    opened_before : contextlib.ExitStack
        Resources that `await_others` has opened; closed once `configure` has opened its own.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        self.is_active = self.is_configured = False
        self.opened, self.opened_before = contextlib.ExitStack(), contextlib.ExitStack()
        self._era = object()
        PolledNode.__init__(self, *arguments, **named)

    def begin(self) -> None:
        """Configure and activate the node, unless its life cycle is managed.

        If `configure` raises an exception, the node is removed from the graph.
        """
        if self.get_parameter("lifecycle").value:
            LifecycleNodeMixin.__init__(self, callback_group=self._services_in_turns)
            for service in self.services:
                if service.srv_name.endswith("/change_state"):
                    service.callback = self._refusing(service.callback)
                    drop_late_answers(service)
            self.get_logger().info("unconfigured: waiting for its first life-cycle transition")
            return
        try:
            self._configure()
        except BaseException:
            self.destroy_node()
            raise
        self.is_active = True

    def _refusing(self, change: Callable[..., Any]) -> Callable[..., Any]:
        """Refuse a transition that the state does not have; rclpy would end the executor.

        Before a configuration, a thread waits for what it needs while the executor continues.
        """

        async def answered(request: Any, response: Any) -> Any:
            asked = request.transition
            if asked.label == "configure" or asked.id == Transition.TRANSITION_CONFIGURE:
                worker = Worker("await")
                with self.guarded("await"):
                    await self._while_configured(done_in(worker, self.await_others))
                worker.shutdown(wait=False)
            with contextlib.suppress(RuntimeError):  # RCLError, which is not public
                if not self._is_closed:
                    return change(request, response)
            response.success = False
            return response

        return self.exclusive(answered)

    def await_others(self) -> None:
        """Wait for other machines before `configure`, in a thread; only a life cycle calls this."""

    def configure(self) -> None:
        """Create all entities and resources of the node; raises ValueError for wrong parameters."""
        raise NotImplementedError

    def _configure(self) -> None:
        self._before = {id(one) for one, _ in self._entities()}
        with self.opened_before:
            self.configure()
        self.is_configured = True

    def _entities(self) -> list[tuple[Any, Callable[[Any], object]]]:
        """Return all publishers, services and so on, each with the function that destroys it."""
        return [
            (one, getattr(self, f"destroy_{kind}"))
            for kind in ("publisher", "subscription", "service", "timer", "client")
            for one in getattr(self, f"{kind}s")
        ]

    def close(self) -> None:
        """Close all resources; the end of a node in any state, and of what its callbacks await."""
        self.is_active = self.is_configured = False
        self._era = object()
        self.opened_before.close()
        self.opened.close()

    def destroy_node(self) -> None:
        """Close the node and remove it from the graph, with its state machine.

        rclpy leaves the machine, which keeps the node in the graphs of others for another 20 s.
        """
        super().destroy_node()
        if self.get_parameter("lifecycle").value:
            self._state_machine.destroy_when_not_in_use()

    def _dissolve(self) -> None:
        """Return the node to the state before its configuration."""
        self.close()
        self.answer_the_rest(one for one in self.services if id(one) not in self._before)
        for one, destroy in self._entities():
            if id(one) not in self._before and one is not self._poll_timer:
                destroy(one)

    def create_service(
        self, kind: Any, name: str, callback: Callable[..., Any], **named: Any
    ) -> Service:
        """Create a service whose work ends with the configuration that it began in.

        The caller is then told so in the `message` of the response.
        """
        if not inspect.iscoroutinefunction(callback):
            return super().create_service(kind, name, callback, **named)

        async def answered(request: Any, response: Any) -> Any:
            answer = await self._while_configured(callback(request, response))
            if answer is None:
                end = "stopped" if self._is_closed else "cleaned up or shut down"
                response.message = (
                    f"the node was {end} before {name} had finished: call it again once the node "
                    "is active"
                )
            return answer or response

        return super().create_service(kind, name, answered, **named)

    @types.coroutine
    def _while_configured(self, work: Coroutine[Any, Any, Any]) -> Generator[Any, Any, Any]:
        """Run a coroutine to its end, or to the next time that it would go on after a `close`."""
        era, told = self._era, None
        while era is self._era:
            try:
                awaited = work.send(told)
            except StopIteration as end:
                return end.value
            told = yield awaited
        work.close()
        return None

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
                    await self._while_configured(callback())

            return awaited

        def called() -> None:
            if self.is_active:
                callback()

        return called

    def poll_guarded(self) -> None:
        """Do the work that is due if the node is configured."""
        if self.is_configured:
            super().poll_guarded()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure the node; a wrong parameter leaves it unconfigured."""
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
        """Start to work."""
        self.is_active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop working, but keep all data."""
        self.is_active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything except the parameters."""
        with self._callbacks_lock, self.guarded("cleanup"):
            self._dissolve()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything except the parameters, permanently."""
        if self.is_configured:
            return self.on_cleanup(state)
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Return to unconfigured after a bug in a transition, which has been logged."""
        return self.on_cleanup(state)
