"""The force balance of a machine without a spring, every term averaged in the same way.

Without a spring no force returns the stem, and its simulation drifts away from the record whatever
the parameters. Only the regression is left. A derivative over a window is a mean over that window
(`averaging`); here force and friction are averaged with the same weights, so that the window
does not bias the mass.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.identify import chosen_step
from valve_friction_ros.identification.published.regression import ForceBalanceRegression
from valve_friction_ros.identification.settings import REGRESSED, IdentificationSettings
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.uncertainty import (
    Covariance,
    block_covariance,
    stroke_length,
    worst_case,
)
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.measured_record import MeasuredRecord

__all__ = ["AveragedBalance", "averaged_balance"]

_CHANGE = 0.25
"""Change of the friction over the travel of the record from which the model is in doubt.

Chosen: the growth of F_c that raises the first alarm (`FrictionLimits`)."""

_UNEXPLAINED = _CHANGE / np.sqrt(12.0)
"""Systematic misfit over the friction that is tolerated: the standard deviation of a friction that
changes evenly by `_CHANGE`."""

_FALL_SPEED_SHARE = 0.1
"""Speed over the top speed within which friction may fall, as in a Stribeck curve. Chosen."""

_MOVING_SHARE = 0.05
"""Speed over the top speed above which the mean speed is taken. Chosen: it leaves rests out."""

_CHANCE = 2.0
"""Standard deviations of a covariance of noise that are chance: 5 % exceed them."""

_DELAY, _ASYMMETRY = "delay", "asymmetry"
"""Imperfections in every fit: a force that acts late (each holds its value for a sampling period at
least), and a viscous friction that differs by direction."""


@dataclass(frozen=True, eq=False)
class AveragedBalance:
    """A regression of averaged forces, with what its residual says about it.

    Attributes
    ----------
    values : mapping of str to float
        Mass, friction, spring and preload; the fixed ones too.
    names : tuple of str
        Columns of the regression: the free parameters first, then the imperfections.
    covariance : Covariance
        Scatter between the strokes.
    systematic : ndarray of float, shape (p,)
        Largest errors that the scatter does not show: by the systematic part of the residual
        (`worst_case`), by noise of the regressors, and by friction that falls with the speed.
    misfit : Misfit
        Test of the model, N.
    strokes : int
        Strokes of the record.
    window : int
        Derivative window, samples.
    change : float
        Change of the Coulomb friction over the travel of the record, over its mean; 0 if it is no
        more than chance.
    """

    values: Mapping[str, float]
    names: tuple[str, ...]
    covariance: Covariance
    systematic: NDArray[np.float64]
    misfit: Misfit
    strokes: int
    window: int
    change: float

    @property
    def doubt(self) -> str:
        """Why the model does not describe the machine; empty if it does."""
        if abs(self.change) >= _CHANGE:
            return (
                "the friction model does not describe this machine: friction changes by "
                f"{100 * abs(self.change):.0f} % along the travel"
            )
        if not self.misfit.describes:
            return (
                "the friction model does not describe this machine: "
                f"{self.misfit.words} of misfit are not noise"
            )
        return ""

    def half_width(self, name: str) -> float:
        """Half the width of the 95 % interval of a free parameter."""
        index = self.names.index(name)
        gradient = np.eye(len(self.names))[index]
        return self.covariance.half_width(gradient) + float(self.systematic[index])

    def relative_width(self) -> float:
        """Half width of the first free parameter over its value; infinite where it has none."""
        name = self.names[0]
        value = self.values.get(name, 0.0)
        return self.half_width(name) / value if value > 0 else np.inf

    def standard_error(self, name: str) -> float:
        """Scatter of a free parameter between the strokes."""
        return self.covariance.standard_error(np.eye(len(self.names))[self.names.index(name)])


def averaged_balance(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings, window: int
) -> AveragedBalance:
    """Fit the averaged force balance of a machine without a spring.

    Parameters
    ----------
    record : MeasuredRecord
        Drive and position.
    valve : Valve
        Geometry.
    settings : IdentificationSettings
        Fixed parameters, order of the derivatives, and the sweep of the threshold.
    window : int
        Derivative window, samples.

    Returns
    -------
    AveragedBalance
        Raises RefusalError if no threshold leaves enough moving samples.
    """
    period, order = record.sample_period, settings.order
    derivatives = record.derivatives(window, order)
    margin, velocity = derivatives.margin, derivatives.velocity
    speed = np.abs(velocity)
    everywhere = np.pad(velocity, margin, mode="edge")
    direction = np.sign(everywhere)
    motion = record.averaging(window, order)
    force = motion.mean(valve.actuator_force(record.drive))
    regressors = {
        "mass": motion.acceleration,
        "coulomb_friction": motion.mean(direction),
        "viscous_friction": motion.velocity,
        "spring_constant": motion.mean(record.position),
        "spring_preload": np.ones_like(force),
    }
    if settings.position_bias is not None:
        del regressors["spring_preload"]
    fixed = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
    left = force - sum(
        (value * regressors.pop(name) for name, value in fixed.items() if name in regressors),
        np.zeros_like(force),
    )
    either = motion.mean(np.abs(everywhere))
    usual = either[speed > _MOVING_SHARE * speed.max()].mean()
    extra = {_ASYMMETRY: either - usual, _DELAY: np.gradient(force, period)}
    names = (*regressors, *extra)
    columns = np.column_stack([*regressors.values(), *extra.values()])
    regression = ForceBalanceRegression(names, columns, left, speed, fixed, settings.position_bias)
    sweep, chosen = chosen_step(regression, settings, window)
    moving = speed > float(sweep.thresholds[chosen])
    estimates = np.array([_solved(columns[moving], left[moving])]).ravel()
    residual = (columns @ estimates - left) * moving
    equation = EstimatingEquation.of_least_squares(columns * moving[:, None], residual)
    stroke = stroke_length(np.cumsum(velocity * moving))
    covariance = block_covariance(equation, stroke)
    samples, rms = int(moving.sum()), float(np.sqrt(np.mean(residual[moving] ** 2)))
    shared = _lasting(residual, moving, window, rms)
    noise = np.zeros(len(names))
    for name, gain in (
        ("mass", motion.acceleration_gain),
        ("viscous_friction", motion.velocity_gain),
    ):
        if name in names:
            noise[names.index(name)] = gain * record.position_noise
    change_of_force = np.linalg.norm(np.gradient(motion.weights)) / period
    noise[names.index(_DELAY)] = change_of_force * float(
        np.ptp(valve.actuator_force(np.array([0.0, record.drive_noise])))
    )
    inverse = np.linalg.pinv(equation.curvature) * 2
    falling = motion.mean(
        direction * np.exp(-np.abs(everywhere) / (_FALL_SPEED_SHARE * speed.max()))
    )
    place = record.position - record.position[margin:-margin][moving].mean()
    along = motion.mean(direction * place)
    systematic = (
        np.sqrt(np.diag(worst_case(equation.curvature, samples, shared)))
        + np.abs(inverse) @ noise * samples * rms
        + np.abs(
            _solved(np.column_stack([columns, falling])[moving], left[moving])[:-1] - estimates
        )
    )
    named = regression.complete(estimates)
    values = {name: float(value) for name, value in named.items()}
    friction = values["coulomb_friction"] * motion.mean(direction)
    friction += values["viscous_friction"] * motion.velocity
    tolerated = _UNEXPLAINED * float(np.sqrt(np.mean(friction[moving] ** 2)))
    spread = left[moving] - left[moving].mean()
    fit = 1 - float(np.linalg.norm(residual[moving]) / np.linalg.norm(spread))
    return AveragedBalance(
        values,
        names,
        covariance,
        systematic,
        Misfit(fit, rms, shared, tolerated, "N"),
        residual.size // stroke,
        window,
        _change(np.column_stack([columns, along]) * moving[:, None], left * moving, stroke)
        * float(np.ptp(record.position))
        / abs(values["coulomb_friction"] or np.inf),
    )


def _solved(columns: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least squares with columns scaled to one length."""
    lengths = np.linalg.norm(columns, axis=0)
    lengths[lengths == 0] = 1.0
    solved = np.linalg.lstsq(columns / lengths, target, rcond=None)[0] / lengths
    return np.asarray(solved, dtype=np.float64)


def _lasting(
    residual: NDArray[np.float64], moving: NDArray[np.bool_], window: int, rms: float
) -> float:
    """Root mean square of the part of the residual that outlasts a window, beyond chance.

    Noise that was averaged over a window is not correlated with itself a window later.
    """
    both = moving[window:] & moving[:-window]
    count = int(both.sum())
    if not count:
        return 0.0
    covariance = float(residual[window:][both] @ residual[:-window][both]) / count
    return float(np.sqrt(max(covariance - _CHANCE * rms**2 * np.sqrt(window / count), 0.0)))


def _change(columns: NDArray[np.float64], target: NDArray[np.float64], stroke: int) -> float:
    """Coefficient of the last column; 0 where its interval holds 0."""
    solved = _solved(columns, target)
    equation = EstimatingEquation.of_least_squares(columns, columns @ solved - target)
    gradient = np.eye(solved.size)[-1]
    value, width = float(solved[-1]), block_covariance(equation, stroke).half_width(gradient)
    return value if abs(value) > width else 0.0
