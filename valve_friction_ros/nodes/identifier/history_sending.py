"""The server that a valve's history goes to, as its diagnostics and log tell of it."""

from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.history import KeptValve, Sender, sender_of, server_from
from valve_friction_ros.nodes.identifier.parameters import HISTORY_FILE, HISTORY_URL
from valve_friction_ros.streams import utc_second

__all__ = ["HistorySending"]


class HistorySending:
    """Sends the history to a server, if one is named; without it, nothing is done.

    Raises ValueError if the address of the server cannot be used, or there is no file.
    """

    def __init__(self, node: Node, path: Path | None, valve: KeptValve) -> None:
        self._node, self._valve = node, valve
        self._untaken: str | None = None
        self._sender: Sender | None = None
        server = server_from(node.get_parameter(HISTORY_URL.name).value, HISTORY_URL.name)
        if server is None:
            return
        if path is None:
            raise ValueError(
                f"{HISTORY_URL.name} needs {HISTORY_FILE.name}, where rows wait for the server"
            )
        self._sender = sender_of(path, server)

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
