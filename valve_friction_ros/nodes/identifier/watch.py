"""What an identifier watches on its valve beside the identified friction."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from valve_friction_ros.health import Finding
from valve_friction_ros.streams import Arrivals

__all__ = ["Watch"]


class Watch(Protocol):
    """Follows the samples of a valve, and adds to its diagnostics."""

    def take(self, arrivals: Arrivals) -> None:
        """Take samples, some 20 times a second, in the executor's thread; it must return soon."""

    def findings(self) -> Sequence[Finding]:
        """Return what is found on the valve now; each raises its level where it is more severe."""

    def values(self) -> Mapping[str, str]:
        """Return values of the diagnostics, the unit of a number in its key."""
