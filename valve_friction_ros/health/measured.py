"""A measured number with its interval."""

from typing import NamedTuple

__all__ = ["Measured"]


class Measured(NamedTuple):
    """A number of a valve.

    Attributes
    ----------
    value, half_width : float
        The number, and half the width of its 95 % interval, SI unit.
    """

    value: float
    half_width: float

    @property
    def share(self) -> float:
        """Half width over the magnitude of the value; infinite for zero."""
        return self.half_width / abs(self.value) if self.value else float("inf")
