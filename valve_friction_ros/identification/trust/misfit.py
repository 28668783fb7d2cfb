# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Misfit: the distance between a model and the record that it was identified from."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from valve_friction_ros.wording import misfit_words, percentage, two_digits

if TYPE_CHECKING:
    from valve_friction_ros.model.valve import Valve

LEAST_FIT = 0.9
"""Share of the movement below which a model that does not describe the record is refused.

Chosen below all simulated records, which have 0.96 and more, except in-service records of graphite
at 100 Hz (0.84)."""


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
        """The systematic misfit with its unit, as text."""
        return misfit_words(self.systematic, self.unit)

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
    return f"{two_digits(rms * 1e6)} µm rms{of_travel}"
