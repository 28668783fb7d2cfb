# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Services that may take their time to answer: of std_srvs, with and without an argument."""

from collections.abc import Awaitable, Callable
from typing import Any

from std_srvs.srv import Trigger

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.qos import REQUESTS
from valve_friction_ros.nodes.plumbing.worker import InternalError, bugs_reported


def create_service(
    node: PolledNode,
    kind: type,
    name: str,
    work: Callable[[Any], Awaitable[str]],
    failure: str = "",
) -> None:
    """Create a service whose answer is `success` and `message`, as those of std_srvs are.

    The coroutine `work` is given the request. It returns the message of a success, or raises
    RefusalError with the reason; anything else that it raises is answered as an internal error. A
    refusal is logged behind the words of `failure`, if there are any.
    """

    async def answer(request: Any, response: Any) -> Any:
        try:
            if not node.is_active:
                raise RefusalError(
                    f"{node.get_fully_qualified_name()} is inactive: activate it, as by "
                    f"`ros2 lifecycle set {node.get_fully_qualified_name()} activate`"
                )
            with bugs_reported(node):
                response.message = await work(request)
            response.success = True
        except (RefusalError, InternalError) as error:
            response.message = str(error)
            if failure and isinstance(error, RefusalError):
                node.get_logger().warning(f"{failure}: {error}")
        return response

    node.create_service(kind, name, answer, qos_profile=REQUESTS)


def create_trigger_service(
    node: PolledNode,
    name: str,
    work: Callable[[], Awaitable[str]],
    failure: str = "",
) -> None:
    """Create a std_srvs/Trigger service (`create_service`)."""
    create_service(node, Trigger, name, lambda _: work(), failure)
