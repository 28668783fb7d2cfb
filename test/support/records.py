# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated records of the bench valve."""

from dataclasses import replace

import numpy as np

from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    converter_response,
    simulate,
)

TIGHT = {
    name: getattr(HIGH_FRICTION, name)
    for name in ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
}
"""True numbers of the tight packing."""


def simulated(pressure, sample_period, parameters=LOW_FRICTION):
    """Record of the bench valve under `pressure`, without noise."""
    position = simulate(BENCH_VALVE, parameters, pressure, sample_period).position
    return Recording(sample_period, pressure, position)


def quick_record(parameters=LOW_FRICTION):
    """Five seconds of a sine at 100 Hz: short to publish, and enough to be identified."""
    time = np.arange(500) / 100
    return simulated(SineWave(period=5.0).sample(time), 0.01, parameters)


def bench_record(parameters=LOW_FRICTION):
    """Two periods of a square wave, quicker than the paper's, behind a V/P converter, at 1 kHz."""
    time = np.arange(5200) / 1000
    pressure = converter_response(SquareWave(period=2.6).sample(time), 1e-3, 0.6)
    return simulated(pressure, 1e-3, parameters)


def square_record(parameters=HIGH_FRICTION):
    """Four periods of a square wave behind a V/P converter, at 100 Hz, with sensor noise."""
    time = np.arange(3200) / 100
    pressure = converter_response(SquareWave(period=8.0).sample(time), 0.01, 0.6)
    return SensorNoise(10e-6, 50.0, seed=1).applied_to(simulated(pressure, 0.01, parameters))


def stroked_record(seat=0.0, low=-0.15, high=1.15):
    """Two slow strokes between two shares of the pressures of the travel, on a seat so far up (m).

    By default the stem is pressed onto both stops.
    """
    time = np.arange(1000) / 100
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    pressure = 41_740.0 + 165_100.0 * (middle + half * np.sin(2 * np.pi * time / 5))
    inner = replace(BENCH_VALVE, travel=BENCH_VALVE.travel - seat)
    preload = LOW_FRICTION.spring_preload + LOW_FRICTION.spring_constant * seat
    packing = replace(LOW_FRICTION, spring_preload=preload)
    position = seat + simulate(inner, packing, pressure, 0.01).position
    return SensorNoise(5e-6, 50.0, seed=1).applied_to(Recording(0.01, pressure, position))


def sine_record(parameters):
    """Four strokes of two seconds and more, at 100 Hz, without noise."""
    pressure = SineWave(period=4.0).sample(np.arange(1600) / 100)
    return simulated(pressure, 0.01, parameters)


def assert_held(numbers, truth):
    """Each true number lies in its interval, or below its bound where the value is withheld."""
    for name, true in truth.items():
        one = numbers[name]
        if np.isnan(one.value):
            assert abs(true) <= one.magnitude_bound, name
        else:
            assert abs(one.value - true) <= one.half_width, name
