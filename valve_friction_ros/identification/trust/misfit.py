"""Misfit: the distance between a model and the record that it was identified from."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from valve_friction_ros.identification.trust.rounding import percentage

if TYPE_CHECKING:
    from valve_friction_ros.model.valve import Valve

__all__ = ["LEAST_FIT", "Misfit", "stem_distance"]

_EXPECTED_SHARE = 0.75
"""Share of the tolerated misfit that chance explains.

Chosen: 68 of 71 simulated noisy records of Karnopp valves lie below it, 70 below the tolerance."""

LEAST_FIT = 0.9
"""Share of the movement below which a model that does not describe the record is refused.

Chosen below all simulated records, which have 0.96 and more, except in-service records of graphite
at 100 Hz
(0.84)."""


@dataclass(frozen=True)
class Misfit:
    """How well the simulated stem follows the measured one, or the modelled force the measured.

    Attributes
    ----------
    fit : float
        Share of the movement that is reproduced, at most 1.
    rms : float
        Root mean square of the whole residual, sensor noise included, `unit`.
    systematic : float
        Part of it that the sensors' noise does not explain, `unit`.
    tolerated : float
        Largest systematic misfit that leaves the model without doubt, `unit`.
    unit : str
        ``m``; ``N`` where no stem is simulated.
    """

    fit: float
    rms: float
    systematic: float
    tolerated: float
    unit: str = "m"

    @property
    def of_stem(self) -> float:
        """The systematic misfit of a simulated stem, m; nan where no stem is simulated."""
        return self.systematic if self.unit == "m" else math.nan

    @property
    def words(self) -> str:
        """The systematic misfit with its unit, for people."""
        if self.unit == "m":
            return f"{self.systematic * 1e6:.3g} µm"
        return f"{self.systematic:.3g} {self.unit}"

    @property
    def excess(self) -> float:
        """Systematic misfit beyond the share that chance explains, `unit`."""
        expected = _EXPECTED_SHARE * self.tolerated
        return math.sqrt(max(self.systematic**2 - expected**2, 0.0))

    @property
    def is_gross(self) -> bool:
        """Whether the model reproduces too little of the movement for any parameter to be used."""
        return self.fit < LEAST_FIT and not self.describes

    @property
    def describes(self) -> bool:
        """Whether the model describes the valve."""
        return self.systematic <= self.tolerated


def stem_distance(rms: float, valve: "Valve") -> str:
    """Write the distance of simulated and measured stem, in micrometres and percent of travel."""
    share = valve.share_of_travel(rms)
    of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
    return f"{rms * 1e6:.3g} µm rms from the measured stem{of_travel}"
