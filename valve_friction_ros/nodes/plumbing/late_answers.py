"""Services that answer when their work is done, while the executor goes on."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.service import Service
from rclpy.task import Future

__all__ = ["create_service_with_late_answers"]


def create_service_with_late_answers(
    node: Node, kind: type, name: str, callback: Callable[[Any, Any], Any]
) -> Service:
    """Create a service whose callback may return a future of its response.

    The default executor can await a coroutine here, the events executor cannot; but both hand what
    the callback returns, with the request's header, to the service's ``send_response``. So that is
    where a future is waited for.

    Parameters
    ----------
    node : Node
        The node that offers it.
    kind : type
        Type of the service.
    name : str
        Its name.
    callback : callable
        Called with request and empty response; returns a response, or a future that the executor's
        thread completes with one.
    """
    service = node.create_service(kind, name, callback)
    send = service.send_response

    def send_when_done(response: Any, header: Any) -> None:
        if isinstance(response, Future):
            response.add_done_callback(lambda done: send(done.result(), header))
        else:
            send(response, header)

    service.send_response = send_when_done
    return service
