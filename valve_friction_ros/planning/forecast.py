"""What a stroke test will do to a valve, and what will be known after it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    expected_half_widths,
)
from valve_friction_ros.identification.trust.sliding import SLIDING, mean_sliding_friction
from valve_friction_ros.model.excitations import Excitation
from valve_friction_ros.model.instruments import SensorNoise, converter_response
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.simulation import Trajectory, simulate
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.planning.conditions import Conditions

__all__ = ["Forecast", "Motion", "forecast", "moved"]

_MOST_SAMPLES = 12_000
"""Samples that a forecast simulates: of more, so many with as much less noise tell the same."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A simulated test.

    Attributes
    ----------
    sample_period : float
        Time between two samples, s.
    pressure : ndarray of float, shape (n,)
        Behind the converter, Pa.
    stem : Trajectory
        Position and velocity of the stem.
    """

    sample_period: float
    pressure: NDArray[np.float64] = field(repr=False)
    stem: Trajectory = field(repr=False)


@dataclass(frozen=True)
class Forecast:
    """What will be known of one valve.

    Attributes
    ----------
    parameters : KarnoppParameters
        The valve.
    values, half_widths : mapping of str to float
        True values, and half the widths of their 95 % intervals; SI units. No widths if refused.
    reach : tuple of float
        Lowest and highest position, m.
    top_speed : float
        Largest speed, m/s.
    breakaways : int
        How often the stem breaks away.
    refusal : str
        Why the identification would refuse the record; empty if it would not.
    """

    parameters: KarnoppParameters
    values: Mapping[str, float]
    half_widths: Mapping[str, float]
    reach: tuple[float, float]
    top_speed: float
    breakaways: int
    refusal: str = ""

    def relative(self, name: str) -> float:
        """Half width over the value, inf where either is not there."""
        value = abs(self.values.get(name, 0.0))
        return self.half_widths[name] / value if value and name in self.half_widths else math.inf


def moved(
    excitation: Excitation,
    duration: float,
    valve: Valve,
    parameters: KarnoppParameters,
    conditions: Conditions,
) -> Motion:
    """Simulate a valve under a signal of a converter, without noise."""
    samples = duration * conditions.sample_rate
    stride = max(math.ceil(samples / _MOST_SAMPLES), 1)
    period = stride / conditions.sample_rate
    time = np.arange(math.floor(duration / period + 1e-9) + 1) * period
    pressure = converter_response(excitation.sample(time), period, conditions.converter_lag)
    return Motion(period, pressure, simulate(valve, parameters, pressure, period))


def _breakaways(velocity: NDArray[np.float64]) -> int:
    return int(np.count_nonzero((velocity[1:] != 0) & (velocity[:-1] == 0)))


def forecast(
    motion: Motion,
    valve: Valve,
    parameters: KarnoppParameters,
    conditions: Conditions,
    settings: IdentificationSettings,
    *,
    with_competitors: bool = False,
) -> Forecast:
    """Tell what the identification will know from a simulated test.

    The noise is one sample of what the sensors have, the same for each test: the width of an
    interval hardly depends on it.
    """
    period, pressure, stem = motion.sample_period, motion.pressure, motion.stem
    fewer = math.sqrt(1.0 / (period * conditions.sample_rate))
    noise = SensorNoise(conditions.position_noise * fewer, conditions.pressure_noise * fewer, 0)
    record = noise.applied_to(Recording(period, pressure, stem.position))
    refusal, widths = "", {}
    try:
        widths = dict(
            expected_half_widths(
                record,
                valve,
                parameters,
                settings,
                start=float(stem.position[0]),
                with_competitors=with_competitors,
            )
        )
    except RefusalError as error:
        refusal = str(error)
    values = {**vars(parameters), SLIDING: mean_sliding_friction(parameters, stem.velocity)}
    return Forecast(
        parameters,
        values,
        widths,
        (float(stem.position.min()), float(stem.position.max())),
        float(np.max(np.abs(stem.velocity))),
        _breakaways(stem.velocity),
        refusal,
    )
