# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Validation: fit and errors by their definitions, and how the simulated stem starts."""

import dataclasses
import math

import numpy as np
import pytest

from valve_friction_ros.identification import (
    RefusalError,
    Validation,
    identified_model,
    validate,
)
from valve_friction_ros.identification.steps.validation import measured_start
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    StemState,
    simulate,
)

VALUES = {
    "mass": 1.6,
    "viscous_friction": 5000.0,
    "coulomb_friction": 150.0,
    "static_friction": 160.0,
    "spring_constant": 2e5,
    "spring_preload": 230.0,
}


def without(*names, **changes):
    return {**VALUES, **dict.fromkeys(names, math.nan), **changes}


class TestFigures:
    RECORDING = Recording(0.1, np.zeros(4), np.array([0.0, 2.0, 4.0, 2.0]))
    FOUND = Validation(RECORDING, np.array([1.0, 2.0, 2.0, 2.0]))

    def test_by_hand(self):
        np.testing.assert_array_equal(self.FOUND.residual, [1.0, 0.0, -2.0, 0.0])
        assert self.FOUND.rms == pytest.approx(math.sqrt(5) / 2)
        assert self.FOUND.maximum_error == 2.0
        assert self.FOUND.fit == pytest.approx(1 - math.sqrt(5) / math.sqrt(8))

    def test_the_mean_position_fits_nothing(self):
        assert Validation(self.RECORDING, np.full(4, 2.0)).fit == 0.0


@pytest.mark.parametrize("name", ["low", "high", "graphite"])
def test_the_true_model_leaves_nothing(benches, bench_record, name):
    """Nothing but what cubics over a few samples take from the sine: less than 0.1 nm."""
    found = validate(bench_record(name, SineWave(), 71.0), *benches[name])
    assert found.maximum_error < 1e-10
    assert found.fit == pytest.approx(1.0, abs=1e-9)


def test_noise_is_all_that_is_left(benches, bench_record):
    """Nothing of the pressure's noise comes through, which would break the stem away early."""
    noise = SensorNoise(28.6e-6, 165.0, seed=2)
    found = validate(bench_record("high", SineWave(), 71.0, noise), *benches["high"])
    assert found.rms == pytest.approx(28.6e-6, rel=0.03)


def test_another_friction_is_seen(bench_record):
    """A dead band that is 906.6 N too wide shifts the stem by up to half of it over k."""
    found = validate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, HIGH_FRICTION)
    shift = (HIGH_FRICTION.coulomb_friction - LOW_FRICTION.coulomb_friction) / 2.05e5
    assert found.maximum_error > 0.9 * shift
    assert found.fit < 0.8


class TestStart:
    def test_off_balance_in_the_dead_band(self):
        """2 mm off the balance is 410 N, which 606 N of friction hold."""
        pressure = np.full(2000, 120e3)
        pressure[1000:] += np.linspace(0, 60e3, 1000)
        start = StemState(17e-3)
        position = simulate(BENCH_VALVE, HIGH_FRICTION, pressure, 1e-3, start).position
        assert position[900] == 17e-3
        found = validate(Recording(1e-3, pressure, position), BENCH_VALVE, HIGH_FRICTION)
        assert found.maximum_error < 1e-12

    @pytest.mark.parametrize("name", ["low", "high", "graphite"])
    def test_in_full_motion(self, benches, bench_record, name):
        """A jump-free start: a stem that is seen to move does not have to break away first."""
        whole = bench_record(name, SineWave(), 71.0)
        begin = 8000
        late = Recording(1e-3, whole.pressure[begin:], whole.position[begin:])
        velocity = np.diff(whole.position)[begin] / 1e-3
        assert abs(velocity) > 1e-3
        state = measured_start(late, BENCH_VALVE)
        assert state.velocity == pytest.approx(velocity, rel=0.01)
        assert state.position == pytest.approx(whole.position[begin], abs=1e-7)
        assert validate(late, *benches[name]).maximum_error < 2e-6

    def test_noise_is_no_motion(self):
        noise = 28.6e-6 * np.random.default_rng(0).standard_normal(5000)
        recording = Recording(1e-3, np.zeros(5000), 5e-3 + noise)
        state = measured_start(recording, BENCH_VALVE)
        assert state.velocity == 0.0
        assert state.position == pytest.approx(5e-3, abs=15e-6)

    def test_within_the_stops(self):
        recording = Recording(1e-3, np.zeros(500), np.full(500, -1e-5))
        assert measured_start(recording, BENCH_VALVE) == StemState(0.0)


class TestRefusals:
    def test_no_motion(self):
        recording = Recording(1e-3, np.full(500, 1e5), np.full(500, 1e-3))
        with pytest.raises(RefusalError, match="the stem did not move"):
            validate(recording, BENCH_VALVE, LOW_FRICTION)

    def test_no_spring(self, bench_record):
        loose = dataclasses.replace(LOW_FRICTION, spring_constant=0.0)
        with pytest.raises(RefusalError, match="without a spring cannot be validated"):
            validate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, loose)


class TestIdentifiedModel:
    def test_complete(self):
        model = identified_model(VALUES)
        assert model.notes == ()
        assert {name: getattr(model.parameters, name) for name in VALUES} == VALUES

    @pytest.mark.parametrize("name", ["coulomb_friction", "spring_constant", "spring_preload"])
    def test_without_these_there_is_none(self, name):
        with pytest.raises(RefusalError, match=f"{name} was not identified, and a model needs it"):
            identified_model(without(name))

    def test_what_stands_in_is_told(self):
        model = identified_model(without("mass", "viscous_friction", "static_friction"))
        assert model.parameters.mass == 1.0
        assert model.parameters.static_friction == 150.0
        assert model.parameters.viscous_friction == pytest.approx(2 * math.sqrt(2e5))
        assert [note.split()[0] for note in model.notes] == [
            "mass",
            "viscous_friction",
            "static_friction",
        ]

    def test_the_valve_file_stands_in_first(self):
        known = {"mass": 1.7, "viscous_friction": 4000.0, "spring_preload": 229.0}
        model = identified_model(without(*known), known)
        assert {name: getattr(model.parameters, name) for name in known} == known
        assert all(note.endswith("of the valve file") for note in model.notes)

    def test_impossible_values_are_mended_and_told(self):
        model = identified_model(without(viscous_friction=-5.0, static_friction=149.0))
        assert model.parameters.viscous_friction > 0
        assert model.parameters.static_friction == 150.0
        assert "viscous_friction is negative (-5 N·s/m)" in model.notes
        assert any("lies below coulomb_friction" in note for note in model.notes)

    def test_extensions_take_part_and_clocks_do_not(self):
        """A clock offset is in estimates of earlier versions."""
        extra = {"stribeck_velocity": 3e-3, "viscous_asymmetry": 0.1, "clock_offset": 0.02}
        model = identified_model({**VALUES, **extra})
        assert model.parameters.stribeck_velocity == 3e-3
        assert model.parameters.viscous_asymmetry == 0.1
        assert not model.notes
