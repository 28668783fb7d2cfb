# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Noise of the sensors of a record, told apart from the motion of the signals."""

import math

import numpy as np
import pytest

from valve_friction_ros.health.sensor_noise import sensor_noises
from valve_friction_ros.health.valve_changes import valve_changes
from valve_friction_ros.model import Recording


def record(position_noise, pressure_noise, rate=200.0, period=8.0, seed=3, colour=0.0, stroke=1.0):
    draw = np.random.default_rng(seed)
    time = np.arange(round(60 * rate)) / rate
    wave = np.sin(2 * np.pi * time / period)
    white = draw.standard_normal((2, time.size))
    if colour:
        for step in range(1, time.size):
            white[:, step] = colour * white[:, step - 1] + white[:, step]
    return Recording(
        1 / rate,
        1e5 + 5e4 * stroke * wave + pressure_noise * white[0],
        0.015 + 0.01 * stroke * wave + position_noise * white[1],
    )


@pytest.mark.parametrize("rate", [50.0, 1000.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_white_noise_is_found_with_its_interval(rate, seed):
    found = sensor_noises(record(1e-5, 100.0, rate, seed=seed))
    for name, true in (("stem_noise", 1e-5), ("drive_noise", 100.0)):
        assert abs(found[name].value - true) < max(2 * found[name].half_width, 0.03 * true)
        assert found[name].half_width < 0.1 * true


def test_a_signal_that_moves_more_than_its_noise_from_sample_to_sample_has_none_to_show():
    assert sensor_noises(record(1e-5, 100.0, rate=5.0, period=2.0)) == {}


def test_noise_with_a_memory_depends_on_the_rate_and_is_left_out():
    assert sensor_noises(record(1e-5, 100.0, colour=0.95)) == {}


def test_a_short_record_shows_none():
    short = record(1e-5, 100.0)
    assert sensor_noises(Recording(0.005, short.pressure[:150], short.position[:150])) == {}


def test_no_noise_is_found_below_the_resolution():
    found = sensor_noises(record(0.0, 0.0, rate=1000.0))["stem_noise"]
    assert found.value == found.half_width == pytest.approx(0.5e-4 * 0.02, rel=0.01)


@pytest.mark.parametrize("strokes", [(0.2, 1.0), (1.0, 0.2)])
def test_one_noise_seen_over_unlike_strokes_has_not_grown(strokes):
    """The resolution grows with the stroke; here from below the noise to above it."""
    healthy, now = (
        sensor_noises(record(0.7e-6, 100.0, stroke=stroke, seed=seed))
        for seed, stroke in enumerate(strokes)
    )
    ratio = valve_changes(now, healthy)["stem_noise"]
    assert ratio.holds(1.0)
    assert ratio.low < 2.0


def test_a_noise_above_a_former_resolution_has_surely_grown():
    healthy, now = sensor_noises(record(0.0, 100.0)), sensor_noises(record(2e-5, 100.0))
    ratio = valve_changes(now, healthy)["stem_noise"]
    assert 9.0 < ratio.low < 10.0
    assert ratio.high == math.inf
