"""What every method of identification returns: parameters that say how far to trust them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.estimate import UNITS, Estimate
from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.refined.model_test import Misfit
from valve_friction_ros.identification.refined.output_error import OFFSET
from valve_friction_ros.identification.trust.verdict import AssessedParameter
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters

__all__ = ["ASSESSED_UNITS", "Assessment"]

ASSESSED_UNITS: Mapping[str, str] = MappingProxyType(
    {
        **UNITS,
        "stribeck_velocity": "m/s",
        "coulomb_asymmetry": "1",
        "viscous_asymmetry": "1",
        OFFSET: "s",
    }
)
"""Unit of every parameter that an assessment can hold; those after `UNITS` only on demand."""


@dataclass(frozen=True, eq=False)
class Assessment(ABC):
    """Parameters with their verdicts.

    Attributes
    ----------
    parameters : mapping of str to AssessedParameter
        By name: those of `UNITS`, and behind them what the record demanded in addition.
    published : Estimate or None
        The published sweep on the same record, with the settings as they were given; None where
        it has no answer, or the method is another.
    misfit : Misfit or None
        A test of the model: how well it can reproduce the stem; None where there is no such test.
    warnings : tuple of str
        What a reader of the numbers should know, one sentence each.
    """

    method: ClassVar[str]
    """Name of the method, as in `METHODS`."""

    parameters: Mapping[str, AssessedParameter]
    published: Estimate | None
    misfit: Misfit | None
    warnings: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """The assessed values by name; nan where a parameter is not identifiable."""
        return {name: one.value for name, one in self.parameters.items()}

    @property
    def all_warnings(self) -> tuple[str, ...]:
        """The warnings, and those of the published estimate beside it, each once."""
        published = () if self.published is None else self.published.warnings
        notes = (f"published estimate: {warning}" for warning in published)
        return tuple(dict.fromkeys((*self.warnings, *notes)))

    @property
    @abstractmethod
    def fit(self) -> float:
        """Share of what was measured that the model reproduces, at most 1."""

    @property
    @abstractmethod
    def rms(self) -> float:
        """Root mean square of simulated less measured position, m; nan if none is simulated."""

    @property
    @abstractmethod
    def window(self) -> int:
        """Derivative window that the record asks for, samples."""

    @property
    @abstractmethod
    def sweep(self) -> Sweep | None:
        """The sweep of thresholds δv; None in a method without one."""

    @property
    @abstractmethod
    def simulated(self) -> NDArray[np.float64] | None:
        """Position of the model's stem at times evenly spread over the record, m, or None."""

    @abstractmethod
    def model(self) -> KarnoppParameters:
        """Return the identified model, to simulate."""
