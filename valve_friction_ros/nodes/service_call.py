# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reliable calls of the services of an identifier, without the command `ros2`.

A node that has not yet discovered a new client answers it in vain, even if its service is ready:
DDS informs each side at its own pace, on a loaded machine a second late. An idempotent request is
therefore repeated until it is answered. Any other request is made once, after another client of the
same program has received an answer from the same node: a node discovers the clients of a program in
the order of their creation.
"""

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import SetBool, Trigger

from valve_friction_ros.health.levels import Level
from valve_friction_ros.identification.refusal import RefusalError

_AGAIN = 0.5
"""Time without an answer, s, after which an idempotent request is repeated."""
_NO_PARAMETERS = 2.0
"""Time to wait for the parameter services of a node, s. Chosen: they exist by default."""


class UnansweredError(Exception):
    """A service will not answer; the message names the service and the cause."""


class LateError(UnansweredError):
    """A service did not answer in time."""


class PatientRequest:
    """An idempotent request, repeated until it is answered.

    Parameters
    ----------
    node : Node
        The calling node; its executor must run between two steps.
    kind : type
        Type of the service.
    name : str
        Name of the service.
    request : message
        The request.
    """

    def __init__(self, node: Node, kind: type, name: str, request: Any) -> None:
        self.answer: Any = None
        self._node, self._request = node, request
        self._client: Any = node.create_client(kind, name)
        self._pending: list[Any] = []
        self._again = 0.0

    def is_met(self) -> bool:
        """Return whether the service has been discovered."""
        return bool(self._client.service_is_ready())

    def step(self) -> bool:
        """Continue the request; return whether it has been answered."""
        done = next((one for one in self._pending if one.done()), None)
        if done is not None:
            self.answer = done.result()
        elif self.is_met() and time.monotonic() > self._again:
            self._again = time.monotonic() + _AGAIN
            self._pending.append(self._client.call_async(self._request))
        return self.answer is not None

    def close(self) -> None:
        """Destroy the client."""
        self._node.destroy_client(self._client)


def set_parameters_request(node: Node, target: str, values: Mapping[str, Any]) -> PatientRequest:
    """Return a request that sets parameters of the node `target` atomically."""
    request = SetParametersAtomically.Request(
        parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
    )
    name = f"{target}/set_parameters_atomically"
    return PatientRequest(node, SetParametersAtomically, name, request)


@dataclass(eq=False)
class TriggerCall:
    """A single call of a std_srvs/Trigger or SetBool service, never repeated."""

    node: Node
    """The calling node; its executor must run between two steps."""
    identifier: str
    """Fully qualified name of the called node."""
    service: str
    """Name of its service, without the node."""
    meeting: float
    """Longest time until the service is discovered, s."""
    patience: float
    """Longest time until the answer, s."""
    values: Mapping[str, Any] | None = None
    """Parameters of the node to set atomically before the call; they apply to this call."""
    switch: bool | None = None
    """Value for a SetBool service; None: call a Trigger service."""

    def __post_init__(self) -> None:
        self.answer: Any = None
        self.future: Any = None
        """The future answer, once the service has been called."""
        self._name = f"{self.identifier}/{self.service}"
        self._begun = time.monotonic()
        self._client: Any = None
        self._greeting: PatientRequest | None = None

    def step(self) -> bool:
        """Continue the call; return whether it has been answered.

        Raises UnansweredError if no answer will come.
        """
        if self._client is None:
            self._begin()
        waited = time.monotonic() - self._begun
        is_there = self._client.service_is_ready()
        if self.future is None:
            if is_there and self._is_known(waited):
                request = Trigger.Request()
                if self.switch is not None:
                    request = SetBool.Request(data=self.switch)
                self.future = self._client.call_async(request)
            elif not is_there and waited > self.meeting:
                raise UnansweredError(
                    f"{self._name} is not available: start the identifier of this valve"
                )
        elif self.future.done():
            self.answer = self.future.result()
            return True
        elif not is_there:
            raise UnansweredError(f"{self.identifier} ended before it answered")
        if waited > self.patience:
            raise LateError(
                f"{self._name} has not answered within {self.patience:g} s; it is still running"
            )
        return False

    def _begin(self) -> None:
        """Create the client, then a second client whose answer proves that both are known."""
        try:
            kind = Trigger if self.switch is None else SetBool
            self._client = self.node.create_client(kind, self._name)
        except Exception as error:  # noqa: BLE001 - rclpy's, where the name is no name of a service
            about = str(error).partition("\n")[0]
            raise UnansweredError(f"{self._name} cannot be called: {about}") from None
        if self.values:
            self._greeting = set_parameters_request(self.node, self.identifier, self.values)
            return
        self._greeting = PatientRequest(
            self.node, GetParameters, f"{self.identifier}/get_parameters", GetParameters.Request()
        )

    def _is_known(self, waited: float) -> bool:
        """Return whether the node knows this client; True for a node without parameter services."""
        greeting = self._greeting
        if greeting is None:
            return True
        if greeting.step():
            if self.values and not greeting.answer.result.successful:
                raise UnansweredError(greeting.answer.result.reason)
            return True
        return not self.values and not greeting.is_met() and waited > _NO_PARAMETERS

    def close(self) -> None:
        """Destroy the clients; a call that was made continues in the node."""
        if self._client is not None:
            self.node.destroy_client(self._client)
        if self._greeting is not None:
            self._greeting.close()


_TURN = 0.05
_LAST_WORD = 1.5
"""Time to wait for the diagnosis after an answer, s: it is published every second."""


class ServiceAnswer(NamedTuple):
    """Answer of a service; `level` is that of the next diagnosis, if requested and received."""

    success: bool
    message: str
    level: Level | None


class Caller:
    """A client of identifiers; it waits for answers while `is_wanted()` is true."""

    def __init__(self, node: Node, executor: Executor, is_wanted: Callable[[], bool]) -> None:
        self._node, self._executor, self._is_wanted = node, executor, is_wanted
        self._levels: dict[str, Level] = {}
        self._hears_levels = False

    def _wait(self, done: Callable[[], object], patience: float) -> bool:
        """Spin until `done()` is true; return whether it became true in time."""
        deadline = time.monotonic() + patience
        while not (is_done := bool(done())):
            if time.monotonic() > deadline or not self._is_wanted():
                break
            self._executor.spin_once(timeout_sec=_TURN)
        return is_done

    def identifiers(self) -> list[str]:
        """Return the names of the identifiers known at present."""
        return sorted(
            name.removesuffix("/identify")
            for name, types in self._node.get_service_names_and_types()
            if name.endswith("/identify") and "std_srvs/srv/Trigger" in types
        )

    def find(self, valve: str, patience: float) -> str:
        """Return the name of the identifier of a valve, given its namespace or node name.

        Raises RefusalError, with a list of all identifiers, if it is not found.
        """
        wanted = f"/{valve.strip('/')}"

        def found() -> list[str]:
            return [
                name
                for name in self.identifiers()
                if wanted in (name, name.rpartition("/")[0] or "/")
            ]

        if not self._wait(found, patience) and self._is_wanted():
            known = ", ".join(
                name.removesuffix("/identifier") or "/" for name in self.identifiers()
            )
            domain = os.environ.get("ROS_DOMAIN_ID", "0")
            there = f"there are {known}" if known else "there is no identifier at all: start one"
            raise RefusalError(
                f"no identifier of {wanted} was found within {patience:g} s in the ROS domain "
                f"{domain}; {there}, or set its ROS_DOMAIN_ID"
            )
        return next(iter(found()), wanted)

    def _note_levels(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = status.level[0]
            if level <= Level.ERROR:
                self._levels[status.name] = Level(level)

    def call(self, identifier: str, service: str, patience: float) -> ServiceAnswer | None:
        """Call a service and wait for its answer; None if it is no longer wanted.

        Raises RefusalError if no answer comes in time or the identifier has ended.
        """
        wants_level = service == "identify"
        if wants_level and not self._hears_levels:
            self._hears_levels = True
            self._node.create_subscription(DiagnosticArray, "/diagnostics", self._note_levels, 100)
        one = TriggerCall(self._node, identifier, service, patience, patience)

        def has_answered() -> bool:
            if one.future is None:
                self._levels.clear()  # from before the call
            return one.step()

        try:
            if not self._wait(has_answered, 2 * patience):  # the call itself gives up earlier
                return None
        except LateError as error:
            raise RefusalError(f"{error}; allow more time with --timeout") from None
        except UnansweredError as error:
            raise RefusalError(str(error)) from None
        finally:
            one.close()
        status = f"{identifier}: friction"
        if wants_level:
            self._wait(lambda: status in self._levels, _LAST_WORD)
        return ServiceAnswer(one.answer.success, one.answer.message, self._levels.get(status))

    def set_parameters(self, node: str, values: Mapping[str, float], patience: float) -> None:
        """Set parameters of a node atomically.

        Raises RefusalError if the node refuses or does not answer in time.
        """
        one = set_parameters_request(self._node, node, values)
        try:
            if not self._wait(one.step, patience) and self._is_wanted():
                raise RefusalError(f"{node} has not answered within {patience:g} s")
        finally:
            one.close()
        if one.answer is not None and not one.answer.result.successful:
            raise RefusalError(f"{node} refused: {one.answer.result.reason}")


@contextmanager
def caller(is_wanted: Callable[[], bool]) -> Iterator[Caller]:
    """Provide a client that stops waiting once `is_wanted()` is false.

    Because it searches for identifiers, a discovery server must give it the whole graph.
    """
    if os.environ.get("ROS_DISCOVERY_SERVER"):
        os.environ.setdefault("ROS_SUPER_CLIENT", "TRUE")
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node(
            f"valve_friction_call_{os.getpid()}",
            enable_rosout=False,
            start_parameter_services=False,
        )
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        try:
            yield Caller(node, executor, is_wanted)
        finally:
            executor.shutdown()
            node.destroy_node()
    finally:
        rclpy.try_shutdown()
