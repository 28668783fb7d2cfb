# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A call of an identifier's service, for people without the command `ros2`."""

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from valve_friction_ros.health import Level
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.service_request import (
    LateError,
    TriggerCall,
    UnansweredError,
    set_parameters_request,
)

_TURN = 0.05
_LAST_WORD = 1.5
"""Time for the diagnosis that follows an answer, s: it is published each second."""


class ServiceAnswer(NamedTuple):
    """What a service said; `level` is that of the diagnosis, where it was asked for and came."""

    success: bool
    message: str
    level: Level | None


class Caller:
    """A client of identifiers, which waits as long as `is_wanted()` is true."""

    def __init__(self, node: Node, is_wanted: Callable[[], bool]) -> None:
        self._node = node
        self._is_wanted = is_wanted
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._levels: dict[str, Level] = {}
        self._hears_levels = False

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()

    def _wait(self, done: Callable[[], object], patience: float) -> bool:
        """Spin until `done()` is true; return whether it is, in time."""
        deadline = time.monotonic() + patience
        while not (is_done := bool(done())):
            if time.monotonic() > deadline or not self._is_wanted():
                break
            self._executor.spin_once(timeout_sec=_TURN)
        return is_done

    def identifiers(self) -> list[str]:
        """Return the names of the identifiers that are known now."""
        return sorted(
            name.removesuffix("/identify")
            for name, types in self._node.get_service_names_and_types()
            if name.endswith("/identify") and "std_srvs/srv/Trigger" in types
        )

    def find(self, valve: str, patience: float) -> str:
        """Return the name of the identifier of a valve, by its namespace or its own name.

        Raises RefusalError, which lists the identifiers there are, if it is not there.
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
            there = f"there are {known}" if known else "there is none at all: start one"
            raise RefusalError(
                f"no identifier of {wanted} was met within {patience:g} s in the ROS domain "
                f"{domain}; {there}, or set its ROS_DOMAIN_ID"
            )
        return next(iter(found()), wanted)

    def _note_levels(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = status.level[0]
            if level <= Level.ERROR:
                self._levels[status.name] = Level(level)

    def call(self, identifier: str, service: str, patience: float) -> ServiceAnswer | None:
        """Call a service and wait for its answer; None where it is not wanted any more.

        Raises RefusalError if there is no answer in time, or the identifier has ended.
        """
        wants_level = service == "identify"
        if wants_level and not self._hears_levels:
            self._hears_levels = True
            self._node.create_subscription(DiagnosticArray, "/diagnostics", self._note_levels, 100)
        one = TriggerCall(self._node, identifier, service, patience, patience)

        def has_answered() -> bool:
            if not one.is_made:
                self._levels.clear()  # of the time before
            return one.step()

        try:
            if not self._wait(has_answered, 2 * patience):  # its own patience ends before
                return None
        except LateError as error:
            raise RefusalError(f"{error}; give it longer by --timeout") from None
        except UnansweredError as error:
            raise RefusalError(str(error)) from None
        finally:
            one.close()
        status = f"{identifier}: friction"
        if wants_level:
            self._wait(lambda: status in self._levels, _LAST_WORD)
        return ServiceAnswer(one.answer.success, one.answer.message, self._levels.get(status))

    def set_parameters(self, node: str, values: Mapping[str, float], patience: float) -> None:
        """Set parameters of a node, all at once.

        Raises RefusalError if the node refuses, or does not answer in time.
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
    """Provide a client, which gives up waiting once `is_wanted()` is false.

    It looks for identifiers, so that a discovery server has to tell it of all that there is.
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
        one = Caller(node, is_wanted)
        try:
            yield one
        finally:
            one.close()
            node.destroy_node()
    finally:
        rclpy.try_shutdown()
