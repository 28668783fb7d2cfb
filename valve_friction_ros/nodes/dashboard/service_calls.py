"""Calls of the identifiers' services on behalf of the pages."""

import asyncio
import time
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from valve_friction_ros.dashboard import Answer

__all__ = ["ServiceCalls"]

_MEETING = 3.0
"""Longest time until a service is met, s."""
_SETTLING = 0.3
"""Time from the discovery of a service to its call, s: a node that has not met the client yet would
answer in vain."""
_PATIENCE = 600.0
"""Longest time until an answer, s."""


class _Call:
    """A call under way, which is looked at in every turn."""

    def __init__(self, node: str, service: str, answer: "Future[Answer]") -> None:
        self.identifier, self.name, self.answer = node, f"{node}/{service}", answer
        self._client: Any = None
        self._begun = time.monotonic()
        self._met: float | None = None
        self._response: Any = None

    def step(self, node: Node) -> bool:
        """Go on; return whether the call has ended, with its answer set."""
        try:
            said = self._said(node)
        except Exception as error:  # noqa: BLE001 - rclpy's, where the name is no name of a service
            said = Answer(False, f"{self.name} cannot be called: {error}")
        if said is not None:
            self.answer.set_result(said)
            if self._client is not None:
                node.destroy_client(self._client)
        return said is not None

    def _said(self, node: Node) -> Answer | None:
        now = time.monotonic()
        if self._client is None:
            self._client = node.create_client(Trigger, self.name)
        is_there = self._client.service_is_ready()
        if self._response is None:
            return self._meet(is_there, now)
        if self._response.done():
            found = self._response.result()
            return Answer(found.success, found.message)
        if not is_there:
            return Answer(False, f"{self.identifier} has ended before it answered: look at its log")
        if now > self._begun + _PATIENCE:
            return Answer(False, f"{self.name} has not answered for {_PATIENCE:g} s: it goes on")
        return None

    def _meet(self, is_there: bool, now: float) -> Answer | None:
        """Call once the service has been there for a moment."""
        self._met = (self._met or now) if is_there else None
        if self._met is not None and now > self._met + _SETTLING:
            self._response = self._client.call_async(Trigger.Request())
        elif now > self._begun + _MEETING:
            return Answer(False, f"{self.name} is not there: start the identifier of this valve")
        return None


class ServiceCalls:
    """Calls services for pages: they ask in their thread, and the node's thread calls."""

    def __init__(self) -> None:
        self._asked: SimpleQueue[_Call] = SimpleQueue()
        self._under_way: list[_Call] = []

    async def call(self, node: str, service: str) -> Answer:
        """Call a service of an identifier and wait for its answer; any thread's event loop."""
        answer: Future[Answer] = Future()
        answer.set_running_or_notify_cancel()
        self._asked.put(_Call(node, service, answer))
        return await asyncio.shield(asyncio.wrap_future(answer))

    def step(self, node: Node) -> None:
        """Go on with all calls; in the node's thread."""
        while not self._asked.empty():
            self._under_way.append(self._asked.get_nowait())
        self._under_way = [one for one in self._under_way if not one.step(node)]
