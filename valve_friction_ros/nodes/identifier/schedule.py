# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Periodic identification, and the reason of the last one that was skipped."""

from collections.abc import Awaitable, Callable

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.timer import Timer


class Schedule:
    """Calls for an identification by the node's clock, and remembers why the last was skipped.

    A skip changes neither diagnosis nor level, and it is not logged. `group` is reentrant, so that
    other callbacks run while an identification is awaited.
    """

    def __init__(
        self, node: Node, identify: Callable[[], Awaitable[None]], group: CallbackGroup
    ) -> None:
        self._node = node
        self._identify = identify
        self._group = group
        self._period = 0.0
        self._timer: Timer | None = None
        self._skip: tuple[str, int] | None = None
        self.follow()

    def follow(self) -> None:
        """Follow the parameter."""
        period = self._node.get_parameter("period").value
        if period == self._period:
            return
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None
        if period > 0:
            self._timer = self._node.create_timer(
                period, self._identify, callback_group=self._group
            )
        self._period, self._skip = period, None

    def skip(self, reason: str) -> None:
        """Remember that nothing was identified, and why.

        What began before the schedule ended may end after it, and does not count.
        """
        if self._timer is not None:
            self._skip = reason, self._node.get_clock().now().nanoseconds

    def stall(self) -> None:
        """Remember that nothing new has come; an older reason for a skip still holds."""
        if self._skip is None:
            self.skip("no new samples since the last identification")

    def succeed(self) -> None:
        """Forget the last skip."""
        self._skip = None

    def values(self) -> dict[str, str]:
        """Return the values of the diagnostic for the last skip, if there was any."""
        if self._skip is None:
            return {}
        reason, stamp = self._skip
        age = (self._node.get_clock().now().nanoseconds - stamp) / 1e9
        return {"scheduled_skip": reason, "scheduled_skip_age [s]": f"{age:.3f}"}
