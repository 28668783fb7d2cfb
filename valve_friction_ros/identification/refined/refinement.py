"""Refinement by simulation: the model whose simulated stem follows the measured stem.

The sweep regresses a force on differentiated positions, so noise on the position biases it. The
refinement compares positions with positions. The remaining noise of the pressure enters both the
residual and the sensitivities, so their product does not average to zero. Instruments avoid this
bias: the residual under either half of the pressure samples is weighted with the sensitivities
under the other half, whose noise is independent.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.identification.refined.output_error import Coordinates, OutputError
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.uncertainty import (
    Covariance,
    block_covariance,
    stroke_length,
)

__all__ = ["Refinement", "estimating_equation", "extended", "least_squares_fit", "refine"]

_INSTRUMENT_STEPS = 12
"""Most steps of Newton's method. Most records take 2 to 8; the others follow single stick
events, and more steps do not bring them further."""

_CONVERGED = 1e-5
"""Largest step, over the natural sizes, that ends the method. Chosen: 20 times below the narrowest
half width (`finest_half_share`)."""

_JITTER = 1e-3
"""Steps below this size end the method once they no longer halve: they then follow single stick
events. Chosen: a tenth of the step of the differences, over which the slopes are averaged."""

_LARGEST_STEP = 0.3
"""Largest step, over the natural sizes. Chosen: longer steps leave the range of the
linearisation."""

_LARGEST_GROWTH = 1.5
"""Growth of the residual, over that of the least-squares fit, beyond which that fit is kept.

Chosen: 1.2 at most in 72 simulated records where the method converged."""


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined model and the equation that it solves.

    Attributes
    ----------
    problem : OutputError
        Record and valve.
    coordinates : mapping of str to float
        The solution, all coordinates of the model.
    names : tuple of str
        The free coordinates, in the order of the equation.
    equation : EstimatingEquation
        At the solution, by the free coordinates in their own units.
    simulated : ndarray of float, shape (n,)
        Simulated position, m.
    residuals : tuple of two ndarray of float, shape (n,)
        Simulated minus measured position under either half of the pressure, m.
    """

    problem: OutputError
    coordinates: Coordinates
    names: tuple[str, ...]
    equation: EstimatingEquation = field(repr=False)
    simulated: NDArray[np.float64] = field(repr=False)
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)

    @property
    def residual(self) -> NDArray[np.float64]:
        """Simulated minus measured position, m, shape (n,)."""
        return self.simulated - self.problem.record.position

    @cached_property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity of the simulated stem from sample to sample, m/s, shape (n − 1,)."""
        return np.asarray(np.diff(self.simulated) / self.problem.record.sample_period)

    @property
    def top_speed(self) -> float:
        """Highest speed of the simulated stem, m/s."""
        return float(np.max(np.abs(self.velocity)))

    @property
    def rms(self) -> float:
        """Root mean square of the residual, m."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def stroke(self) -> int:
        """Mean number of samples of a stroke."""
        return stroke_length(self.simulated)

    @cached_property
    def covariance(self) -> Covariance:
        """Covariance of the free coordinates, by the scatter between strokes."""
        return block_covariance(self.equation, self.stroke)


def estimating_equation(
    problem: OutputError, at: Coordinates, units: Mapping[str, float]
) -> EstimatingEquation:
    """Set up the instrumented equation for the coordinates named in `units`, over their units."""
    halves = problem.record.halves
    if halves[0] is halves[1]:
        return _plain_equation(problem, at, units)
    one, two = halves
    return EstimatingEquation(
        (problem.sensitivity(at, one, units), problem.sensitivity(at, two, units)),
        (problem.residual(at, one), problem.residual(at, two)),
    )


def extended(
    equation: EstimatingEquation,
    problem: OutputError,
    at: Coordinates,
    units: Mapping[str, float],
) -> EstimatingEquation:
    """Add the coordinates in `units` to those of an `estimating_equation` at `at`.

    The slopes of its own coordinates are kept.
    """
    one, two = (
        np.hstack((slope, problem.sensitivity(at, half, units)))
        for slope, half in zip(equation.slopes, problem.record.halves, strict=True)
    )
    return EstimatingEquation((one, two), equation.residuals)


def _plain_equation(
    problem: OutputError, at: Coordinates, units: Mapping[str, float]
) -> EstimatingEquation:
    """Set up the equation of least squares, without instruments."""
    pressure = problem.record.pressure
    return EstimatingEquation.of_least_squares(
        problem.sensitivity(at, pressure, units), problem.residual(at, pressure)
    )


def _moved(at: Coordinates, units: Mapping[str, float], step: NDArray[np.float64]) -> Coordinates:
    changes = dict(zip(units, step.tolist(), strict=True))
    return {**at, **{name: at[name] + change * units[name] for name, change in changes.items()}}


def least_squares_fit(
    problem: OutputError, start: Coordinates, names: tuple[str, ...]
) -> Coordinates:
    """Fit the coordinates `names` by least squares, without instruments; return all."""
    units = problem.units(names, start)
    pressure = problem.record.pressure
    fitted = scipy.optimize.least_squares(  # type: ignore[operator]  # the stubs take it for a module
        lambda step: problem.residual(_moved(start, units, step), pressure),
        np.zeros(len(units)),
        lambda step: problem.sensitivity(_moved(start, units, step), pressure, units),
        method="lm",
        xtol=1e-5,
        ftol=1e-7,
        max_nfev=15,
    )
    return _moved(start, units, np.asarray(fitted.x))


def _instrumented(
    problem: OutputError, fitted: Coordinates, units: Mapping[str, float]
) -> tuple[Coordinates, EstimatingEquation]:
    """Solve the instrumented equation from the least-squares fit; return the fit if that fails.

    In a record of few strokes a single stick event can differ between the two halves of the
    pressure. Newton's method may then diverge, or the equation has no minimum. The fit with its
    small bias is then the better answer.
    """
    record = problem.record
    allowed = _LARGEST_GROWTH * float(np.linalg.norm(problem.residual(fitted, record.pressure)))

    def is_near(at: Coordinates) -> bool:
        distances = [np.linalg.norm(problem.residual(at, half)) for half in record.halves]
        return bool(max(distances) <= allowed)

    at, previous = fitted, math.inf
    for _ in range(_INSTRUMENT_STEPS):
        if not is_near(at):
            return fitted, _plain_equation(problem, fitted, units)
        equation = estimating_equation(problem, at, units)
        if not equation.is_definite:
            return fitted, _plain_equation(problem, fitted, units)
        step = equation.newton_step()
        largest = float(np.max(np.abs(step)))
        if largest < _CONVERGED or 0.5 * previous < largest < _JITTER:
            break
        previous = largest
        at = _moved(at, units, step * min(1.0, _LARGEST_STEP / max(largest, 1e-300)))
    return at, equation


def refine(problem: OutputError, start: Coordinates, names: tuple[str, ...]) -> Refinement:
    """Refine the coordinates `names` until the simulated stem follows the measured one.

    Least squares first; from there the instrumented equation, by Newton's method.

    Parameters
    ----------
    problem : OutputError
        Record and valve.
    start : mapping of str to float
        All coordinates of the model to start from.
    names : tuple of str
        The free coordinates.

    Returns
    -------
    Refinement
        The refined model.
    """
    fitted = least_squares_fit(problem, start, names)
    units = problem.units(names, fitted)
    at, equation = _instrumented(problem, fitted, units)
    halves = problem.record.halves
    return Refinement(
        problem,
        at,
        names,
        equation.in_units(np.array([*units.values()])),
        problem.simulated(at, problem.record.pressure),
        (problem.residual(at, halves[0]), problem.residual(at, halves[1])),
    )
