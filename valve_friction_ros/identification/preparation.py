# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Compilation of what the methods run, before the first record comes."""

import numpy as np

from valve_friction_ros.identification.methods import identify
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SineWave,
    compile_kernels,
    simulate,
)


def compile_methods() -> None:
    """Compile all kernels, or load their compiled forms, by identifying six simulated seconds.

    Takes a second, and up to a minute the first time on a machine.
    """
    compile_kernels()
    period, count = 0.01, 600
    pressure = SineWave(period=3.0).sample(period * np.arange(count))
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, period).position
    random = np.random.default_rng(0)
    noisy = position + 1e-6 * random.standard_normal(count)
    identify(Recording(period, pressure + 5.0 * random.standard_normal(count), noisy), BENCH_VALVE)
