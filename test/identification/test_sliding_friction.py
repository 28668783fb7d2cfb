# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sliding friction of each method: ∫|F_friction|·|dx| / ∫|dx| of the simulated valve."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, identify
from valve_friction_ros.identification.trust.sliding import (
    mean_over_distance,
    mean_sliding_friction,
    mean_speed,
)
from valve_friction_ros.model import KarnoppParameters, SensorNoise, SquareWave, TriangleWave

EXCITATIONS = {"square": (SquareWave(period=31.0), 62.0), "triangle": (TriangleWave(), 150.0)}
SETTINGS = IdentificationSettings(assumed_mass=1.6, timing_uncertainty=0.0)
NOISE = SensorNoise(28.6e-6, 165.0, seed=3)


def test_by_hand():
    """2 s at 1 m/s and 1 s at −4 m/s: 6 m; F_c 10 N and F_v 3 N·s/m do 2·13 + 4·22 = 114 J."""
    velocity = np.array([1.0, 1.0, 0.0, -4.0])
    packing = KarnoppParameters(1.0, 3.0, 10.0, 10.0, 1.0)
    assert mean_speed(velocity) == 18 / 6
    assert mean_sliding_friction(packing, velocity) == 114 / 6
    assert mean_over_distance(np.array([5.0, 5.0, 99.0, 2.0]), velocity) == 18 / 6


def test_up_and_down_count_by_their_distance():
    """12 N over 2 m up, 8 N over 4 m down: 56 J over 6 m."""
    uneven = KarnoppParameters(1.0, 0.0, 10.0, 10.0, 1.0, coulomb_asymmetry=0.2)
    assert mean_sliding_friction(uneven, np.array([2.0, -4.0])) == pytest.approx(56 / 6)


def test_at_rest_there_is_none():
    assert mean_speed(np.zeros(3)) == 0.0


@pytest.fixture
def tried(benches, bench_record, bench_trajectory):
    """Function of valve, excitation, method and noise: the result, and its true friction, N."""

    def run(name, kind, method, noise=None):
        bench, (excitation, duration) = benches[name], EXCITATIONS[kind]
        record = bench_record(name, excitation, duration, noise)
        _, motion = bench_trajectory(name, excitation, duration)
        truth = mean_sliding_friction(bench.parameters, motion.velocity)
        return identify(record, bench.valve, SETTINGS, method), truth, mean_speed(motion.velocity)

    return run


@pytest.mark.parametrize("noise", [None, NOISE], ids=["quiet", "noisy"])
@pytest.mark.parametrize("kind", EXCITATIONS)
@pytest.mark.parametrize("name", ["low", "graphite"])
@pytest.mark.parametrize("method", ["bench", "plant"])
def test_along_the_simulated_stem(tried, name, kind, method, noise):
    result, truth, speed = tried(name, kind, method, noise)
    found = result.parameters["sliding_friction"]
    assert abs(found.value - truth) <= found.half_width
    assert result.sliding_speed == pytest.approx(speed, rel=5e-3)
    if method == "bench":
        assert found.half_width == pytest.approx(3e-3 * found.value, rel=0.2)


@pytest.mark.parametrize("name", ["low", "high", "graphite"])
def test_of_a_signature_is_half_the_loop_at_the_speed_of_its_strokes(tried, benches, name):
    """The slip jumps, which are faster, are not in it."""
    result, *_ = tried(name, "triangle", "signature")
    packing = benches[name].parameters
    truth = packing.coulomb_friction + packing.viscous_friction * result.sliding_speed
    found = result.parameters["sliding_friction"]
    assert abs(found.value - truth) <= found.half_width < 5e-3 * truth
    loop = 0.5 * result.evidence["dead_zone"] * benches[name].valve.diaphragm_area
    assert found.value == pytest.approx(loop, rel=1e-3)


def test_of_the_published_method_is_that_above_its_threshold(tried, benches):
    result, *_ = tried("low", "square", "published")
    found, values = result.parameters["sliding_friction"], result.values
    assert found.value == pytest.approx(
        values["coulomb_friction"] + values["viscous_friction"] * result.sliding_speed
    )
    assert np.isnan(found.half_width)
    packing = benches["low"].parameters
    truth = packing.coulomb_friction + packing.viscous_friction * result.sliding_speed
    assert found.value == pytest.approx(truth, rel=1e-3)


def test_of_a_force_scale_it_has_one_power(benches, bench_record):
    """Twice the diaphragm area: twice the friction, at the same speed."""
    valve = benches["high"].valve
    record = bench_record("high", *EXCITATIONS["square"])
    twice = dataclasses.replace(valve, diaphragm_area=2 * valve.diaphragm_area)
    settings = dataclasses.replace(SETTINGS, assumed_mass=3.2)
    one = identify(record, valve, SETTINGS, "bench")
    other = identify(record, twice, settings, "bench")
    value = one.parameters["sliding_friction"].value
    assert other.parameters["sliding_friction"].value == pytest.approx(2 * value, rel=1e-5)
    assert other.sliding_speed == pytest.approx(one.sliding_speed, rel=1e-5)
