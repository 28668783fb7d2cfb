"""The end of a process that can never work again, though it looks alive.

Two things freeze a node for good, and no thread of Python can help in either. The loop may hang in
a library that holds Python's lock. And the middleware may lock itself up while clients come and go
(eProsima/Fast-DDS issue 6502): then nothing is received, answered or discovered any more, and the
loop turns. So a timer of C, that of ``faulthandler``, writes the stacks of all threads to stderr
and ends the process with exit code 1, and what started it can start it again.
"""

import faulthandler
import time
from collections.abc import Sequence
from types import TracebackType

from std_msgs.msg import Empty

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode

__all__ = ["Deadman", "disarm"]

_LOOP_END = 60.0
"""Time, s, after which a process ends whose loop has not turned. A process that was paused for
longer ends when it goes on: the timer cannot tell one from the other."""
_CLEAN_UP = 2.7
"""Time, s, that is left to the clean-up."""
_ARM = 1.0
_SILENCE = 10.0
"""Time, s, without any input after which the middleware is asked whether it still works."""
_AGAIN = 30.0
"""Time between two such questions, s: each is told to all participants of the domain."""
_ANSWER = 20.0
"""Time, s, within which the middleware answers; it takes milliseconds."""


class Deadman:
    """Ends the process of some nodes when its loop or the middleware hangs.

    It is armed from the begin of the context on; after its end it ends a clean-up that hangs, until
    it is disarmed.
    """

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        self._nodes = nodes
        self._armed = self._asked = time.monotonic()

    def __enter__(self) -> "Deadman":
        faulthandler.dump_traceback_later(_LOOP_END, exit=True)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # What is cleaned up now may hang too.
        faulthandler.dump_traceback_later(_CLEAN_UP, exit=True)

    def turned(self) -> None:
        """Note that the loop has turned; where all inputs are silent, ask the middleware."""
        now = time.monotonic()
        if now - self._armed >= _ARM:
            self._armed = now
            faulthandler.dump_traceback_later(_LOOP_END, exit=True)
        heard = max((node.last_heard for node in self._nodes), default=now)
        if now - heard >= _SILENCE and now - self._asked >= _AGAIN:
            self._asked = now
            self._end_if_the_middleware_hangs()

    def _end_if_the_middleware_hangs(self) -> None:
        """Make a publisher, which takes the lock of the discovery, and destroy it.

        A middleware that hangs never returns from this, and rclpy holds Python's lock meanwhile.
        """
        faulthandler.dump_traceback_later(_ANSWER, exit=True)
        node = self._nodes[0]
        node.destroy_publisher(node.create_publisher(Empty, "~/alive", 1))
        faulthandler.dump_traceback_later(_LOOP_END, exit=True)


def disarm() -> None:
    """Let the process live, for all that is known here."""
    faulthandler.cancel_dump_traceback_later()
