# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Calls of the identifiers' services on behalf of the pages."""

import asyncio
from concurrent.futures import Future
from queue import SimpleQueue
from typing import NamedTuple

from rclpy.node import Node

from valve_friction_ros.dashboard import Answer, ServiceRequest
from valve_friction_ros.nodes.service_request import LateError, TriggerCall, UnansweredError
from valve_friction_ros.outside_text import printable

_MEETING = 3.0
"""Longest time until a service is met, s."""
_PATIENCE = 600.0
"""Longest time until an answer, s."""


class _Asked(NamedTuple):
    """A call that a page waits for."""

    node: str
    request: ServiceRequest
    answer: "Future[Answer]"


class ServiceCalls:
    """Calls services for pages: they ask in their thread, and the node's thread calls."""

    def __init__(self) -> None:
        self._asked: SimpleQueue[_Asked] = SimpleQueue()
        self._under_way: list[tuple[TriggerCall, Future[Answer]]] = []

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Call a service of an identifier and wait for its answer; any thread's event loop."""
        answer: Future[Answer] = Future()
        answer.set_running_or_notify_cancel()
        self._asked.put(_Asked(node, request, answer))
        return await asyncio.shield(asyncio.wrap_future(answer))

    def rest(self, node: Node) -> None:
        """Give up the calls under way, as the node rests; in the node's thread."""
        self.step(node)
        for call, answer in self._under_way:
            answer.set_result(Answer(False, "the dashboard rests: ask again when it is active"))
            call.close()
        self._under_way = []

    def step(self, node: Node) -> None:
        """Go on with all calls; in the node's thread."""
        while not self._asked.empty():
            asked = self._asked.get_nowait()
            name, values, switch = asked.request
            call = TriggerCall(node, asked.node, name, _MEETING, _PATIENCE, values, switch)
            self._under_way.append((call, asked.answer))
        self._under_way = [one for one in self._under_way if not _has_ended(*one)]


def _has_ended(call: TriggerCall, answer: "Future[Answer]") -> bool:
    """Go on with a call; return whether it has ended, with its answer set."""
    try:
        if not call.step():
            return False
        said = Answer(call.answer.success, call.answer.message)
    except LateError as error:
        said = Answer(False, str(error))
    except UnansweredError as error:
        said = Answer(False, printable(str(error), 400))
    answer.set_result(said)
    call.close()
    return True
