# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The records that the parts measure on: 62.4 s of the bench at 1 kHz."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    converter_response,
    simulate,
)

__all__ = ["PERIOD", "PRESSURES", "SAMPLES", "VALVES", "noisy_record", "pressure"]

PERIOD = 1e-3
"""Sample period, s."""

SAMPLES = 62_400

VALVES = {"low": LOW_FRICTION, "high": HIGH_FRICTION}
"""Parameters of the bench valve by the tightness of its packing."""

PRESSURES = ("square", "sine", "noisy square")
"""Names that `pressure` knows."""

_NOISE = 165.0
"""Noise of the pressure that makes a sliding stem stick and slip at every other sample, Pa."""


@cache
def pressure(name: str, samples: int = SAMPLES) -> NDArray[np.float64]:
    """Return an actuator pressure behind the converter's lag, Pa, shape (samples,)."""
    wave = SineWave() if name == "sine" else SquareWave()
    answer = converter_response(wave.sample(np.arange(samples) * PERIOD), PERIOD)
    if name.startswith("noisy"):
        answer = answer + np.random.default_rng(1).normal(0.0, _NOISE, samples)
    return answer


@cache
def noisy_record(
    parameters: KarnoppParameters, noise: SensorNoise, samples: int = SAMPLES
) -> Recording:
    """Return a record of the square wave as noisy sensors see it."""
    driving = pressure("square", samples)
    stem = simulate(BENCH_VALVE, parameters, driving, PERIOD)
    return noise.applied_to(Recording(PERIOD, driving, stem.position))
