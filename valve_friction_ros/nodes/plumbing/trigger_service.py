"""Services without arguments, which may take their time to answer."""

from collections.abc import Awaitable, Callable

from std_srvs.srv import Trigger

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.qos import REQUESTS

__all__ = ["create_trigger_service"]


def create_trigger_service(
    node: PolledNode,
    name: str,
    work: Callable[[], Awaitable[str]],
    failure: str = "",
) -> None:
    """Create a std_srvs/Trigger service.

    The coroutine `work` returns the message of a success, or raises RefusalError with the reason;
    anything else that it raises is answered as an internal error. A refusal is logged behind the
    words of `failure`, if there are any.
    """

    async def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            with bugs_reported(node):
                response.message = await work()
            response.success = True
        except (RefusalError, InternalError) as error:
            response.message = str(error)
            if failure and isinstance(error, RefusalError):
                node.get_logger().warning(f"{failure}: {error}")
        return response

    node.create_service(Trigger, name, answer, qos_profile=REQUESTS)
