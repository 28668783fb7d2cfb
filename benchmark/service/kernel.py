# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The motion of a valve in a control loop over hours, sampled at the rate of its sensors."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import laws
from benchmark.reality.plants.kernel import stem_pull
from benchmark.reality.plants.laws import INNER, V, X
from benchmark.reality.plants.parameters import ELEMENTS, Constants, Law

SUMS = 2
"""Number of sums over the motion: ∫|dx| and ∫|F·dx|."""

_COMMAND, _INTEGRAL, _PRESSURE, _MEASURED = range(4)
_LOWEST, _HIGHEST = -0.15, 1.15


class Loop(NamedTuple):
    """A PI position controller and its converter.

    Attributes
    ----------
    gain, integral_time : float
        Gain (1) and integral time (s) of the controller.
    action_period : float
        Time between two actions, s.
    process_lag : float
        First-order lag of the controller's measurement, s.
    bottom, span : float
        Pressure at command 0, and its change from command 0 to 1, Pa.
    converter_lag : float
        First-order lag of the converter, s.
    """

    gain: float
    integral_time: float
    action_period: float
    process_lag: float
    bottom: float
    span: float
    converter_lag: float


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
    """Return a time, s, over which the stem surely rests, and the pressure after it, Pa.

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


def _runner(advance: Callable[..., float], skips: bool) -> Callable[..., Any]:
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

    compiled: Callable[..., Any] = run
    return compiled


_RUNNERS: dict[Law, Callable[..., Any]] = {}


def runner_of(law: Law) -> Callable[..., Any]:
    """Return the compiled service for a friction law; the first call compiles it."""
    if law not in _RUNNERS:
        skips = law in (Law.MOREAU, Law.KARNOPP, Law.LATCHED)
        _RUNNERS[law] = _runner(getattr(laws, law.value), skips)
    return _RUNNERS[law]
