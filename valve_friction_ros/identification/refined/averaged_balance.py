"""The force balance of a machine without a spring, every term averaged in the same way.

Without a spring no force returns the stem, and its simulation drifts away from the record whatever
the parameters. Only the regression is left. A derivative over a window is a mean over that window
(`averaging`); here force and friction are averaged with the same weights, so that the window
does not bias the mass.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.identify import chosen_step
from valve_friction_ros.identification.published.regression import ForceBalanceRegression
from valve_friction_ros.identification.settings import REGRESSED, IdentificationSettings
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.sliding import mean_speed
from valve_friction_ros.identification.trust.uncertainty import (
    Covariance,
    block_covariance,
    stroke_length,
    worst_case,
)
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.derivatives import Averaging
from valve_friction_ros.signals.measured_record import MeasuredRecord

__all__ = ["AveragedBalance", "averaged_balance"]

_CHANGE = 0.25
"""Change of the friction over the travel of the record from which the model is in doubt.

Chosen: the growth of F_c that raises the first alarm (`FrictionLimits`)."""

_UNEXPLAINED = _CHANGE / math.sqrt(12.0)
"""Systematic misfit over the friction that is tolerated: the standard deviation of a friction that
changes evenly by `_CHANGE`."""

_FALL_SPEED_SHARE = 0.1
"""Speed over the top speed within which friction may fall, as in a Stribeck curve. Chosen."""

_MOVING_SHARE = 0.05
"""Speed over the top speed above which the mean speed is taken. Chosen: it leaves rests out."""

_CHANCE = 2.0
"""Standard deviations of a covariance of noise that are chance: 5 % exceed them."""

_MOST_STROKES = 500
"""Most strokes for their scatter. Chosen: noise makes any number of them, and memory is finite."""

_NOISE_MARGIN = 2.0
"""Noise of the sensors that the residual may hold, over its estimate.

Chosen: residuals of simulated machines are up to 1.7 times the estimate, which knows white noise
only."""

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
    sliding_speed : float
        Mean speed over the distance, m/s.
    """

    values: Mapping[str, float]
    names: tuple[str, ...]
    covariance: Covariance
    systematic: NDArray[np.float64]
    misfit: Misfit
    strokes: int
    window: int
    change: float
    sliding_speed: float

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

    @property
    def sliding_friction(self) -> tuple[float, dict[str, float]]:
        """F_c + F_v·|ẋ| at the sliding speed, N, and what it takes of each parameter."""
        parts = {"coulomb_friction": 1.0, "viscous_friction": self.sliding_speed}
        return sum(share * self.values[name] for name, share in parts.items()), parts

    def half_width(self, parts: Mapping[str, float]) -> float:
        """Half the width of the 95 % interval of a sum of parameters, by its shares of each."""
        gradient = self._gradient(parts)
        return self.covariance.half_width(gradient) + float(np.abs(gradient) @ self.systematic)

    def _gradient(self, parts: Mapping[str, float]) -> NDArray[np.float64]:
        return np.array([parts.get(name, 0.0) for name in self.names])

    def relative_width(self) -> float:
        """Half width of the first free parameter over its value; infinite where it has none."""
        name = self.names[0]
        value = self.values.get(name, 0.0)
        return self.half_width({name: 1.0}) / value if value > 0 else math.inf

    def standard_error(self, parts: Mapping[str, float]) -> float:
        """Scatter of a sum of parameters between the strokes."""
        return self.covariance.standard_error(self._gradient(parts))


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
    averaged = _Averaged.of(record, valve, settings, window)
    sweep, chosen = chosen_step(averaged.regression, settings, window)
    regression, motion = averaged.regression, averaged.motion
    names = regression.names
    moving = regression.speed > float(sweep.thresholds[chosen])
    columns, force = regression.columns * moving[:, None], regression.force * moving
    estimates = _solved(columns, force)
    values = {name: float(each) for name, each in regression.complete(estimates).items()}
    residual = columns @ estimates - force
    equation = EstimatingEquation.of_least_squares(columns, residual)
    stroke = stroke_length(np.cumsum(averaged.velocity * moving))
    stroke = max(stroke, residual.size // _MOST_STROKES)
    samples, rms = int(moving.sum()), float(np.linalg.norm(residual) / np.sqrt(moving.sum()))
    drive_noise = valve.force_per_drive * record.drive_noise
    noise = {
        "mass": motion.acceleration_gain * record.position_noise,
        "viscous_friction": motion.velocity_gain * record.position_noise,
        _DELAY: motion.slope_gain(record.sample_period) * drive_noise,
    }
    expected = math.hypot(
        values["mass"] * noise["mass"], float(np.linalg.norm(motion.weights)) * drive_noise
    )
    unexplained = math.sqrt(max(rms**2 - (_NOISE_MARGIN * expected) ** 2, 0.0))
    shared = max(_lasting(residual, moving, window, rms), unexplained)
    falling = _solved(np.column_stack([columns, averaged.falling * moving]), force)[:-1]
    scale = np.sqrt(np.diag(equation.curvature))
    scale[scale == 0] = 1.0
    inverse = 2 * np.linalg.pinv(equation.curvature / np.outer(scale, scale))
    systematic = (
        np.sqrt(np.diag(worst_case(equation.curvature, samples, shared)))
        + np.abs(inverse / np.outer(scale, scale))
        @ np.array([noise.get(name, 0.0) for name in names])
        * samples
        * rms
        + np.abs(falling - estimates)
    )
    friction = values["coulomb_friction"] * averaged.direction
    friction += values["viscous_friction"] * motion.velocity
    tolerated = _UNEXPLAINED * float(np.linalg.norm(friction * moving) / math.sqrt(samples))
    spread = regression.force[moving] - regression.force[moving].mean()
    fit = 1 - float(np.linalg.norm(residual) / np.linalg.norm(spread))
    trend = _certain_last(np.column_stack([columns, averaged.along * moving]), force, stroke)
    change = trend * float(np.ptp(record.position)) / abs(values["coulomb_friction"] or math.inf)
    return AveragedBalance(
        values,
        names,
        block_covariance(equation, stroke),
        systematic,
        Misfit(fit, rms, shared, tolerated, "N"),
        residual.size // stroke,
        window,
        change,
        mean_speed(averaged.velocity),
    )


class _Averaged(NamedTuple):
    """The regression of the averaged terms, and what tests it.

    `direction` is the averaged sign of the velocity, `falling` the shape of a friction that falls
    with the speed, `along` that of one that grows along the travel.
    """

    regression: ForceBalanceRegression
    motion: Averaging
    velocity: NDArray[np.float64]
    direction: NDArray[np.float64]
    falling: NDArray[np.float64]
    along: NDArray[np.float64]

    @classmethod
    def of(
        cls, record: MeasuredRecord, valve: Valve, settings: IdentificationSettings, window: int
    ) -> "_Averaged":
        """Average every term of the force balance like the acceleration."""
        derivatives = record.derivatives(window, settings.order)
        velocity, speed = derivatives.velocity, np.abs(derivatives.velocity)
        everywhere = np.pad(velocity, derivatives.margin, mode="edge")
        sign, top = np.sign(everywhere), float(speed.max())
        motion = record.averaging(window, settings.order)
        force = motion.mean(valve.actuator_force(record.drive))
        direction = motion.mean(sign)
        regressors = {
            "mass": motion.acceleration,
            "coulomb_friction": direction,
            "viscous_friction": motion.velocity,
            "spring_constant": motion.mean(record.position),
            "spring_preload": np.ones_like(force),
        }
        if settings.position_bias is not None:
            del regressors["spring_preload"]
        fixed = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
        left = force.copy()
        for name in fixed.keys() & regressors.keys():
            left -= fixed[name] * regressors.pop(name)
        either = motion.mean(np.abs(everywhere))
        usual = float(either[speed > _MOVING_SHARE * top].mean())
        regressors[_ASYMMETRY] = either - usual
        regressors[_DELAY] = np.gradient(force, record.sample_period)
        place = record.position - record.position.mean()
        return cls(
            ForceBalanceRegression(
                tuple(regressors),
                np.column_stack([*regressors.values()]),
                left,
                speed,
                fixed,
                settings.position_bias,
            ),
            motion,
            velocity,
            direction,
            motion.mean(sign * np.exp(-np.abs(everywhere) / (_FALL_SPEED_SHARE * top))),
            motion.mean(sign * place),
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


def _certain_last(columns: NDArray[np.float64], target: NDArray[np.float64], stroke: int) -> float:
    """Coefficient of the last column; 0 where its interval holds 0."""
    solved = _solved(columns, target)
    equation = EstimatingEquation.of_least_squares(columns, columns @ solved - target)
    gradient = np.eye(solved.size)[-1]
    value, width = float(solved[-1]), block_covariance(equation, stroke).half_width(gradient)
    return value if abs(value) > width else 0.0
