# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Assessed records, and parameters whose numbers the tests choose."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_bench,
    identify_published,
)
from valve_friction_ros.model import BENCH_VALVE, Recording, SensorNoise, SineWave, simulate

NAN = float("nan")


@pytest.fixture(scope="session")
def record(benches):
    """Four strokes at 100 Hz, with a little noise on both sensors."""
    pressure = SineWave(period=4.0).sample(np.arange(800) / 100)
    position = simulate(BENCH_VALVE, benches["low"].parameters, pressure, 0.01).position
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=1)
    return noise.applied_to(Recording(0.01, pressure, position))


@pytest.fixture(scope="session")
def result(record):
    """What every panel shows at once: the sweep of one method, the simulated stem of another."""
    settings = IdentificationSettings(position_bias=1.13e-3)
    swept = identify_published(record, BENCH_VALVE, settings)
    simulated = identify_bench(record, BENCH_VALVE, settings)
    return dataclasses.replace(
        swept,
        parameters=simulated.parameters,
        stem=simulated.stem,
        misfit=simulated.misfit,
        fit=simulated.fit,
        rms=simulated.rms,
    )


@pytest.fixture(scope="session")
def with_parameters(result):
    """Function of (value, half width, verdict) by name: the result with these instead."""

    def build(**changes):
        changed = {
            name: Parameter(name, value, half_width / 2, half_width, verdict, "reason")
            for name, (value, half_width, verdict) in changes.items()
        }
        return dataclasses.replace(result, parameters={**result.parameters, **changed})

    return build


@pytest.fixture(scope="session")
def nothing_known(with_parameters, result):
    """The result with every parameter withheld."""
    withheld = (NAN, NAN, Verdict.NOT_IDENTIFIABLE)
    return with_parameters(**dict.fromkeys(result.parameters, withheld))
