# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The result of the published method: what it states of each parameter, and its evidence."""

import math
from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
    published_estimate,
)
from valve_friction_ros.identification.published.estimate import possible_model
from valve_friction_ros.identification.published.evidence import (
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.published.method import identify_published
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    KarnoppParameters,
    SensorNoise,
    SquareWave,
)
from valve_friction_ros.signals import differentiate

SPRING = HIGH_FRICTION.spring_constant
SETTINGS = IdentificationSettings(
    derivative_window=33, fixed={"spring_constant": SPRING}, assumed_mass=1.6
)


@pytest.fixture(scope="module")
def record(bench_record):
    """Noise hides the inertia, so that the mass is assumed."""
    return bench_record("high", SquareWave(), 20.8, SensorNoise(10e-6, 100.0, seed=0))


@pytest.fixture(scope="module")
def estimate(record):
    return published_estimate(record, BENCH_VALVE, SETTINGS)


@pytest.fixture
def result(record):
    return identify_published(record, BENCH_VALVE, SETTINGS)


def test_no_parameter_has_an_interval(result, estimate):
    """A given spring, an assumed mass, and what is identified without an interval."""
    assert list(result.parameters) == [*UNITS, "sliding_friction"]
    for name in UNITS:
        one, value = result.parameters[name], estimate.values[name]
        assert (one.name, one.value, one.published) == (name, value, value)
        if name in ("mass", "spring_constant"):
            assert (one.verdict, one.half_width) == (Verdict.FIXED, 0.0)
        else:
            assert (one.verdict, one.reason) == (
                Verdict.WEAK,
                "the published method gives no interval",
            )
            assert math.isnan(one.standard_error)
            assert math.isnan(one.half_width)
    assert result.parameters["mass"].value == 1.6
    assert result.parameters["mass"].reason == "assumed: the record does not determine it"
    assert result.parameters["spring_constant"].value == SPRING
    assert result.parameters["spring_constant"].reason == "given"


def test_what_the_result_keeps(result, record, estimate):
    assert result.method == "published"
    assert result.recording is record
    assert (result.valve, result.settings) == (BENCH_VALVE, SETTINGS)
    assert math.isnan(result.rms)
    assert result.misfit is None
    assert result.derivative_window == 33
    assert result.warnings == estimate.warnings != ()
    assert result.evidence == sweep_evidence(estimate)
    assert result.findings == (sweep_finding(estimate),)
    assert result.model == KarnoppParameters(**estimate.values)
    assert result.estimate.values == estimate.values


def test_default_settings_are_the_paper_s(record):
    result = identify_published(record, BENCH_VALVE)
    assert result.settings == IdentificationSettings()
    assert result.derivative_window == 31


def test_fit_is_the_share_of_the_force(result, record, estimate):
    """1 − |residual|/|force − mean| of the force less mass and spring, above the threshold."""
    velocity, acceleration, margin = differentiate(record.position, 1e-3, 33)
    force = BENCH_VALVE.actuator_force(record.pressure)[margin:-margin]
    left = force - 1.6 * acceleration - SPRING * record.position[margin:-margin]
    moving = np.abs(velocity) > estimate.threshold
    columns = np.column_stack([np.sign(velocity), velocity, np.ones(velocity.size)])[moving]
    left = left[moving]
    residual = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    unfit = np.linalg.norm(residual) / np.linalg.norm(left - left.mean())
    assert 0 < unfit < 0.1
    assert result.fit == pytest.approx(1 - unfit, abs=1e-4 * unfit)


def test_evidence(estimate):
    sample = replace(
        estimate, threshold=1.23456e-3, samples=789, sigma=0.123456, r_squared=0.98765432
    )
    assert sweep_evidence(sample) == {
        "threshold": 1.23456e-3,
        "samples": 789,
        "sigma": 0.123456,
        "r_squared": 0.98765432,
        "published_window": 33,
    }
    assert sweep_finding(sample) == (
        "published: threshold δv 0.001235 m/s, 789 samples above it, σ_s 0.1235 N, R² 0.987654, "
        "window 33 samples"
    )


def test_published_values_beside_those_of_another_method(estimate):
    """An extension has no published value, and a refused sweep leaves all without one."""
    mine = {
        name: Parameter(name, 2.0, 0.1, 0.2, Verdict.IDENTIFIED)
        for name in ("coulomb_friction", "stribeck_velocity")
    }
    friction, extension = with_published(mine, estimate).values()
    assert friction == replace(mine["coulomb_friction"], published=estimate.coulomb_friction)
    assert extension is mine["stribeck_velocity"]
    assert with_published(mine, None) == mine


def test_an_impossible_value_is_no_model(estimate):
    assert possible_model(estimate) == KarnoppParameters(**estimate.values)
    assert possible_model(replace(estimate, viscous_friction=-1.0)) is None
