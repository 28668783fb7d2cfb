# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Step tests with a known response; validation by its definitions, and how the stem starts."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.identification import (
    RefusalError,
    Validation,
    find_steps,
    identified_model,
    step_test,
    validate,
)
from valve_friction_ros.identification.steps.validation import measured_start
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    IsaSteps,
    Recording,
    SensorNoise,
    SineWave,
    StemState,
    converter_response,
    simulate,
)
from valve_friction_ros.model.excitations import PRESSURE_RANGE

PERIOD = 1e-3
SPAN = PRESSURE_RANGE[1] - PRESSURE_RANGE[0]


def held(levels, hold):
    """Each level for `hold` samples."""
    return np.repeat(np.asarray(levels, dtype=float), hold)


def backlash(signal, dead_band, start=0.0):
    """Play operator: the output follows once the input has used up the dead band."""
    output, place = np.empty_like(signal), start
    for index, value in enumerate(signal):
        place = min(max(place, value - dead_band / 2), value + dead_band / 2)
        output[index] = place
    return output


class TestFirstOrderWithDelay:
    @settings(max_examples=30)
    @given(
        delay=st.floats(0.01, 0.5),
        lag=st.floats(0.05, 0.5),
        gain=st.floats(-5.0, 5.0).filter(lambda one: abs(one) > 0.1),
        size=st.sampled_from([-20.0, -0.5, 0.5, 20.0]),
    )
    def test_times_and_gain(self, delay, lag, gain, size):
        time = np.arange(20_000) * PERIOD
        signal = np.where(time < 3.0, 40.0, 40.0 + size)
        since = np.maximum(time - 3.0 - delay, 0.0)
        position = 10.0 + gain * size * (1 - np.exp(-since / lag))
        (step,) = step_test(signal, position, PERIOD).steps
        assert step.time == 3.0
        assert (step.input_change, step.moved) == (size, True)
        assert step.gain == pytest.approx(gain, rel=1e-9)
        assert step.t63 == pytest.approx(delay + lag, abs=1e-5)  # a chord between two samples
        assert step.t86 == pytest.approx(delay + 2 * lag, abs=1e-5)
        seen = -lag * math.log(1 - 1e-3)  # a thousandth of the range counts as a movement
        assert step.dead_time == pytest.approx(delay + seen, abs=PERIOD)
        assert step.overshoot == 0.0

    def test_the_smallest_movement_delays_what_is_detected(self):
        time = np.arange(20_000) * PERIOD
        position = np.where(time < 3.0, 0.0, 1 - np.exp(-(time - 3.0) / 0.5))
        (step,) = step_test(held([0, 1], 10_000), position, PERIOD, [3000], 0.5).steps
        assert step.dead_time == pytest.approx(0.5 * math.log(2), abs=1e-5)


def test_overshoot_of_a_second_order_system():
    """exp(−π·ζ/√(1 − ζ²)), reached at π/(ω·√(1 − ζ²))."""
    damping, frequency = 0.3, 8.0
    damped = frequency * math.sqrt(1 - damping**2)
    time = np.arange(10_000) * PERIOD
    ringing = np.exp(-damping * frequency * time) * (
        np.cos(damped * time) + damping * frequency / damped * np.sin(damped * time)
    )
    position = np.concatenate([np.zeros(1000), -2 * (1 - ringing)])
    (step,) = step_test(held([5, 4], [1000, 10_000]), position, PERIOD).steps
    expected = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    assert step.overshoot == pytest.approx(expected, rel=1e-4)
    assert step.gain == pytest.approx(2.0, rel=1e-6)


class TestBacklash:
    """Steps around 50 % that grow, as the standard has them."""

    LEVELS = IsaSteps(centre=50.0, span=100.0, hold=1.0).levels

    @settings(max_examples=30)
    @given(dead_band=st.floats(0.05, 60.0))
    def test_bracket_always_holds_it(self, dead_band):
        signal = held(self.LEVELS, 20)
        found = step_test(signal, backlash(signal, dead_band, 50.0), PERIOD, smallest_movement=1e-9)
        low, high = found.dead_band
        assert low <= dead_band * (1 + 1e-9)
        assert high >= dead_band * (1 - 1e-9)
        assert found.resolution.ignored == 0.0

    def test_steps_on_in_one_way_are_all_answered(self):
        signal = held([0, 5, 5.5, 5.7, 9], 100)
        found = step_test(signal, backlash(signal, 2.0), PERIOD)
        assert found.resolution == (0.0, pytest.approx(0.2))
        assert found.dead_band == (0.0, math.inf)  # never tried


def test_resolution_of_a_stem_that_jumps():
    """It moves only once the input is 1 ahead, and then catches up."""
    levels = [0, 1.5, 2.1, 2.4, 3.0, 3.5]
    position = held([0, 1.5, 1.5, 1.5, 3.0, 3.0], 100)
    found = step_test(held(levels, 100), position, PERIOD)
    assert found.resolution == (pytest.approx(0.9), pytest.approx(1.5))


class TestSteps:
    @pytest.mark.parametrize("noise", [0.0, 0.05])
    def test_of_a_command(self, noise):
        signal = held([0, 1, 3, 3.5, -2], 500)
        signal += noise * np.random.default_rng(0).standard_normal(signal.size)
        assert find_steps(signal) == [500, 1000, 1500, 2000]

    def test_of_a_pressure_behind_a_lag(self):
        """Where the slope jumps, noiseless to the sample."""
        command = held([50, 60, 50, 20, 50, 120], 8000)
        pressure = converter_response(command, PERIOD, 1.3)
        assert find_steps(pressure) == [8000, 16_000, 24_000, 32_000, 40_000]
        noisy = pressure + 0.1 * np.random.default_rng(0).standard_normal(pressure.size)
        found = find_steps(noisy)
        np.testing.assert_allclose(found, [8000, 16_000, 24_000, 32_000, 40_000], atol=60)

    def test_none(self):
        assert find_steps(np.full(100, 3.0)) == []
        with pytest.raises(RefusalError, match="the input contains no step"):
            step_test(np.full(100, 3.0), np.arange(100.0), PERIOD)


@pytest.fixture(scope="module")
def isa_test(benches):
    """Function of valve name and noise: the ISA test, command in %, stem in % of travel."""

    def run(name, noise):
        valve, truth = benches[name]
        command = IsaSteps().sample(np.arange(37_000) * 0.01)
        pressure = converter_response(command, 0.01)
        record = Recording(0.01, pressure, simulate(valve, truth, pressure, 0.01).position)
        record = noise.applied_to(record) if noise else record
        return step_test(
            100 * (command - PRESSURE_RANGE[0]) / SPAN, 100 * record.position / valve.travel, 0.01
        )

    return run


@pytest.mark.parametrize("noise", [None, SensorNoise(28.6e-6, 165.0, seed=1)])
class TestBench:
    @pytest.mark.parametrize("name", ["low", "high", "graphite"])
    def test_dead_band_holds_that_of_the_friction(self, benches, isa_test, name, noise):
        valve, truth = benches[name]
        found = isa_test(name, noise)
        assert len(found.steps) == 36
        force = truth.coulomb_friction + truth.static_friction
        width = 100 * force / valve.diaphragm_area / SPAN
        assert found.dead_band.ignored < width < found.dead_band.answered


@pytest.mark.parametrize(
    ("position", "starts", "message"),
    [
        (np.zeros(4), None, r"got shapes \(100,\) and \(4,\)"),
        (np.append(np.nan, np.zeros(99)), None, "the position is not finite at sample 0"),
        *((held([0, 1], 50), one, "samples from 1 to 99") for one in ([0], [50, 50], [100])),
    ],
)
def test_bad_input(position, starts, message):
    with pytest.raises(ValueError, match=message):
        step_test(held([0, 1], 50), position, PERIOD, starts)


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


def test_figures_by_hand():
    recording = Recording(0.1, np.zeros(4), np.array([0.0, 2.0, 4.0, 2.0]))
    found = Validation(recording, np.array([1.0, 2.0, 2.0, 2.0]))
    np.testing.assert_array_equal(found.residual, [1.0, 0.0, -2.0, 0.0])
    assert found.rms == pytest.approx(math.sqrt(5) / 2)
    assert found.maximum_error == 2.0
    assert found.fit == pytest.approx(1 - math.sqrt(5) / math.sqrt(8))
    assert Validation(recording, np.full(4, 2.0)).fit == 0.0


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

    def test_noise_is_no_motion_and_a_stop_is_no_place_beyond(self):
        noise = 28.6e-6 * np.random.default_rng(0).standard_normal(5000)
        state = measured_start(Recording(1e-3, np.zeros(5000), 5e-3 + noise), BENCH_VALVE)
        assert state.velocity == 0.0
        assert state.position == pytest.approx(5e-3, abs=15e-6)
        beyond = Recording(1e-3, np.zeros(500), np.full(500, -1e-5))
        assert measured_start(beyond, BENCH_VALVE) == StemState(0.0)


def test_no_validation_without_motion_or_spring():
    recording = Recording(1e-3, np.full(500, 1e5), np.full(500, 1e-3))
    with pytest.raises(RefusalError, match="the stem did not move"):
        validate(recording, BENCH_VALVE, LOW_FRICTION)
    loose = dataclasses.replace(LOW_FRICTION, spring_constant=0.0)
    with pytest.raises(RefusalError, match="without a spring cannot be validated"):
        validate(recording, BENCH_VALVE, loose)


class TestIdentifiedModel:
    @pytest.mark.parametrize("name", ["coulomb_friction", "spring_constant", "spring_preload"])
    def test_without_these_there_is_none(self, name):
        with pytest.raises(RefusalError, match=f"{name} was not identified, but a model needs it"):
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
        assert {name: getattr(model.parameters, name) for name in VALUES} == VALUES
        assert not model.notes
