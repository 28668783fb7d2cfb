"""Starting and stopping nodes as a process."""

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

__all__ = ["quick_executor", "run_node", "run_nodes"]

_WAKE_UP_PERIOD = 0.2
_WRONG_REQUESTS = (NameValidationException, ParameterException, RuntimeError, ValueError)
"""What rclpy and the nodes raise where arguments, parameters or quality of service are wrong."""


def quick_executor() -> Executor:
    """Return the executor with the least work per message that this rclpy has.

    The events executor costs about a third of the default one. It cannot run service callbacks
    that wait; `create_service_with_late_answers` is for those.
    """
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415 - newer than early Jazzy
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


def _cannot_start(error: Exception) -> int:
    """Say on one line what was wrong, and return the exit code."""
    print(f"cannot start: {' '.join(str(error).split())}", file=sys.stderr)  # noqa: T201
    return 2


def _announce(stop: threading.Event, stopped: Future) -> None:
    """Wake the executor as soon as the stop is requested, busy as it may be."""
    stop.wait()
    stopped.set_result(None)


def _spin(executor: Executor, stop: threading.Event, stopped: Future, pause: float) -> None:
    """Run callbacks until the stop is requested."""
    # An unlimited wait is no option: the events executor would turn without a pause.
    wake_up_period = _WAKE_UP_PERIOD
    if pause and not isinstance(executor, SingleThreadedExecutor):
        wake_up_period = 0.0  # the events executor runs all that has gathered, then returns
    while rclpy.ok() and not stop.is_set():
        executor.spin_until_future_complete(stopped, wake_up_period)
        if not wake_up_period:
            time.sleep(pause)


def run_nodes(
    create: Callable[[], Iterable[Node]],
    arguments: Sequence[str] | None = None,
    create_executor: Callable[[], Executor] = quick_executor,
    pause: float = 0.0,
) -> int:
    """Run nodes in one process until Ctrl-C, SIGTERM or shutdown.

    Parameters
    ----------
    create : callable
        Builds the nodes; what they or rclpy refuse is told in one line.
    arguments : sequence of str, optional
        ROS arguments, by default those of the process.
    create_executor : callable
        Builds the executor.
    pause : float
        Time, s, for which the events executor lets messages gather before it runs their callbacks.
        To be woken for each message costs more than to take it.

    Returns
    -------
    int
        Exit code: 0 after a clean stop, 2 if arguments or parameters do not let it start.
    """
    # A handler that raised could strike within rclpy's own code, and rclpy's own handler shuts the
    # context down under a callback that is still publishing. So the request is only noted.
    stop = threading.Event()
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, lambda *_: stop.set())
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
        executor = create_executor()
        for node in nodes:
            executor.add_node(node)
        stopped = Future(executor=executor)
        announcer = threading.Thread(target=_announce, args=(stop, stopped), daemon=True)
        announcer.start()
        _spin(executor, stop, stopped, pause)
        if stop.is_set():
            announcer.join()
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


def run_node(create: Callable[[], Node], arguments: Sequence[str] | None = None) -> int:
    """Run one node, as `run_nodes` does."""
    return run_nodes(lambda: [create()], arguments)
