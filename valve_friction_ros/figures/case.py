"""The data of an identified record in a figure."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import Parameter, Result
from valve_friction_ros.model import Recording

__all__ = ["Case"]


@dataclass(frozen=True, eq=False)
class Case:
    """A record with the sweep of its identification.

    Attributes
    ----------
    label : str
        Name in the legend.
    recording : Recording
        Drive and stem position.
    thresholds : ndarray of float, shape (S,)
        δv(s), m/s.
    coulomb_friction : ndarray of float, shape (S,)
        F_c estimated at each threshold, N.
    sigma : ndarray of float, shape (S,)
        σ_s at each threshold, N.
    threshold : float
        The chosen threshold, m/s.
    friction : Parameter
        The refined Coulomb friction with its interval and verdict.
    simulated : ndarray of float, shape (m,), or None
        Position of the refined model's stem, m, at m times evenly spread over the record.
    """

    label: str
    recording: Recording = field(repr=False)
    thresholds: NDArray[np.float64] = field(repr=False)
    coulomb_friction: NDArray[np.float64] = field(repr=False)
    sigma: NDArray[np.float64] = field(repr=False)
    threshold: float
    friction: Parameter
    simulated: NDArray[np.float64] | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls,
        label: str,
        result: Result,
    ) -> "Case":
        """Return the case of a result with a sweep."""
        estimate = result.estimate
        if estimate is None:
            raise ValueError(f"the method {result.method} has no sweep to draw")
        return cls(
            label,
            result.recording,
            estimate.sweep.thresholds,
            estimate.sweep.estimates["coulomb_friction"],
            estimate.sweep.sigma,
            estimate.threshold,
            result.parameters["coulomb_friction"],
            None if result.stem is None else result.stem.simulated,
        )

    @classmethod
    def without_sweep(cls, label: str, result: Result) -> "Case":
        """Return the case of a result as a record with a simulated stem alone."""
        nothing = np.empty(0)
        return cls(
            label,
            result.recording,
            nothing,
            nothing,
            nothing,
            math.nan,
            result.parameters["coulomb_friction"],
            None if result.stem is None else result.stem.simulated,
        )

    @property
    def chosen_coulomb_friction(self) -> float:
        """F_c of the published method, at the chosen threshold, N."""
        return float(self.coulomb_friction[np.argmin(np.abs(self.thresholds - self.threshold))])
