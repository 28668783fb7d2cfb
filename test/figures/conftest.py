"""Assessed records, and parameters whose numbers the tests choose."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.identification import (
    AssessedParameter,
    IdentificationSettings,
    Verdict,
    assess,
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
def assessment(record):
    return assess(record, BENCH_VALVE, IdentificationSettings(position_bias=1.13e-3))


@pytest.fixture(scope="session")
def with_parameters(assessment):
    """Function of (value, half width, verdict) by name: the assessment with these instead."""

    def build(**changes):
        changed = {
            name: AssessedParameter(name, value, half_width / 2, half_width, verdict, "reason")
            for name, (value, half_width, verdict) in changes.items()
        }
        return dataclasses.replace(assessment, parameters={**assessment.parameters, **changed})

    return build


@pytest.fixture(scope="session")
def nothing_known(with_parameters, assessment):
    """The assessment with every parameter withheld."""
    withheld = (NAN, NAN, Verdict.NOT_IDENTIFIABLE)
    return with_parameters(**dict.fromkeys(assessment.parameters, withheld))
