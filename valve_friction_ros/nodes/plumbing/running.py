# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Starting and stopping nodes as a process, which ends also where its loop is stuck."""

import contextlib
import faulthandler
import itertools
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Empty

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor
from valve_friction_ros.nodes.plumbing.worker import Companion, workers_have_ended


def notify(state: str) -> None:
    """Send a state such as ``READY=1``; nothing happens where nobody listens."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    if address.startswith("@"):  # a name without a file
        address = "\0" + address[1:]
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.setblocking(False)
        sender.sendto(state.encode(), address)


def _watchdog_time() -> float | None:
    """Return the time without ``WATCHDOG=1`` after which systemd acts, s; None if it does not."""
    with contextlib.suppress(KeyError, ValueError):
        if int(os.environ.get("WATCHDOG_PID", os.getpid())) == os.getpid():
            return int(os.environ["WATCHDOG_USEC"]) / 1e6
    return None


LOOP_LIMIT = 10.0
"""Time, s, after which a loop that has not turned counts as stuck."""
_LOOK = 0.5
"""Time between two looks, s; they are counted, so that a process that was stopped is not stuck."""
_REPEAT = 1.0
"""Time between two messages, s."""


class _Watchdog(Companion):
    """Watches the loop of some nodes from a thread of its own, as long as the context lasts.

    systemd's watchdog is served as long as the loop turns and no node has overdue work. When the
    loop has not turned for `LOOP_LIMIT`, the stacks of all threads are written to stderr once, and
    what each node says in that case is published on ``/diagnostics`` every second, in the loop's
    stead.
    """

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        super().__init__("watchdog")
        self._nodes = nodes
        # Made in time: a loop that is stuck may hold what the making of a publisher needs.
        self._publisher: Publisher | None = None
        if any(node.stuck_status("") for node in nodes):
            self._publisher = nodes[0].create_publisher(DiagnosticArray, "/diagnostics", 10)
        within = _watchdog_time()
        self._look = _LOOK if within is None else min(_LOOK, max(within / 4, 0.05))
        self._turns = 0

    def begin(self) -> None:
        notify("READY=1")

    def end(self) -> None:
        notify("STOPPING=1")
        self.thread.join(1.0)  # it may be within the middleware, which is to be shut down

    def turned(self) -> None:
        self._turns += 1

    def run(self) -> None:
        seen, idle = -1, 0
        allowed, each = round(LOOP_LIMIT / self._look), round(_REPEAT / self._look)
        while not self.has_ended.wait(self._look):
            turns = self._turns
            idle = 0 if turns != seen else idle + 1
            seen = turns
            if not idle and all(node.overdue() is None for node in self._nodes):
                notify("WATCHDOG=1")
            if idle >= allowed and (idle - allowed) % each == 0:
                with contextlib.suppress(RuntimeError):  # the thread must live on
                    self._say(idle * self._look)
            if idle == allowed:
                faulthandler.dump_traceback()

    def _say(self, idle: float) -> None:
        problem = (
            f"stuck: the main loop of this process has not run for {idle:.0f} s, so nothing is "
            "received, identified or answered: restart it, and report the stack traces in its log"
        )
        if self._publisher is not None:
            message = DiagnosticArray(
                status=[one for node in self._nodes if (one := node.stuck_status(problem))]
            )
            message.header.stamp = self._nodes[0].get_clock().now().to_msg()
            self._publisher.publish(message)


_LOOP_END = 60.0
"""Time, s, after which a process ends whose loop has not turned. A process that was paused for
longer ends when it goes on: the timer cannot tell one from the other."""
_DUMP = 5.0
"""Time, s, in which the stacks are written."""
_ARM = 1.0
_SILENCE = 10.0
"""Time, s, without any input after which the middleware is asked whether it still works."""
_AGAIN, _RARELY = 30.0, 300.0
"""Times between two such questions, s, while the inputs are silent, and while they are not: each
question is told to all participants of the domain."""
_ANSWER = 20.0
"""Time, s, within which the middleware answers; it takes milliseconds."""


def arm(seconds: float = _LOOP_END) -> None:
    """End the process after a time, unless it is armed again or disarmed before."""
    faulthandler.dump_traceback_later(seconds, exit=True)
    signal.setitimer(signal.ITIMER_REAL, seconds + _DUMP)  # its default is the end of the process


def _disarm() -> None:
    faulthandler.cancel_dump_traceback_later()
    signal.setitimer(signal.ITIMER_REAL, 0.0)


class _Deadman:
    """Ends the process of some nodes when its loop or the middleware hangs.

    Two things freeze a node for good, and no thread of Python can help in either. The loop may hang
    in a library that holds Python's lock. And the middleware may lock itself up while clients come
    and go (eProsima/Fast-DDS issue 6502): then nothing is received, answered or discovered any
    more, and the loop turns. So a timer of C, that of ``faulthandler``, writes the stacks of all
    threads to stderr and ends the process with exit code 1, and what started it can start it again.
    Where nobody reads stderr any more, so that the stacks cannot be written, the system's alarm
    signal ends it 5 s later.
    """

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        self._nodes = nodes
        self._next = itertools.cycle(nodes)
        self._armed = self._asked = time.monotonic()

    def goes_on(self) -> None:
        now = time.monotonic()
        if now - self._armed >= _ARM:
            self._armed = now
            arm()

    def turned(self) -> None:
        """Note that the loop has turned; ask the middleware now and then."""
        self.goes_on()
        now = time.monotonic()
        heard = max((node.last_heard for node in self._nodes), default=now)
        pause = _AGAIN if now - heard >= _SILENCE else _RARELY
        if now - self._asked >= pause:
            self._asked = now
            self._end_if_the_middleware_hangs()

    def _end_if_the_middleware_hangs(self) -> None:
        """Make a publisher, which takes the lock of the discovery, and destroy it.

        A middleware that hangs never returns from this, and rclpy holds Python's lock meanwhile.
        """
        arm(_ANSWER)
        node = next(self._next)
        node.destroy_publisher(node.create_publisher(Empty, "~/alive", 1))
        arm()


_PAUSE = 0.1
_LIVELY_PAUSE = 0.02
"""Times between two turns, s: while nothing is asked, and while services are in use. For so long
messages gather, and a first request waits."""
_LIVELY_TIME = 2.0
"""Time, s, for which services count as in use after the start and after each answer."""
_LONGEST_WAIT = 0.2
"""Time, s, for which the nodes of a process work before its services are looked at again. Hundreds
of valves that move at once have work for seconds."""
_SWITCH = 5e-4
"""Time, s, after which a thread that computes lets the turns go on. Python's 5 ms are lost at each
message while an identification runs: seconds for hundreds of valves."""
_PAUSE_OF_A_NODE = 1e-3
"""Time, s, by which each node of a process lengthens the pause: ten times what its turn costs, so
that a hundred nodes without any messages take a tenth of a core."""
_CLEAN_UP = 2.7
"""Time, s, that is left to the clean-up."""
_WORKERS_PATIENCE = 2.0
"""Time, s, that the end of the process leaves to what is being written."""

_PATIENCE = 2.5
"""Time, s, from the request to the end of the process at the latest."""
_REQUESTS = (signal.SIGINT, signal.SIGTERM)


class StopRequest(Companion):
    """Whether Ctrl-C or SIGTERM has come, as long as the context lasts.

    A handler that raised could strike within rclpy's own code, and rclpy's own handler shuts the
    context down under a callback that is still publishing. So the request is only noted.

    A loop that is stuck in foreign code never runs Python's handlers. Python writes each signal
    into a socket even then, and a thread that reads there ends the process, if the context has not
    ended by itself 2.5 s later.

    Attributes
    ----------
    has_come : bool
        Whether the loop shall end.
    is_followed : bool
        Set by the loop when it has ended, and only the clean-up is left.
    """

    def __init__(self) -> None:
        super().__init__("stop")
        self.has_come = self.is_followed = False
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)

    def begin(self) -> None:
        """Take the signals."""
        for request in _REQUESTS:
            signal.signal(request, self._note)
        self._before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)

    def end(self) -> None:
        """Give the signals back."""
        signal.set_wakeup_fd(self._before)
        self._writer.close()  # ends the thread, if no request has come

    def _note(self, *_: object) -> None:
        self.has_come = True

    def run(self) -> None:
        """Wait for a request, then for the end."""
        while number := self._reader.recv(1):
            if number[0] in _REQUESTS:
                break
        if self.has_ended.wait(_PATIENCE) or not number:
            return
        if not self.is_followed:
            line = f"stuck: it did not stop within {_PATIENCE:g} s of the request, and is abandoned"
            print(line, file=sys.stderr)  # noqa: T201
            faulthandler.dump_traceback()
        os._exit(0 if self.is_followed else 1)


WRONG_REQUESTS = (NameValidationException, ParameterException, RuntimeError, ValueError)
"""What rclpy and the nodes raise where arguments, parameters or quality of service are wrong."""


def cannot_start(error: Exception) -> int:
    """Write what was wrong in one line, and return the exit code."""
    cause = " ".join(str(error).split())
    if "log directory" in cause or "logging directory" in cause:  # rcl's words
        cause += ": set ROS_LOG_DIR to a writable folder"
    print(f"cannot start: {cause}", file=sys.stderr)  # noqa: T201
    return 2


def _run(
    nodes: Sequence[PolledNode],
    executors: Sequence[TurnExecutor],
    stop: StopRequest,
    watchdog: _Watchdog,
    deadman: _Deadman,
) -> None:

    def answered(looked: float) -> float:
        """Look at the services also within a turn, where it lasts; return when that was last."""
        if time.monotonic() <= looked + _LONGEST_WAIT:
            return looked
        for executor in executors:
            executor.answer()
        return time.monotonic()

    least = _PAUSE_OF_A_NODE * len(nodes)
    lively_until = time.monotonic() + _LIVELY_TIME
    while not _is_over(stop):
        is_lively, looked = False, time.monotonic()
        for executor in executors:
            is_lively |= executor.turn()
            looked = answered(looked)
            deadman.goes_on()
        for node in nodes:
            node.poll_guarded()
            looked = answered(looked)
            # Where hundreds of nodes get little of a core, their whole turn may last long.
            watchdog.turned()
            deadman.goes_on()
            if _is_over(stop):
                return
        deadman.turned()
        now = time.monotonic()
        if is_lively:
            lively_until = now + _LIVELY_TIME
        time.sleep(max(least, _LIVELY_PAUSE if now < lively_until else _PAUSE))


def _is_over(stop: StopRequest) -> bool:
    return stop.has_come or not rclpy.ok()


def join_graph(arguments: Sequence[str] | None, context: Context | None = None) -> None:
    """Make the process a participant of the ROS graph, or one more for another context."""
    rclpy.init(args=arguments, context=context, signal_handler_options=SignalHandlerOptions.NO)


def run_nodes(create: Callable[[], Iterable[Node]], arguments: Sequence[str] | None = None) -> int:
    """Run nodes in one process until Ctrl-C, SIGTERM or shutdown; return the exit code.

    It is 0 after a clean stop, and 2 if arguments or parameters do not let the nodes start: what
    they or rclpy refuse is written to stderr in one line. The ROS arguments are those of the
    process by default.

    Where a worker is still busy at the end, the process ends here, without it. Where the loop or
    the middleware hangs for good, the process ends with exit code 1.
    """
    sys.setswitchinterval(_SWITCH)
    with StopRequest() as stop:
        try:
            exit_code = _run_until(stop, create, arguments)
        except Exception:  # noqa: BLE001 - Python's own end would wait for the workers
            traceback.print_exc()
            exit_code = 1
        have_ended = workers_have_ended(_WORKERS_PATIENCE)
    if not have_ended:
        # Python would wait for them, for a compilation or an identification of minutes.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(exit_code)
    return exit_code


def _run_until(
    stop: StopRequest, create: Callable[[], Iterable[Node]], arguments: Sequence[str] | None
) -> int:
    nodes: list[Node] = []
    executors: dict[Context, TurnExecutor] = {}
    arm()
    try:
        join_graph(arguments)
    except WRONG_REQUESTS as error:
        _disarm()
        return cannot_start(error)
    try:
        try:
            for node in create():
                nodes.append(node)  # those before a refused one are destroyed too
                arm()
                if stop.has_come:
                    return 0
        except WRONG_REQUESTS as error:
            return cannot_start(error)
        for node in nodes:
            if node.context not in executors:
                executors[node.context] = TurnExecutor(context=node.context)
            executors[node.context].add_node(node)
        polled = [node for node in nodes if isinstance(node, PolledNode)]
        with _Watchdog(polled) as watchdog:
            _run(polled, [*executors.values()], stop, watchdog, _Deadman(polled))
    except ExternalShutdownException:
        pass
    finally:
        stop.is_followed = True
        arm(_CLEAN_UP)
        _close(nodes, executors)
        _disarm()
    return 0


def _close(nodes: Sequence[Node], executors: Mapping[Context, TurnExecutor]) -> None:
    """Destroy the nodes and leave the graph.

    All write first: the middleware takes more time for hundreds of nodes than is left to the end.
    """
    for node in nodes:
        if isinstance(node, PolledNode):
            node.finish()
    # An executor that still holds the node's entities would keep them alive.
    for executor in executors.values():
        executor.shutdown()
    for node in nodes:
        node.destroy_node()
    for context in executors:
        context.try_shutdown()
    rclpy.try_shutdown()


def run_node(create: Callable[[], Node], arguments: Sequence[str] | None = None) -> int:
    """Run one node, as `run_nodes` does."""
    return run_nodes(lambda: [create()], arguments)
