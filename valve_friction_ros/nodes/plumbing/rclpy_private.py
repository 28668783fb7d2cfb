# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Uses of private parts of rclpy, all in this file.

rclpy's own executors and ``wait_for_message`` take messages and requests in this way. If a version
of rclpy no longer supports it, the nodes leave their streams and services to the executor: they
work as before but cost more.
"""

from typing import Any

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Task

CHECKED = ("7.1.6", "9.1.2")
"""Versions of rclpy with which the tests have run, of Jazzy and of Kilted."""


PROFILES = (
    "FASTDDS_DEFAULT_PROFILES_FILE"
    if hasattr(Executor, "create_future")
    else "FASTRTPS_DEFAULT_PROFILES_FILE"
)
"""Environment variable that names a profile of Fast DDS: Kilted warns about the name of Jazzy."""


def takes_directly(entity: Subscription | Service) -> bool:
    """Return whether this rclpy can take messages or requests without an executor."""
    way = "take_message" if isinstance(entity, Subscription) else "service_take_request"
    return hasattr(entity.handle, way)


def take_messages(subscription: Subscription, most: int) -> list[tuple[Any, dict[str, Any]]]:
    """Take at most `most` messages, each with its info from the middleware."""
    taken: list[tuple[Any, dict[str, Any]]] = []
    kind, raw, handle = subscription.msg_type, subscription.raw, subscription.handle
    with handle:  # prevents its destruction meanwhile
        while len(taken) < most and (found := handle.take_message(kind, raw)) is not None:
            taken.append(found)
    return taken


def take_request(service: Service) -> tuple[Any, Any] | None:
    """Take the next request with its header, or return None."""
    with service.handle:
        request, header = service.handle.service_take_request(service.srv_type.Request)
    return None if header is None else (request, header)


def tasks_of(executor: Executor | None) -> list[tuple[Task, object]]:
    """Return the tasks of an executor, each with what it runs for; none if they are hidden."""
    return [(task, entity) for task, entity, _ in getattr(executor, "_tasks", ())]


def awaits_coroutines(executor: Executor | None) -> bool:
    """Return whether an executor awaits coroutine callbacks.

    The experimental EventsExecutor of Jazzy sends the coroutine itself as the response. That of
    Kilted, whose executors create futures, awaits it.
    """
    return heeds_groups(executor) or hasattr(Executor, "create_future")


def heeds_groups(executor: Executor | None) -> bool:
    """Return whether an executor heeds callback groups, as all do but the EventsExecutor."""
    return type(executor).__name__ != "EventsExecutor"


def parameter_overrides(node: Node) -> dict[str, Parameter]:
    """Return the parameters given at the start, declared or not; empty if unknown."""
    overrides: dict[str, Parameter] = getattr(node, "_parameter_overrides", {})
    return overrides
