# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Records for the parts, 62.4 s of the bench at 1 kHz; number of repeats, and the clock."""

import resource
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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

PERIOD = 1e-3
"""Sample period, s."""

SAMPLES = 62_400

VALVES = {"low": LOW_FRICTION, "high": HIGH_FRICTION}
"""Parameters of the bench valve by the tightness of its packing."""

PRESSURES = ("square", "sine", "noisy square")
"""Names for `pressure`."""

_NOISE = 165.0
"""Pressure noise that makes a sliding stem stick and slip at every other sample, Pa."""


@cache
def pressure(name: str, samples: int = SAMPLES) -> NDArray[np.float64]:
    """Return an actuator pressure after the converter lag, Pa, shape (samples,)."""
    wave = SineWave() if name == "sine" else SquareWave()
    answer = converter_response(wave.sample(np.arange(samples) * PERIOD), PERIOD)
    if name.startswith("noisy"):
        answer = answer + np.random.default_rng(1).normal(0.0, _NOISE, samples)
    return answer


@cache
def noisy_record(
    parameters: KarnoppParameters, noise: SensorNoise, samples: int = SAMPLES
) -> Recording:
    """Return a record of the square wave with sensor noise."""
    driving = pressure("square", samples)
    stem = simulate(BENCH_VALVE, parameters, driving, PERIOD)
    return noise.applied_to(Recording(PERIOD, driving, stem.position))


@dataclass(frozen=True)
class Settings:
    """Settings of the measurements.

    Attributes
    ----------
    repeats : int
        Repetitions of each measurement; the result is their median.
    seconds : float
        Duration of each stream, s.
    say : callable
        Shows the present activity.
    """

    repeats: int = 5
    seconds: float = 60.0
    say: Callable[[str], None] = field(default=lambda _: None, repr=False)


def _processor_time() -> float:
    """Return the processor time of this process and its ended children, s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def medians(functions: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the median processor time of each function, s.

    The functions take turns, so that a change of the machine's speed affects all. Each first runs
    once unmeasured, to exclude compilation and caching.
    """
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for function in functions.values():
        function()
    for _ in range(repeats):
        for name, function in functions.items():
            begin = _processor_time()
            function()
            seconds[name].append(_processor_time() - begin)
    return {name: statistics.median(times) for name, times in seconds.items()}
