"""A straight line through values that scatter more than their own intervals."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.student import student_quantile

__all__ = ["LEAST_ESTIMATES", "ScatteredLine", "fit_line"]

LEAST_ESTIMATES = 4
"""Fewest estimates of a line: two more than it has parameters."""
_HALVINGS = 60


class ScatteredLine(NamedTuple):
    """A line y = level + slope·(t − centre), with its uncertainty.

    Attributes
    ----------
    centre : float
        Time at which level and slope are uncorrelated.
    level, slope : float
        Its parameters.
    level_error, slope_error : float
        Their standard errors.
    scatter : float
        Standard deviation between estimates beyond their own errors.
    freedom : int
        Degrees of freedom.
    """

    centre: float
    level: float
    slope: float
    level_error: float
    slope_error: float
    scatter: float
    freedom: int

    @property
    def quantile(self) -> float:
        """Half width of a 95 % interval in standard errors."""
        return student_quantile(0.975, self.freedom)

    @property
    def slope_half_width(self) -> float:
        """Half the width of the slope's 95 % interval."""
        return self.quantile * self.slope_error

    def at(self, time: Any) -> Any:
        """Return the line at a time, or at an array of times."""
        return self.level + self.slope * (time - self.centre)

    def half_width(self, time: Any) -> Any:
        """Return half the width of the line's 95 % interval there."""
        away = time - self.centre
        return self.quantile * np.hypot(self.level_error, self.slope_error * away)

    def crossing(self, level: float, level_error: float) -> tuple[float, float, float] | None:
        """Return when the line reaches a level with a standard error: time and 95 % interval.

        By Fieller: the interval holds the times at which line and level do not differ at the 5 %
        level. It is finite exactly where the slope's own interval excludes zero; None elsewhere.
        """
        gap, factor = level - self.level, self.quantile**2
        a = self.slope**2 - factor * self.slope_error**2
        if a <= 0:
            return None
        c = gap**2 - factor * (self.level_error**2 + level_error**2)
        root = math.sqrt(max((self.slope * gap) ** 2 - a * c, 0.0))
        ends = sorted((self.slope * gap + sign * root) / a for sign in (-1.0, 1.0))
        return (
            self.centre + gap / self.slope,
            self.centre + ends[0],
            self.centre + ends[1],
        )


def _misfit(
    scatter: float,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> tuple[float, float, float, float, float]:
    """Fit at a given scatter; centre, level, slope, total weight about the line, and χ²."""
    weights = 1.0 / (errors**2 + scatter**2)
    total = weights.sum()
    centre = float(weights @ times / total)
    level = float(weights @ values / total)
    away = times - centre
    spread = float(weights @ away**2)
    slope = float(weights @ (away * values) / spread)
    residual = values - level - slope * away
    return centre, level, slope, spread, float(weights @ residual**2)


def fit_line(
    times: NDArray[np.float64], values: NDArray[np.float64], errors: NDArray[np.float64]
) -> ScatteredLine:
    """Fit a line to estimates with errors of their own and a common scatter beside them.

    The scatter is the one with which χ² is as large as its degrees of freedom (Paule and Mandel),
    zero where it is not that large without any. The standard errors are those of Knapp and
    Hartung, scaled by √(χ²/freedom), but never down; with them belongs Student's t.

    Parameters
    ----------
    times, values, errors : ndarray of float, shape (n,)
        Times, not all equal; estimates; their standard errors. Errors below 1e-9 of the largest
        value count as that much.

    Returns
    -------
    ScatteredLine
        The line.

    Raises
    ------
    ValueError
        If there are fewer than `LEAST_ESTIMATES`, or the times are all equal.
    """
    if times.size < LEAST_ESTIMATES or np.ptp(times) == 0:
        raise ValueError(f"a line needs {LEAST_ESTIMATES} estimates at several times")
    unit = float(np.abs(values).max()) or 1.0
    values, errors = values / unit, np.maximum(errors / unit, 1e-9)
    freedom = times.size - 2
    scatter = 0.0
    if _misfit(0.0, times, values, errors)[-1] > freedom:
        highest = float(np.ptp(values)) + float(errors.max())
        lowest, highest = 0.0, 2 * highest
        for _ in range(_HALVINGS):  # the misfit falls with the scatter
            scatter = 0.5 * (lowest + highest)
            is_small = _misfit(scatter, times, values, errors)[-1] < freedom
            lowest, highest = (lowest, scatter) if is_small else (scatter, highest)
    centre, level, slope, spread, misfit = _misfit(scatter, times, values, errors)
    total = float((1.0 / (errors**2 + scatter**2)).sum())
    scale = unit * math.sqrt(max(misfit / freedom, 1.0))
    return ScatteredLine(
        centre,
        unit * level,
        unit * slope,
        scale / math.sqrt(total),
        scale / math.sqrt(spread),
        unit * scatter,
        freedom,
    )
