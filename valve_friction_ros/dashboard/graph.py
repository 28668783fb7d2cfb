"""What the pages ask of the graph of nodes."""

from typing import NamedTuple, Protocol

from valve_friction_ros.dashboard.heard.live_strip import LiveStrip

__all__ = ["Answer", "Operator", "Signals", "Visitors"]


class Answer(NamedTuple):
    """What a service said."""

    success: bool
    message: str


class Operator(Protocol):
    """Calls the services of identifiers."""

    async def call(self, node: str, service: str) -> Answer:
        """Call a service of an identifier and wait for its answer.

        Who cannot be reached is an answer without success, which says so.
        """
        ...


class Signals(Protocol):
    """Subscribes to the signals of a valve while somebody looks."""

    def watch(self, node: str) -> LiveStrip:
        """Subscribe to pressure and stem of an identifier's valve, once for all who look."""
        ...

    def unwatch(self, node: str) -> None:
        """Say that one looks no more; the last one ends the subscriptions."""
        ...


class Visitors(Protocol):
    """Knows who looks at the page whose code asks."""

    def name(self) -> str:
        """Return the name of their account; empty where none is needed."""
        ...

    def may_operate(self) -> bool:
        """Tell whether they may call services now."""
        ...

    def log_out(self) -> None:
        """End their session."""
        ...
