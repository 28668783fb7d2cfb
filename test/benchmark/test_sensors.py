# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sensors do to the signals what they say."""

from dataclasses import replace

import numpy as np
import pytest

from benchmark.reality.plants.kernel import GRID
from benchmark.reality.plants.motion import Motion
from benchmark.reality.sensors import Instruments, Sensor, Stamping, measured

DURATION = 20.0


def motion(position, pressure=None):
    blank = np.zeros_like(position)
    pressure = blank if pressure is None else pressure
    return Motion(-1.0, pressure, position, blank, 0.0, 0.0, 0.0, 0.0, 0.0)


TIME = GRID * np.arange(round((DURATION + 1.0) / GRID) + 1) - 1.0
RAMP = motion(1e-3 * TIME, 1e3 * TIME)
QUIET = Sensor(noise=0.0, low=0.0, high=0.030)


def instruments(stamping=None, position=QUIET, pressure=QUIET, together=False):
    stamping = stamping or Stamping()
    return Instruments(pressure, position, stamping, stamping, together)


def stem(one, sensor=QUIET, stamping=None, seed=0):
    return measured(one, instruments(stamping, sensor), DURATION, seed)[1]


def seconds(signal):
    return signal.stamps / 1e9


def test_perfect_sensor():
    signal = stem(RAMP)
    assert (np.diff(signal.stamps) == 1_000_000).all()
    assert signal.values == pytest.approx(1e-3 * seconds(signal), abs=1e-12)


def test_white_and_coloured_noise():
    white = stem(RAMP, replace(QUIET, noise=10e-6)).values - 1e-3 * np.arange(20000) * 1e-3
    coloured = replace(QUIET, noise=10e-6, colour=0.02)
    slow = stem(RAMP, coloured).values - 1e-3 * np.arange(20000) * 1e-3
    for noise, memory in ((white, 0.0), (slow, np.exp(-0.001 / 0.02))):
        assert noise.std() == pytest.approx(10e-6, rel=0.1)
        assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(memory, abs=0.03)


def test_quantisation():
    values = stem(RAMP, replace(QUIET, bits=10)).values
    codes = values / (0.030 / 2**10)
    assert codes == pytest.approx(np.round(codes), abs=1e-9)
    assert np.abs(values - 1e-3 * np.arange(20000) * 1e-3).max() <= 0.5001 * 0.030 / 2**10


def test_lag_and_drift():
    late = stem(RAMP, replace(QUIET, lag=0.04)).values[5000:]
    assert late == pytest.approx(1e-3 * (np.arange(5000, 20000) * 1e-3 - 0.04), abs=1e-9)
    still = motion(np.zeros_like(TIME))
    drifting = stem(still, replace(QUIET, drift=1e-6))
    assert drifting.values == pytest.approx(1e-6 * seconds(drifting), abs=1e-12)


def test_step_through_a_lag():
    step = motion(np.where(TIME < 0, 0.0, 1e-3))
    signal = stem(step, replace(QUIET, lag=0.05))
    assert signal.values == pytest.approx(1e-3 * (1 - np.exp(-seconds(signal) / 0.05)), abs=3e-6)


def test_held_values():
    values = stem(RAMP, replace(QUIET, hold=0.05)).values
    renewed = np.flatnonzero(np.diff(values))
    assert set(np.diff(renewed)) == {50}


def test_exception_reporting():
    signal = stem(RAMP, replace(QUIET, dead_band=0.01))
    assert np.diff(signal.values)[1:] == pytest.approx(3.0e-4, abs=2e-6)
    still = stem(motion(np.zeros_like(TIME)), replace(QUIET, dead_band=0.01, silence=5.0))
    assert seconds(still) == pytest.approx([0.0, 5.0, 10.0, 15.0])


def test_jitter_is_in_the_samples_and_not_in_the_stamps():
    signal = stem(RAMP, stamping=Stamping(rate=100.0, jitter=0.3))
    away = seconds(signal) * 100.0 - np.arange(signal.stamps.size)
    assert 0.28 < np.abs(away[1:]).max() <= 0.3
    assert signal.values == pytest.approx(1e-3 * seconds(signal), abs=1e-11)


def test_stamp_errors_are_not_in_the_samples():
    signal = stem(RAMP, stamping=Stamping(stamp_error=2e-4))
    errors = seconds(signal) - np.arange(20000) * 1e-3
    assert 1.9e-4 < np.abs(errors).max() <= 2e-4
    assert signal.values == pytest.approx(1e-6 * np.arange(20000), abs=1e-12)


def test_drops_bursts_and_offset():
    dropped = stem(RAMP, stamping=Stamping(drops=0.2))
    assert dropped.stamps.size == pytest.approx(16000, rel=0.03)
    gaps = np.diff(seconds(stem(RAMP, stamping=Stamping(bursts=2, burst=0.5))))
    assert np.sort(gaps)[-2:].sum() == pytest.approx(1.0, abs=0.01)
    late = stem(RAMP, stamping=Stamping(offset=0.01))
    assert late.values == pytest.approx(1e-3 * (seconds(late) - 0.01), abs=1e-12)


def test_resolution():
    coarse = stem(RAMP, stamping=Stamping(rate=800.0, jitter=0.2, resolution=1e-3))
    assert (coarse.stamps % 1_000_000 == 0).all()
    assert (np.diff(coarse.stamps) >= 0).all()


def test_rows_of_a_table_share_all_that_happens():
    clock = Stamping(jitter=0.3, drops=0.1)
    pressure, position = measured(RAMP, instruments(clock, together=True), DURATION, 0)
    assert (pressure.stamps == position.stamps).all()
    pressure, position = measured(RAMP, instruments(clock), DURATION, 0)
    assert (
        pressure.stamps.size != position.stamps.size or (pressure.stamps != position.stamps).any()
    )
