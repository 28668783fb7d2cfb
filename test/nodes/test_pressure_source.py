# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The bench's pressure over topics: the signal behind the converter, and its stamps."""

import subprocess
import sys

import numpy as np
import pytest
from live_nodes import NAMESPACE, SECOND, STREAM, stamp_of
from sensor_msgs.msg import FluidPressure

from valve_friction_ros.model import IsaSteps, SquareWave, converter_response

RATE = 200.0
SPEED = 10.0
LAG = 0.3
WAVE = SquareWave(low=6e4, high=1.5e5, period=2.0)
PARAMETERS = {
    "low": 6e4,
    "high": 1.5e5,
    "period": 2.0,
    "sample_rate": RATE,
    "speed": SPEED,
    "converter_lag": LAG,
}
ONE_PERIOD = round(WAVE.period * RATE)


def heard(live, parameters, count):
    """Start a source; return stamps and pressures of `count` samples in a row."""
    messages = live.client.listen(FluidPressure, f"{NAMESPACE}/actuator_pressure", STREAM)
    live.start("pressure_source", parameters)
    live.client.wait_until(lambda: len(messages) >= count, f"{count} samples")
    stamps = np.array([stamp_of(message.header.stamp) for message in messages[:count]])
    return stamps, np.array([message.fluid_pressure for message in messages[:count]])


def place_in(signal, heard_part):
    """Number of the sample at which the listener joined: the best match in `signal`."""
    windows = np.lib.stride_tricks.sliding_window_view(signal, heard_part.size)
    return int(np.argmin(np.abs(windows - heard_part).max(axis=1)))


def published(excitation, lag=LAG, seconds=200.0):
    time = np.arange(round(seconds * RATE)) / RATE
    return converter_response(excitation.sample(time), 1 / RATE, lag)


def test_square_wave_behind_the_converter_without_a_lost_sample(live):
    stamps, pressure = heard(live, PARAMETERS, 2 * ONE_PERIOD)
    np.testing.assert_array_equal(np.diff(stamps), round(SECOND / RATE))
    expected = published(WAVE)
    first = place_in(expected, pressure)
    np.testing.assert_allclose(pressure, expected[first : first + pressure.size], rtol=1e-12)
    assert np.ptp(pressure) > 0.9 * (WAVE.high - WAVE.low)


def test_noise_is_white_and_told_by_its_seed(live):
    deviation = 100.0
    noisy = {**PARAMETERS, "pressure_noise": deviation, "noise_seed": 5}
    stamps, pressure = heard(live, noisy, 2 * ONE_PERIOD)
    np.testing.assert_array_equal(np.diff(stamps), round(SECOND / RATE))
    clean = published(WAVE)
    expected = clean + deviation * np.random.default_rng(5).standard_normal(clean.size)
    first = place_in(expected, pressure)
    np.testing.assert_allclose(pressure, expected[first : first + pressure.size], rtol=1e-12)


@pytest.mark.parametrize("rate", [3.0, 1e3 / 3])
def test_rates_that_nanoseconds_do_not_divide(live, rate):
    stamps, _ = heard(live, {**PARAMETERS, "sample_rate": rate, "speed": 100.0}, 100)
    since_first = stamps - stamps[0]
    exact = np.arange(100) * SECOND / rate
    assert np.abs(since_first - exact).max() <= 1.0  # each of the two ends is rounded


def test_signal_from_a_file(live, tmp_path):
    file = tmp_path / "steps.csv"
    file.write_text("time_s,note,pressure_pa\n10,a,60000\n11,b,80000\n11.5,c,70000\n20,d,90000\n")
    parameters = {
        "excitation": "file",
        "file": str(file),
        "sample_rate": RATE,
        "speed": 1.0,
        "converter_lag": 0.0,
    }
    _, pressure = heard(live, parameters, 300)
    time = np.arange(4000) / RATE
    expected = np.interp(time, [0, 1, 1.5, 10], [6e4, 8e4, 7e4, 9e4])
    first = place_in(expected, pressure)
    np.testing.assert_allclose(pressure, expected[first : first + 300], rtol=1e-12)
    assert np.ptp(pressure) > 1e3


def test_isa_steps(live):
    hold = 0.0513  # s; no step falls on a sample, where rounding would decide
    parameters = {
        **PARAMETERS,
        "excitation": "isa_steps",
        "period": hold,
        "converter_lag": 0.0,
        "speed": 0.5,
    }
    _, pressure = heard(live, parameters, 200)
    steps = IsaSteps(centre=1.05e5, span=9e4, hold=hold)
    expected = published(steps, lag=0.0, seconds=10.0)
    first = place_in(expected, pressure)
    np.testing.assert_allclose(pressure, expected[first : first + 200], rtol=1e-12)
    assert np.unique(pressure).size > 5


def test_jitter_is_of_the_time_alone_and_bounded(live):
    """Stamps leave the grid by up to the jitter either way; the pressures are as before."""
    jitter = 1e-3
    stamps, pressure = heard(live, {**PARAMETERS, "time_jitter": jitter}, 2 * ONE_PERIOD)
    expected = published(WAVE)
    first = place_in(expected, pressure)
    np.testing.assert_allclose(pressure, expected[first : first + pressure.size], rtol=1e-12)
    off = (stamps - stamps[0]) / SECOND - np.arange(stamps.size) / RATE
    off -= (off.max() + off.min()) / 2
    assert np.abs(off).max() <= 1.001 * jitter
    assert off.std() == pytest.approx(jitter / np.sqrt(3), rel=0.1)
    assert np.all(np.diff(stamps) > 0)


@pytest.mark.usefixtures("ros_environment")
def test_jitter_of_half_a_period_is_refused():
    done = subprocess.run(
        [sys.executable, "-m", "valve_friction_ros.nodes.pressure_source", "--ros-args",
         "-p", "sample_rate:=200.0", "-p", "time_jitter:=0.0025"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("cannot start: time_jitter (0.0025 s) must be below half")
    assert done.stderr.count("\n") == 1
