"""Starting and stopping a node as a process."""

import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

__all__ = ["quick_executor", "run_node"]

_WAKE_UP_PERIOD = 0.5


def quick_executor() -> Executor:
    """Return the executor with the least work per message that this rclpy has.

    The events executor costs about a third of the default one. It cannot run service callbacks
    that wait, so a node that has one needs the default.
    """
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415 - newer than early Jazzy
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


def run_node(
    create: Callable[[], Node],
    arguments: Sequence[str] | None = None,
    create_executor: Callable[[], Executor] = SingleThreadedExecutor,
) -> int:
    """Run a node until Ctrl-C or shutdown.

    Parameters
    ----------
    create : callable
        Builds the node; what it refuses by ValueError is told in one line.
    arguments : sequence of str, optional
        ROS arguments, by default those of the process.
    create_executor : callable
        Builds the executor.

    Returns
    -------
    int
        Exit code: 0 after a clean stop, 2 if the node cannot start with its parameters.
    """
    rclpy.init(args=arguments)
    node = None
    try:
        node = create()
        executor = create_executor()
        executor.add_node(node)
        never = Future()
        # An unlimited wait is no option: the events executor would turn without a pause.
        while rclpy.ok():
            executor.spin_until_future_complete(never, _WAKE_UP_PERIOD)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (
        ValueError,
        InvalidParameterTypeException,
        InvalidParameterValueException,
        ParameterUninitializedException,
    ) as error:
        print(f"cannot start: {error}", file=sys.stderr)  # noqa: T201
        return 2
    finally:
        # Under ros2 launch Ctrl-C arrives twice; the second must not disturb the stop.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
