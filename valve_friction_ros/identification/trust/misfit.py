"""How far a model is from the record it was identified from."""

import math
from dataclasses import dataclass

from valve_friction_ros.model.valve import Valve

__all__ = ["Misfit", "percentage", "stem_distance"]

_EXPECTED_SHARE = 0.75
_GROSS = 0.9


@dataclass(frozen=True)
class Misfit:
    """How well the simulated stem follows the measured one.

    Attributes
    ----------
    fit : float
        Share of the movement that is reproduced, at most 1.
    rms : float
        Root mean square of the whole residual, sensor noise included, m.
    systematic : float
        What of it the sensors' noise does not explain, m.
    tolerated : float
        The largest systematic misfit that still counts as the noise's doing, m.
    """

    fit: float
    rms: float
    systematic: float
    tolerated: float

    @property
    def excess(self) -> float:
        """Systematic misfit beyond what chance makes of it, m."""
        expected = _EXPECTED_SHARE * self.tolerated
        return math.sqrt(max(self.systematic**2 - expected**2, 0.0))

    @property
    def is_gross(self) -> bool:
        """Whether so little of the movement is reproduced that no number means anything."""
        return self.fit < _GROSS and not self.describes

    @property
    def describes(self) -> bool:
        """Whether the model describes the valve."""
        return self.systematic <= self.tolerated


def stem_distance(rms: float, valve: Valve) -> str:
    """Say how far a simulated stem is from the measured one, in micrometres and of the travel."""
    share = valve.share_of_travel(rms)
    of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
    return f"{rms * 1e6:.3g} µm rms from the measured one{of_travel}"


def percentage(share: float) -> str:
    """Write a share in percent for people: two digits, or whole percents from 100 % on."""
    percent = 100 * share
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"
