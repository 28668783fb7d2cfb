# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Valves in closed-loop service: their plants, and the kernel that runs them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import (
    ELEMENTS,
    INNER,
    PACKINGS,
    PRESSURE_RANGE,
    STEPPED,
    Body,
    Constants,
    Friction,
    Law,
    Plant,
    Trend,
    V,
    X,
    stem_pull,
)

SUMS = 2
"""Number of sums over the motion: ∫|dx| and ∫|F·dx|."""

_COMMAND, _INTEGRAL, _PRESSURE, _MEASURED = range(4)
_LOWEST, _HIGHEST = -0.15, 1.15


class Loop(NamedTuple):
    """A PI position controller and its converter."""

    # gain (1) and integral time (s) of the controller
    gain: float
    integral_time: float
    action_period: float  # time between two actions, s
    process_lag: float  # first-order lag of the controller's measurement, s
    # pressure at command 0, and its change from command 0 to 1, Pa
    bottom: float
    span: float
    converter_lag: float  # first-order lag of the converter, s


def new_state(loop: Loop, opening: float, travel: float) -> NDArray[np.float64]:
    """Return the state at rest at an opening, 0 to 1: first the loop, then the stem."""
    state = np.zeros(4 + INNER + ELEMENTS)
    state[_COMMAND] = state[_INTEGRAL] = state[_MEASURED] = opening
    state[_PRESSURE] = loop.bottom + loop.span * opening
    state[4 + X] = opening * travel
    return state


@numba.njit(inline="always")
def _rests(c: Constants, pull: float, scale: float) -> bool:
    """Return whether a resting stem remains at rest."""
    way = 1.0 if pull > 0.0 else -1.0
    return abs(pull) < scale * (1.0 + way * c.asymmetry) * c.static


@numba.njit
def _rest(
    c: Constants, loop: Loop, now: tuple[float, float, float, float], most: float, step: float
) -> tuple[float, float]:
    """Return a time, s, over which the stem clearly rests, and the pressure after it, Pa.

    The state `now` is position, pressure, its target, and the scale of friction. The pressure is
    monotonic until the next event, so a stem that rests at the end rests before it. If the time is
    no longer than `step`, the stem may break away.
    """
    position, pressure, target, scale = now
    while most > step:
        later = target + math.exp(-most / loop.converter_lag) * (pressure - target)
        if _rests(c, stem_pull(c, position, later), scale):
            return most, later
        most *= 0.5
    return most, pressure


@numba.njit
def _act(loop: Loop, whole: NDArray[np.float64], error: float) -> None:
    rate = loop.gain * error / loop.integral_time
    integral = whole[_INTEGRAL] + rate * loop.action_period
    whole[_INTEGRAL] = min(max(integral, _LOWEST), _HIGHEST)
    command = loop.gain * error + whole[_INTEGRAL]
    whole[_COMMAND] = min(max(command, _LOWEST), _HIGHEST)


@cache
def runner_of(law: Law) -> Callable[..., Any]:
    """Return the compiled service for a friction law; the first call compiles it."""
    advance, skips = STEPPED[law], law in (Law.MOREAU, Law.KARNOPP, Law.LATCHED)

    @numba.njit(nogil=True)
    def run(
        c: Constants,
        loop: Loop,
        scale: float,
        set_points: NDArray[np.float64],
        noise: NDArray[np.float64],
        step: float,
        sample_period: float,
        whole: NDArray[np.float64],
        outputs: NDArray[np.float64],
        sums: NDArray[np.float64],
    ) -> None:
        """Continue from state `whole`; fill `outputs` with pressure (row 0) and position (row 1).

        Each action of the controller has a set point and a noise value.
        """
        stem = whole[4:]
        pressure = whole[_PRESSURE]
        time, next_action, action = 0.0, 0.0, 0
        for sample in range(outputs.shape[1]):
            end = (sample + 1) * sample_period
            while time < end - 1e-9:
                if time >= next_action - 1e-9:
                    _act(loop, whole, set_points[action] - whole[_MEASURED] - noise[action])
                    action += 1
                    next_action = action * loop.action_period
                target = loop.bottom + loop.span * whole[_COMMAND]
                pull = stem_pull(c, stem[X], pressure)
                place = stem[X] / c.travel - 0.5
                here = scale * (1.0 + place * c.along_change)
                if skips and stem[V] == 0.0 and _rests(c, pull, here):
                    now, later = _rest(
                        c,
                        loop,
                        (stem[X], pressure, target, here),
                        min(end, next_action) - time,
                        step,
                    )
                    if now > step:
                        lasting = math.exp(-now / loop.process_lag)
                        opening = stem[X] / c.travel
                        whole[_MEASURED] = opening + lasting * (whole[_MEASURED] - opening)
                        pressure, time = later, time + now
                        continue
                now = step
                pressure += now / loop.converter_lag * (target - pressure)
                friction = advance(c, stem, pull, here, now)
                after = stem[X] + now * stem[V]
                if after < c.lowest or after > c.highest:
                    after = min(max(after, c.lowest), c.highest)
                    stem[V] = 0.0
                moved = abs(after - stem[X])
                sums[0] += moved
                sums[1] += abs(friction) * moved
                stem[X] = after
                share = now / loop.process_lag
                whole[_MEASURED] += share * (after / c.travel - whole[_MEASURED])
                time += now
            outputs[0, sample], outputs[1, sample] = pressure, stem[X]
        whole[_PRESSURE] = pressure

    return run


@dataclass(frozen=True)
class Senses:
    """The sensors of a valve."""

    rate: float = 40.0  # samples per second of each signal
    # standard deviations, m and Pa
    position_noise: float = 10e-6
    pressure_noise: float = 100.0
    # quantisation steps, m and Pa; 0 for none
    position_step: float = 0.0
    pressure_step: float = 0.0
    jitter: float = 0.0  # standard deviation of the stamps, as a share of the period
    lag: float = 0.0  # delay of the pressure stamps, s
    hold: int = 1  # number of samples with the same pressure value; 1 for no repetition


@dataclass(frozen=True)
class Duty:
    """The course of the set point."""

    step: float = 0.03  # size of a step, share of the range
    period: float = 12.0  # time from one step to the next, s
    # range of the set point; a range one step wide makes the steps alternate
    low: float = 0.3
    high: float = 0.7


@dataclass(frozen=True)
class ServiceValve:
    """A valve in service: plant, time step (s) of the simulation, loop, set points and sensors."""

    plant: Plant
    step: float
    loop: Loop
    duty: Duty = Duty()
    senses: Senses = Senses()


def _loop(gain: float, integral_time: float) -> Loop:
    low, high = PRESSURE_RANGE
    return Loop(gain, integral_time, 0.1, 0.3, low, high - low, 0.5)


_GRAPHITE = PACKINGS["graphite"]
_STICKY = replace(_GRAPHITE, friction=Friction(450.0, 900.0, 1.2e4, stribeck_velocity=2e-3))
_FALLING = replace(_GRAPHITE, friction=replace(_GRAPHITE.friction, stribeck_velocity=3.26e-3))
_BRISTLES = replace(_FALLING, friction=replace(_FALLING.friction, law=Law.LUGRE, presliding=25e-6))
_UNEVEN = replace(
    _GRAPHITE,
    friction=Friction(
        600.0, 750.0, 3e4, stribeck_velocity=3e-3, asymmetry=0.1, along_travel=Trend(0.2)
    ),
)

_COARSE = Senses(20.0, 15e-6, 300.0, 71e-6, 100.0, jitter=0.1)
_LATE = Senses(25.0, 10e-6, 150.0, lag=0.03, jitter=0.1)
_HELD = Senses(50.0, 10e-6, 100.0, 30e-6, hold=4)

_WIDE, _ALTERNATING = Duty(low=0.25, high=0.75), Duty(low=0.485, high=0.515)
_LOW, _HIGH = _loop(1.0, 2.0), _loop(1.5, 2.0)
_SLOW, _FAST = _loop(2.0, 3.0), _loop(3.0, 3.0)

PLANTS: Mapping[str, ServiceValve] = {
    "low": ServiceValve(PACKINGS["low"], 2e-4, _LOW),
    "high": ServiceValve(PACKINGS["high"], 2e-4, _HIGH),
    "graphite": ServiceValve(_FALLING, 8e-5, _SLOW),
    "stick-slip": ServiceValve(_STICKY, 8e-6, _SLOW),
    "low, coarse": ServiceValve(PACKINGS["low"], 2e-4, _LOW, senses=_COARSE),
    "high, late": ServiceValve(PACKINGS["high"], 2e-4, _HIGH, senses=_LATE),
    "stick-slip, coarse": ServiceValve(_STICKY, 8e-6, _SLOW, senses=_COARSE),
    "bristles": ServiceValve(_BRISTLES, 8e-5, _SLOW),
    "uneven, held": ServiceValve(_UNEVEN, 8e-5, _SLOW, _WIDE, _HELD),
    "alternating": ServiceValve(_FALLING, 8e-5, _FAST, _ALTERNATING),
}
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
