# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Start and stop of nodes as a process, which ends even if its loop is stuck."""

import contextlib
import faulthandler
import itertools
import math
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

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
    """Send a state such as ``READY=1`` to systemd, if it listens."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    if address.startswith("@"):  # abstract socket
        address = "\0" + address[1:]
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.setblocking(False)
        sender.sendto(state.encode(), address)


def _watchdog_time() -> float | None:
    """Return the time without ``WATCHDOG=1`` after which systemd acts, s, or None."""
    with contextlib.suppress(KeyError, ValueError):
        if int(os.environ.get("WATCHDOG_PID", os.getpid())) == os.getpid():
            return int(os.environ["WATCHDOG_USEC"]) / 1e6
    return None


LOOP_LIMIT = 10.0
"""Time without a turn, s, after which a loop is considered stuck."""
_LOOK = 0.5
"""Time between two checks, s. Time is measured in checks, so a suspended process is not stuck."""
_REPEAT = 1.0
"""Time between two messages, s."""


class _Watchdog(Companion):
    """Watches the loop of some nodes from its own thread, as long as the context lasts.

    It serves systemd's watchdog as long as the loop turns and no node has overdue work. When the
    loop has not turned for `LOOP_LIMIT`, it writes the stacks of all threads to stderr once, and
    publishes the `stuck_status` of each node on ``/diagnostics`` every second in place of the loop.
    """

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        super().__init__("watchdog")
        self._nodes = nodes
        # Created early: a stuck loop may hold locks that the creation of a publisher needs.
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
        self.thread.join(1.0)  # it may be inside the middleware, which will be shut down

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
                with contextlib.suppress(RuntimeError):  # the thread must survive
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
"""Time without a turn of the loop, s, after which the process ends. A process that was suspended
for longer ends when it resumes: the timer cannot distinguish the two."""
_DUMP = 5.0
"""Time allowed for writing the stacks, s."""
_ARM = 1.0
_SILENCE = 10.0
"""Time without any input, s, after which the middleware is tested."""
_AGAIN, _RARELY = 30.0, 300.0
"""Times between two tests, s, while the inputs are silent and while they are not: each test is
announced to all participants of the domain."""
_ANSWER = 20.0
"""Time limit for the middleware in a test, s; it usually takes milliseconds."""


def arm(seconds: float = _LOOP_END) -> None:
    """End the process after a time, unless rearmed or disarmed earlier."""
    faulthandler.dump_traceback_later(seconds, exit=True)
    signal.setitimer(signal.ITIMER_REAL, seconds + _DUMP)  # by default it ends the process


def _disarm() -> None:
    faulthandler.cancel_dump_traceback_later()
    signal.setitimer(signal.ITIMER_REAL, 0.0)


class _Deadman:
    """Ends the process of some nodes when its loop or the middleware hangs.

    Two faults freeze a node permanently, and no Python thread can help in either case. The loop may
    hang in a library that holds Python's lock. The middleware may deadlock while clients come and
    go (eProsima/Fast-DDS issue 6502): the loop still turns, but nothing is received, answered or
    discovered any more. Therefore a C timer, that of ``faulthandler``, writes the stacks of all
    threads to stderr and ends the process with exit code 1, so that its supervisor can restart it.
    If nobody reads stderr any more and the stacks cannot be written, the alarm signal of the system
    ends the process 5 s later.
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
        """Record a turn of the loop; test the middleware from time to time."""
        self.goes_on()
        now = time.monotonic()
        heard = max((node.last_heard for node in self._nodes), default=now)
        pause = _AGAIN if now - heard >= _SILENCE else _RARELY
        if now - self._asked >= pause:
            self._asked = now
            self._end_if_the_middleware_hangs()

    def _end_if_the_middleware_hangs(self) -> None:
        """Create and destroy a publisher, which takes the lock of the discovery.

        A hung middleware never returns from this call, during which rclpy holds Python's lock.
        """
        arm(_ANSWER)
        node = next(self._next)
        node.destroy_publisher(node.create_publisher(Empty, "~/alive", 1))
        arm()


_PAUSE = 0.1
_LIVELY_PAUSE = 0.02
"""Times between two turns, s: without requests, and while services are in use. During this time
messages accumulate, and a first request waits."""
_LIVELY_TIME = 2.0
"""Time, s, for which services are considered in use after the start and after each answer."""
_LONGEST_WAIT = 0.2
"""Time, s, for which the nodes of a process work before its services are checked again. Hundreds of
valves that move at once cause seconds of work."""
_SWITCH = 5e-4
"""Time, s, after which a computing thread yields to the turns. Python's default of 5 ms would be
lost at each message during an identification: seconds for hundreds of valves."""
_PAUSE_OF_A_NODE = 1e-3
"""Time, s, by which each node of a process lengthens the pause: ten times the cost of its turn, so
that a hundred nodes without messages take a tenth of a core."""
_POLL_OF_A_NODE, _LONGEST_POLL = 1e-2, 1.0
"""Time, s, by which each node of a process lengthens the time between two polls of its streams, and
the longest time between them. A poll costs 0.3 ms for one sample and 0.4 ms for a hundred."""
_CLEAN_UP = 2.7
"""Time allowed for the clean-up, s."""
_WORKERS_PATIENCE = 2.0
"""Time that the end of the process allows for files being written, s."""

_PATIENCE = 2.5
"""Longest time from the request to the end of the process, s."""
_REQUESTS = (signal.SIGINT, signal.SIGTERM)


class StopRequest(Companion):
    """Records Ctrl-C or SIGTERM, as long as the context lasts.

    A handler that raises could interrupt rclpy's own code, and rclpy's own handler shuts down the
    context under a callback that is still publishing. Therefore the request is only recorded.

    A loop that is stuck in foreign code never runs Python's handlers. Even then Python writes each
    signal to a socket. A thread that reads this socket ends the process if the context has not
    ended by itself after 2.5 s.

    Attributes
    ----------
    has_come : bool
        Whether the loop must end.
    is_followed : bool
        Set by the loop when it has ended and only the clean-up is left.
    """

    def __init__(self) -> None:
        super().__init__("stop")
        self.has_come = self.is_followed = False
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)

    def begin(self) -> None:
        """Install the signal handlers."""
        for request in _REQUESTS:
            signal.signal(request, self._note)
        self._before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)

    def end(self) -> None:
        """Restore the signal handlers."""
        signal.set_wakeup_fd(self._before)
        self._writer.close()  # ends the thread if there was no request

    def _note(self, *_: object) -> None:
        self.has_come = True

    def run(self) -> None:
        """Wait for a request, then for the end of the context."""
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
"""Exceptions of rclpy and the nodes for wrong arguments, parameters or quality of service."""


def cannot_start(error: Exception) -> int:
    """Write the problem in one line, and return the exit code."""
    cause = " ".join(str(error).split())
    if "log directory" in cause or "logging directory" in cause:  # messages of rcl
        cause += ": set ROS_LOG_DIR to a writable folder"
    print(f"cannot start: {cause}", file=sys.stderr)  # noqa: T201
    return 2


def _polls(nodes: Sequence[PolledNode]) -> Iterator[Sequence[PolledNode]]:
    """Yield the nodes whose streams are polled in a turn: all, or none until a poll is due."""
    poll_at = -math.inf
    while True:
        is_due = (now := time.monotonic()) >= poll_at
        if is_due:
            poll_at = now + min(_POLL_OF_A_NODE * len(nodes), _LONGEST_POLL)
        yield nodes if is_due else ()


def _run(
    nodes: Sequence[PolledNode],
    executors: Sequence[TurnExecutor],
    stop: StopRequest,
    watchdog: _Watchdog,
    deadman: _Deadman,
) -> None:

    def answered(looked: float) -> float:
        """Check the services during a long turn too; return the time of the last check."""
        if time.monotonic() <= looked + _LONGEST_WAIT:
            return looked
        for executor in executors:
            executor.answer()
        return time.monotonic()

    def is_over() -> bool:
        return stop.has_come or not rclpy.ok()

    least = _PAUSE_OF_A_NODE * len(nodes)
    polls, lively_until = _polls(nodes), time.monotonic() + _LIVELY_TIME
    while not is_over():
        is_lively, looked = False, time.monotonic()
        for executor in executors:
            is_lively |= executor.turn()
            looked = answered(looked)
            deadman.goes_on()
        watchdog.turned()
        for node in next(polls):
            node.poll_guarded()
            looked = answered(looked)
            # The whole turn may be long if hundreds of nodes share a slow core.
            watchdog.turned()
            deadman.goes_on()
            if is_over():
                return
        deadman.turned()
        now = time.monotonic()
        if is_lively:
            lively_until = now + _LIVELY_TIME
        time.sleep(max(least, _LIVELY_PAUSE if now < lively_until else _PAUSE))


def join_graph(arguments: Sequence[str] | None, context: Context | None = None) -> None:
    """Create a participant of the ROS graph for the process or for a further context."""
    rclpy.init(args=arguments, context=context, signal_handler_options=SignalHandlerOptions.NO)


def run_nodes(create: Callable[[], Iterable[Node]], arguments: Sequence[str] | None = None) -> int:
    """Run nodes in one process until Ctrl-C, SIGTERM or shutdown; return the exit code.

    The exit code is 0 after a clean stop. It is 2 if arguments or parameters prevent the start; the
    cause is then written to stderr in one line. The ROS arguments are by default those of the
    process.

    If a worker is still busy at the end, the process ends here without waiting for it. If the loop
    or the middleware hangs permanently, the process ends with exit code 1.
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
        # Python would wait for them, possibly for minutes of compilation or identification.
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
                nodes.append(node)  # so that nodes before a refused one are destroyed too
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

    All nodes write their data first: for hundreds of nodes the middleware takes longer than the
    time allowed for the end.
    """
    for node in nodes:
        if isinstance(node, PolledNode):
            node.finish()
    # An executor that still refers to entities of a node would keep them alive.
    for executor in executors.values():
        executor.shutdown()
    for node in nodes:
        node.destroy_node()
    for context in executors:
        context.try_shutdown()
    rclpy.try_shutdown()
