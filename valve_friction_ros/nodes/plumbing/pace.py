# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A thread that does something in time, as a sensor does."""

import threading
import time
from collections.abc import Callable

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode

_PATIENCE = 1.0
"""Time, s, that the end leaves to a step that a full queue of the middleware holds up."""


class PacedSteps:
    """Takes steps in a thread of its own, from the first call of `begin` to the end of the node.

    A loop that looks at its node every 20 ms sends what is due by then in a burst, of which a
    subscriber with an ordinary queue of 10 hears a part.

    Parameters
    ----------
    node : PolledNode
        Whose steps they are: a bug in one is logged once, and counts among its `failures`.
    name : str
        Name of the thread.
    step : callable
        Does what is due; returns the time of the next step, s of the monotonic clock.
    """

    def __init__(self, node: PolledNode, name: str, step: Callable[[], float]) -> None:
        self._node, self._name, self._step = node, name, step
        self._has_ended = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def begin(self) -> None:
        """Take steps from now on, if that has not begun."""
        if self._thread.ident is None:
            self._thread.start()

    def end(self) -> None:
        """Take no further step."""
        self._has_ended = True
        if self._thread.is_alive():
            self._thread.join(_PATIENCE)

    def _run(self) -> None:
        while not self._has_ended:
            following = time.monotonic() + _PATIENCE
            with self._node.guarded(self._name):
                following = self._step()
            # An event that is waited for costs twice as much.
            if (pause := following - time.monotonic()) > 0:
                time.sleep(pause)
