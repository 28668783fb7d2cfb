# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The server that a valve's history goes to, as its diagnostics and log tell of it."""

from pathlib import Path
from typing import TYPE_CHECKING

from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.history import KeptValve, server_from
from valve_friction_ros.streams import utc_second

if TYPE_CHECKING:
    from valve_friction_ros.history import Sender


class HistorySending:
    """Sends the history to a server, if one is named; without it, nothing is done.

    Raises ValueError if the address of the server cannot be used, or there is no file.
    """

    def __init__(self, node: Node, path: Path | None, valve: KeptValve) -> None:
        self._node, self._valve = node, valve
        self._untaken: str | None = None
        self._sender: Sender | None = None
        server = server_from(node.get_parameter("history_url").value, "history_url")
        if server is None:
            return
        if path is None:
            raise ValueError("history_url needs history_file, where rows wait for the server")
        self._sender = database.sender_of(path, server)

    def take(self) -> None:
        """Take the rows of the valve, where another machine has kept them; wait some seconds."""
        if self._sender is not None:
            self._untaken = self._sender.take(self._valve)
        if self._untaken is not None:
            self._node.get_logger().warning(
                "what another machine may have kept of this valve was not taken from the server, "
                f"and is at the next start: {self._untaken}"
            )

    def follow(self) -> None:
        """Log what has changed."""
        news = None if self._sender is None else self._sender.news()
        if news is not None:
            self._node.get_logger().warning(news)

    def values(self) -> dict[str, str]:
        """Return what the diagnostics say of the server."""
        if self._sender is None:
            return {}
        state = self._sender.state
        values = {
            "history_server": str(self._sender.server),
            "history_server waiting": str(state.count.waiting),
            "history_server problem": state.problem or "",
        }
        if state.count.waiting and state.count.since is not None:
            values["history_server waiting since [time]"] = utc_second(state.count.since * 10**9)
        if state.count.refused:
            values["history_server refused"] = str(state.count.refused)
        if self._untaken is not None:
            values["history_server not taken"] = self._untaken
        return values

    def close(self) -> None:
        """Send what can be sent at once."""
        if self._sender is not None:
            self._sender.end()
            self._sender = None
