"""The data of an identified record in a figure."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import Drawing, Result
from valve_friction_ros.model import Recording

__all__ = ["Case"]


@dataclass(frozen=True, eq=False)
class Case:
    """A record with what its identification offers to be drawn.

    Attributes
    ----------
    label : str
        Name in the legend.
    recording : Recording
        Drive and stem position.
    drawing : Drawing
        What the method adds.
    simulated : ndarray of float, shape (m,), or None
        Position of the model's stem, m, at m times evenly spread over the record.
    """

    label: str
    recording: Recording = field(repr=False)
    drawing: Drawing = field(repr=False)
    simulated: NDArray[np.float64] | None = field(default=None, repr=False)

    @classmethod
    def of(cls, label: str, result: Result) -> "Case":
        """Return the case of a result."""
        simulated = None if result.stem is None else result.stem.simulated
        return cls(label, result.recording, result.drawing, simulated)
