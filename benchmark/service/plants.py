# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Valves in service with their loops and sensors; some are random, each from its own number."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from benchmark.reality.plants import PACKINGS, Body, Friction, Law, Plant, Trend
from benchmark.reality.plants.parameters import PRESSURE_RANGE
from benchmark.service.kernel import Loop


@dataclass(frozen=True)
class Senses:
    """The sensors of a valve.

    Attributes
    ----------
    rate : float
        Samples per second of each signal.
    position_noise, pressure_noise : float
        Standard deviations, m and Pa.
    position_step, pressure_step : float
        Quantisation steps, m and Pa; 0 for none.
    jitter : float
        Standard deviation of the stamps, as a share of the period.
    lag : float
        Delay of the pressure stamps, s.
    hold : int
        Number of samples with the same pressure value; 1 for no repetition.
    """

    rate: float = 40.0
    position_noise: float = 10e-6
    pressure_noise: float = 100.0
    position_step: float = 0.0
    pressure_step: float = 0.0
    jitter: float = 0.0
    lag: float = 0.0
    hold: int = 1


@dataclass(frozen=True)
class Duty:
    """The course of the set point.

    Attributes
    ----------
    step : float
        Size of a step, share of the range.
    period : float
        Time from one step to the next, s.
    low, high : float
        Range of the set point; a range one step wide makes the steps alternate.
    """

    step: float = 0.03
    period: float = 12.0
    low: float = 0.3
    high: float = 0.7


@dataclass(frozen=True)
class ServiceValve:
    """A valve in service: plant, time step (s) of the simulation, loop, set points and sensors."""

    plant: Plant
    step: float
    loop: Loop
    duty: Duty
    senses: Senses


def _loop(gain: float, integral_time: float) -> Loop:
    low, high = PRESSURE_RANGE
    return Loop(gain, integral_time, 0.1, 0.3, low, high - low, 0.5)


_GRAPHITE = PACKINGS["graphite"]
_STICKY = replace(
    _GRAPHITE,
    friction=Friction(450.0, 900.0, 1.2e4, stribeck_velocity=2e-3),
)
_FALLING = replace(_GRAPHITE.friction, stribeck_velocity=3.26e-3)
_BRISTLES = replace(_FALLING, law=Law.LUGRE, presliding=25e-6)
_UNEVEN = Friction(600.0, 750.0, 3e4, stribeck_velocity=3e-3, asymmetry=0.1)

_COARSE = Senses(20.0, 15e-6, 300.0, 71e-6, 100.0, jitter=0.1)
_LATE = Senses(25.0, 10e-6, 150.0, lag=0.03, jitter=0.1)
_HELD = Senses(50.0, 10e-6, 100.0, 30e-6, hold=4)

PLANTS: Mapping[str, ServiceValve] = MappingProxyType(
    {
        "low": ServiceValve(PACKINGS["low"], 2e-4, _loop(1.0, 2.0), Duty(), Senses()),
        "high": ServiceValve(PACKINGS["high"], 2e-4, _loop(1.5, 2.0), Duty(), Senses()),
        "graphite": ServiceValve(
            replace(_GRAPHITE, friction=_FALLING), 8e-5, _loop(2.0, 3.0), Duty(), Senses()
        ),
        "stick-slip": ServiceValve(_STICKY, 8e-6, _loop(2.0, 3.0), Duty(), Senses()),
        "low, coarse": ServiceValve(PACKINGS["low"], 2e-4, _loop(1.0, 2.0), Duty(), _COARSE),
        "high, late": ServiceValve(PACKINGS["high"], 2e-4, _loop(1.5, 2.0), Duty(), _LATE),
        "stick-slip, coarse": ServiceValve(_STICKY, 8e-6, _loop(2.0, 3.0), Duty(), _COARSE),
        "bristles": ServiceValve(
            replace(_GRAPHITE, friction=_BRISTLES), 8e-5, _loop(2.0, 3.0), Duty(), Senses()
        ),
        "uneven, held": ServiceValve(
            replace(_GRAPHITE, friction=replace(_UNEVEN, along_travel=Trend(0.2))),
            8e-5,
            _loop(2.0, 3.0),
            Duty(low=0.25, high=0.75),
            _HELD,
        ),
        "alternating": ServiceValve(
            replace(_GRAPHITE, friction=_FALLING),
            8e-5,
            _loop(3.0, 3.0),
            Duty(low=0.485, high=0.515),
            Senses(),
        ),
    }
)
"""The paper's packings in closed loop, with imperfections of real plants."""

PREFIX = "drawn"
"""Prefix of the name of a random valve; its number follows."""

_LAWS = (Law.MOREAU, Law.MOREAU, Law.KARNOPP, Law.LATCHED, Law.LATCHED, Law.LUGRE, Law.MAXWELL)
_STEPS = {Law.KARNOPP: 2e-5, Law.LATCHED: 2e-5, Law.LUGRE: 8e-5, Law.MAXWELL: 4e-5}


def valve_of(name: str) -> ServiceValve:
    """Return a valve of `PLANTS`, or the random valve with the number after `PREFIX`."""
    prefix, _, number = name.partition(" ")
    return _drawn(int(number)) if prefix == PREFIX else PLANTS[name]


def _drawn(number: int) -> ServiceValve:
    random = np.random.default_rng([number, 14])
    friction = _friction(random)
    body = list(PACKINGS.values())[random.integers(len(PACKINGS))].body
    body = Body(
        mass=_between(random, 1.0, 4.0),
        spring=_between(random, 1.3e5, 3e5),
        preload=body.preload,
        pressure_reference=body.pressure_reference,
        spring_curve=random.uniform(-0.04, 0.04),
        flow_force=random.choice([0.0, random.uniform(0.0, 200.0)]),
    )
    low = body.preload / body.area + body.pressure_reference
    span = body.spring * body.travel / body.area
    loop = Loop(
        gain=_between(random, 0.8, 3.0),
        integral_time=_between(random, 1.5, 6.0),
        action_period=0.1,
        process_lag=_between(random, 0.15, 0.6),
        bottom=low - 0.1 * span,
        span=1.2 * span,
        converter_lag=_between(random, 0.2, 1.2),
    )
    middle = random.uniform(0.4, 0.6)
    return ServiceValve(
        Plant(body, friction),
        _step(friction, body.mass),
        loop,
        Duty(low=middle - 0.2, high=middle + 0.2),
        _senses(random),
    )


def _between(random: np.random.Generator, low: float, high: float) -> float:
    """Draw a number with a uniform logarithm."""
    return float(math.exp(random.uniform(math.log(low), math.log(high))))


def _friction(random: np.random.Generator) -> Friction:
    law = _LAWS[random.integers(len(_LAWS))]
    coulomb = _between(random, 120.0, 900.0)
    at_once = law in (Law.KARNOPP, Law.LATCHED)
    bends = law in (Law.LUGRE, Law.MAXWELL)
    return Friction(
        coulomb=coulomb,
        static=coulomb * random.uniform(1.0, 1.5 if bends else 2.0),
        viscous=_between(random, 4e3, 8e4),
        stribeck_velocity=0.0 if at_once else _between(random, 1e-3, 5e-3),
        law=law,
        presliding=random.uniform(5e-6, 25e-6) if bends else 0.0,
        limit_velocity=1e-4,
        asymmetry=random.uniform(-0.1, 0.1),
        along_travel=Trend(random.uniform(-0.2, 0.2)),
    )


def _step(friction: Friction, mass: float) -> float:
    if friction.law is not Law.MOREAU:
        return _STEPS[friction.law]
    fall = (friction.static - friction.coulomb) / friction.stribeck_velocity
    return float(np.clip(0.5 * mass / max(fall - friction.viscous, 1.0), 6e-6, 8e-5))


def _senses(random: np.random.Generator) -> Senses:
    return Senses(
        rate=float(random.choice([20.0, 25.0, 40.0, 50.0])),
        position_noise=random.uniform(5e-6, 15e-6),
        pressure_noise=random.uniform(50.0, 300.0),
        position_step=float(random.choice([0.0, 30e-6, 71e-6])),
        pressure_step=float(random.choice([0.0, 100.0, 200.0])),
        jitter=random.uniform(0.0, 0.1),
        lag=random.uniform(-0.03, 0.05),
        hold=int(random.choice([1, 1, 4])),
    )
