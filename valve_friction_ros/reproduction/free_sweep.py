"""The sweep of the paper: four parameters, with the mass as regressed."""

from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification import (
    IdentificationSettings,
    Sweep,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.regression import force_balance_regression
from valve_friction_ros.identification.published.threshold import choose_threshold
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.signals import differentiate

__all__ = ["FreeSweep", "free_sweep"]

_REGION = 1.05
"""Multiple of the least σ_s that bounds the region of the paper's choice. Chosen: the paper gives
no number."""


class FreeSweep(NamedTuple):
    """A sweep of all four parameters of (3), and its chosen step.

    `published_estimate` repeats the regression with an assumed mass where the record does not
    determine it; here the regressed mass stays.
    """

    sweep: Sweep
    chosen: int
    window: int

    @property
    def threshold(self) -> float:
        """The chosen δv, m/s."""
        return float(self.sweep.thresholds[self.chosen])

    @property
    def chosen_estimates(self) -> dict[str, float]:
        """Estimates at the chosen δv, by name."""
        return self.estimates_at(self.threshold)

    def estimates_at(self, threshold: float) -> dict[str, float]:
        """Return the estimates at the δv, m/s, nearest to `threshold`, by name."""
        place = int(np.argmin(np.abs(self.sweep.thresholds - threshold)))
        return {name: float(one[place]) for name, one in self.sweep.estimates.items()}

    @property
    def region(self) -> tuple[float, float]:
        """From the least to the largest δv, m/s, with a σ_s within 5 % of the least.

        Where samples are fewer than four derivative windows, σ_s is left out: too few samples are
        independent.
        """
        sweep = self.sweep
        usable = np.isfinite(sweep.sigma) & (sweep.samples >= sweep.free * self.window)
        sigma = np.where(usable, sweep.sigma, np.inf)
        inside = sweep.thresholds[sigma <= _REGION * sigma.min()]
        return float(inside[0]), float(inside[-1])


def free_sweep(recording: Recording, valve: Valve, settings: IdentificationSettings) -> FreeSweep:
    """Sweep (3) to (8) with (17) and (18), nothing assumed."""
    derivatives = differentiate(
        recording.position, recording.sample_period, settings.published_window, settings.order
    )
    force = valve.actuator_force(recording.drive)
    regression = force_balance_regression(force, recording.position, derivatives, settings)
    first = float(regression.speed.max()) / settings.resolution
    steps = np.arange(1, settings.steps + 1, dtype=np.float64)
    sweep = sweep_thresholds(regression, np.multiply(first, steps, dtype=np.float64))
    return FreeSweep(
        sweep, choose_threshold(sweep, settings.published_window), settings.published_window
    )
