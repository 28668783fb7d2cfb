"""Starting and stopping nodes as a process."""

import signal
import sys
import time
from collections.abc import Callable, Iterable, Sequence

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor

__all__ = ["run_node", "run_nodes"]

_PAUSE = 0.1
_LIVELY_PAUSE = 0.02
"""Times between two turns, s: while nothing is asked, and while services are in use."""
_LIVELY_TIME = 2.0
"""Time, s, for which services count as in use after the start and after each answer."""
_PAUSE_OF_A_NODE = 1e-3
"""Time, s, by which each node of a process lengthens the pause: ten times what its turn costs, so
that a hundred nodes without any messages take a tenth of a core."""

_WRONG_REQUESTS = (NameValidationException, ParameterException, RuntimeError, ValueError)
"""What rclpy and the nodes raise where arguments, parameters or quality of service are wrong."""


def _cannot_start(error: Exception) -> int:
    """Write what was wrong in one line, and return the exit code."""
    print(f"cannot start: {' '.join(str(error).split())}", file=sys.stderr)  # noqa: T201
    return 2


class _StopRequest:
    """Whether Ctrl-C or SIGTERM has come.

    A handler that raised could strike within rclpy's own code, and rclpy's own handler shuts the
    context down under a callback that is still publishing. So the request is only noted.
    """

    def __init__(self) -> None:
        self.has_come = False
        for request in (signal.SIGINT, signal.SIGTERM):
            signal.signal(request, self._note)

    def _note(self, *_: object) -> None:
        self.has_come = True


def _run(nodes: Sequence[Node], executor: TurnExecutor, pause: float, stop: _StopRequest) -> None:
    """Take turns until the stop is requested."""
    polled = [node for node in nodes if isinstance(node, PolledNode)]
    least = _PAUSE_OF_A_NODE * len(nodes)
    lively_until = time.monotonic() + _LIVELY_TIME
    while rclpy.ok() and not stop.has_come:
        is_lively = executor.turn()
        for node in polled:
            node.poll()
        now = time.monotonic()
        if is_lively:
            lively_until = now + _LIVELY_TIME
        time.sleep(max(least, min(pause, _LIVELY_PAUSE) if now < lively_until else pause))


def run_nodes(
    create: Callable[[], Iterable[Node]],
    arguments: Sequence[str] | None = None,
    pause: float = _PAUSE,
) -> int:
    """Run nodes in one process until Ctrl-C, SIGTERM or shutdown; return the exit code.

    It is 0 after a clean stop, and 2 if arguments or parameters do not let the nodes start: what
    they or rclpy refuse is written to stderr in one line. The ROS arguments are those of the
    process by default. The `pause` is the time between two turns, s, while no service is in use:
    for so long messages gather, and a first request waits.
    """
    stop = _StopRequest()
    nodes: list[Node] = []
    executor = None
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except _WRONG_REQUESTS as error:
        return _cannot_start(error)
    try:
        try:
            for node in create():
                nodes.append(node)  # noqa: PERF402 - those before a refused one are destroyed too
        except _WRONG_REQUESTS as error:
            return _cannot_start(error)
        executor = TurnExecutor()
        for node in nodes:
            executor.add_node(node)
        _run(nodes, executor, pause, stop)
    except ExternalShutdownException:
        pass
    finally:
        # An executor that still holds the node's entities would keep them alive.
        if executor is not None:
            executor.shutdown()
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def run_node(
    create: Callable[[], Node], arguments: Sequence[str] | None = None, pause: float = _PAUSE
) -> int:
    """Run one node, as `run_nodes` does."""
    return run_nodes(lambda: [create()], arguments, pause)
