"""An identified record, and variations of it whose numbers the tests choose."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_refined,
)
from valve_friction_ros.model import BENCH_VALVE, Recording, SensorNoise, SineWave, simulate
from valve_friction_ros.reports import IdentifiedRecord


@pytest.fixture(scope="session")
def identified(benches):
    """Four strokes at 100 Hz, with a little noise on both sensors."""
    pressure = SineWave(period=4.0).sample(np.arange(800) / 100)
    position = simulate(BENCH_VALVE, benches["low"].parameters, pressure, 0.01).position
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=1)
    recording = noise.applied_to(Recording(0.01, pressure, position))
    settings = IdentificationSettings(position_bias=1.13e-3)
    result = identify_refined(recording, BENCH_VALVE, settings)
    return IdentifiedRecord("FV-101", "a test", result)


@pytest.fixture(scope="session")
def with_friction(identified):
    """Function of F_c, half width and verdict: the record, with k 2e5 N/m and F_s unknown."""

    def parameter(name, value, half_width, verdict, reason):
        return Parameter(name, value, half_width / 2, half_width, verdict, reason)

    def build(value, half_width=1.0, verdict=Verdict.IDENTIFIED, reason="", **changes):
        nan, unknown = float("nan"), Verdict.NOT_IDENTIFIABLE
        parameters = {
            **identified.result.parameters,
            "coulomb_friction": parameter("coulomb_friction", value, half_width, verdict, reason),
            "static_friction": parameter("static_friction", nan, nan, unknown, "hidden"),
            "spring_constant": parameter("spring_constant", 2e5, 1.0, Verdict.IDENTIFIED, ""),
        }
        if verdict is unknown:
            parameters["sliding_friction"] = parameter("sliding_friction", nan, nan, unknown, "")
        misfit = changes.pop("misfit", identified.result.misfit)
        result = dataclasses.replace(identified.result, parameters=parameters, misfit=misfit)
        return dataclasses.replace(identified, result=result, **changes)

    return build
