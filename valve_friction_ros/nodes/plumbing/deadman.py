# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The end of a process that can never work again, though it looks alive.

Two things freeze a node for good, and no thread of Python can help in either. The loop may hang in
a library that holds Python's lock. And the middleware may lock itself up while clients come and go
(eProsima/Fast-DDS issue 6502): then nothing is received, answered or discovered any more, and the
loop turns. So a timer of C, that of ``faulthandler``, writes the stacks of all threads to stderr
and ends the process with exit code 1, and what started it can start it again. Where nobody reads
stderr any more, so that the stacks cannot be written, the system's alarm signal ends it 5 s later.
"""

import faulthandler
import itertools
import signal
import time
from collections.abc import Sequence

from std_msgs.msg import Empty

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode

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


def disarm() -> None:
    """Let the process live."""
    faulthandler.cancel_dump_traceback_later()
    signal.setitimer(signal.ITIMER_REAL, 0.0)


class Deadman:
    """Ends the process of some nodes when its loop or the middleware hangs."""

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        self._nodes = nodes
        self._next = itertools.cycle(nodes)
        self._armed = self._asked = time.monotonic()

    def goes_on(self) -> None:
        """Note that the loop has done something."""
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
