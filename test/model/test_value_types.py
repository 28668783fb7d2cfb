# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Rules of value types name the field; excitations at known times, and the converter."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.signal import dlsim

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    HIGH_FRICTION,
    LOW_FRICTION,
    PRESSURE_RANGE,
    Drive,
    IsaSteps,
    KarnoppParameters,
    Recording,
    SampledPressure,
    SensorNoise,
    SineWave,
    SquareWave,
    StemState,
    TriangleWave,
    Valve,
    converter_response,
)

NOT_FINITE = [math.nan, math.inf, -math.inf]
VALVE = {"diaphragm_area": 0.0445, "travel": 0.03}
PARAMETERS = dataclasses.asdict(LOW_FRICTION)
RECORDING = {"sample_period": 1e-3, "drive": [1.0, 2.0, 3.0], "position": [0.0, 0.1, 0.2]}

WORDS = {"drive": "pressure", "position": "position"}

NO_NUMBER = ["text", math.nan, math.inf]
RULES = [
    (Valve, VALVE, "diaphragm_area", [*NO_NUMBER, 0.0, -0.1]),
    (Valve, VALVE, "pressure_reference", NO_NUMBER),
    (Valve, VALVE, "travel", ["text", math.nan, -math.inf, 0.0, -0.03]),
    (KarnoppParameters, PARAMETERS, "mass", [*NO_NUMBER, 0.0, -1.0]),
    (KarnoppParameters, PARAMETERS, "viscous_friction", [*NO_NUMBER, -1.0]),
    (KarnoppParameters, PARAMETERS, "coulomb_friction", [*NO_NUMBER, -1.0]),
    (KarnoppParameters, PARAMETERS, "static_friction", [*NO_NUMBER, -1.0]),
    (KarnoppParameters, PARAMETERS, "spring_constant", [*NO_NUMBER, -1.0]),
    (KarnoppParameters, PARAMETERS, "spring_preload", NO_NUMBER),
    (KarnoppParameters, PARAMETERS, "limit_velocity", [*NO_NUMBER, -1e-9]),
    (Recording, RECORDING, "sample_period", [*NO_NUMBER, 0.0, -1e-3]),
    (Recording, RECORDING, "start_time", NO_NUMBER),
    (SensorNoise, {}, "position", [*NO_NUMBER, -1e-6]),
    (SensorNoise, {}, "pressure", [*NO_NUMBER, -1.0]),
    (StemState, {"position": 0.0}, "position", NO_NUMBER),
    (StemState, {"position": 0.0}, "velocity", NO_NUMBER),
    (IsaSteps, {}, "centre", NO_NUMBER),
    (IsaSteps, {}, "span", [*NO_NUMBER, 0.0]),
    (IsaSteps, {}, "hold", [*NO_NUMBER, -1.0]),
]
WAVES = [SquareWave, TriangleWave, SineWave]
for wave in WAVES:
    RULES += [(wave, {}, "period", [*NO_NUMBER, 0.0, -1.0]), (wave, {}, "low", NO_NUMBER)]
    RULES += [(wave, {}, "high", NO_NUMBER)]


@pytest.mark.parametrize(
    ("kind", "arguments", "name", "value"),
    [(kind, good, name, value) for kind, good, name, values in RULES for value in values],
)
def test_rule_names_the_field(kind, arguments, name, value):
    kind(**arguments)  # without the bad value it stands
    with pytest.raises(ValueError, match=rf"^{name} "):
        kind(**arguments | {name: value})


@pytest.mark.parametrize(
    "limits", [(1e5, 1e5), (2e5, 1e5), (math.nan, 1e5), (1e5, math.nan), (0.0, -math.inf)]
)
def test_pressure_limits_in_order(limits):
    with pytest.raises(ValueError, match=r"^pressure_minimum .* must be below pressure_maximum"):
        Valve(0.0445, pressure_minimum=limits[0], pressure_maximum=limits[1])


def test_static_friction_not_below_coulomb_friction():
    good = {**PARAMETERS, "coulomb_friction": 100.0, "static_friction": 100.0}
    KarnoppParameters(**good)
    below = math.nextafter(100.0, 0.0)
    message = r"^static_friction \(100\) must not be below coulomb_friction \(100\)"
    with pytest.raises(ValueError, match=message):
        KarnoppParameters(**good | {"static_friction": below})


class TestValve:
    def test_no_limits_by_default(self):
        valve = Valve(1.0)
        assert (valve.travel, valve.pressure_minimum, valve.pressure_maximum) == (
            math.inf,
            -math.inf,
            math.inf,
        )
        assert math.isnan(valve.share_of_travel(0.01))

    def test_force_counts_from_the_reference(self):
        valve = Valve(0.05, pressure_reference=101325.0)
        pressure = 101325.0 + np.array([-2e4, 0.0, 1e5])
        # 0.05 m² · (−20, 0, 100) kPa
        np.testing.assert_allclose(valve.actuator_force(pressure), [-1000.0, 0.0, 5000.0])

    def test_pressure_is_the_inverse_of_force(self):
        pressure = np.linspace(0.0, 2.5e5, 11)
        force = BENCH_VALVE.actuator_force(pressure)
        # A difference, a product, a quotient and a sum, each rounded once, of up to 250 kPa.
        np.testing.assert_allclose(
            BENCH_VALVE.actuator_drive(force), pressure, rtol=0, atol=4 * np.spacing(2.5e5)
        )

    def test_share_of_travel(self):
        assert BENCH_VALVE.share_of_travel(0.028575 / 4) == 0.25


def test_paper_values():
    """Section 4, Table 1 (model 1) and (16)."""
    assert (BENCH_VALVE.diaphragm_area, BENCH_VALVE.travel) == (0.0445, 0.028575)
    assert BENCH_VALVE.pressure_reference == 41740.0
    low, high = LOW_FRICTION, HIGH_FRICTION
    assert (low.mass, low.viscous_friction, low.coulomb_friction) == (1.542, 4865.0, 152.7)
    assert (high.mass, high.viscous_friction, high.coulomb_friction) == (1.75, 4.48e4, 606.0)
    for packing in (low, high):
        assert packing.static_friction == packing.coulomb_friction
        assert packing.spring_constant == 2.05e5
        assert packing.spring_preload / packing.spring_constant == pytest.approx(1.13e-3, rel=1e-15)
    assert GRAPHITE_PACKING.static_friction > GRAPHITE_PACKING.coulomb_friction


class TestRecording:
    @pytest.mark.parametrize("name", [*WORDS])
    def test_arrays_are_read_only_copies(self, name):
        samples = np.array([1.0, 2.0, 3.0])
        recording = Recording(**RECORDING | {name: samples})
        samples[0] = 7.0
        kept = getattr(recording, name)
        np.testing.assert_array_equal(kept, [1.0, 2.0, 3.0])
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 7.0
        assert samples.flags.writeable

    @pytest.mark.parametrize("name", [*WORDS])
    @pytest.mark.parametrize("samples", [[], 1.0, [[1.0, 2.0, 3.0]]])
    def test_refuses_what_is_no_row(self, name, samples):
        with pytest.raises(ValueError, match=rf"^{WORDS[name]} must be a row of samples"):
            Recording(**RECORDING | {name: samples})

    @pytest.mark.parametrize("name", [*WORDS])
    @pytest.mark.parametrize("value", NOT_FINITE)
    def test_names_the_first_sample_that_is_not_finite(self, name, value):
        with pytest.raises(ValueError, match=rf"^{WORDS[name]} is not finite at sample 1$"):
            Recording(**RECORDING | {name: [0.0, value, value]})

    def test_refuses_unequal_lengths(self):
        with pytest.raises(ValueError, match="pressure has 3 samples, position 2"):
            Recording(**RECORDING | {"position": [0.0, 0.1]})

    def test_force_is_no_pressure(self):
        force = Recording(**RECORDING, driven_by=Drive.FORCE)
        np.testing.assert_array_equal(force.drive, [1.0, 2.0, 3.0])
        with pytest.raises(ValueError, match="holds a force, not a pressure"):
            _ = force.pressure
        with pytest.raises(ValueError, match="drive force has 3 samples, position 2"):
            Recording(**RECORDING | {"position": [0.0, 0.1]}, driven_by=Drive.FORCE)

    def test_time_begins_at_zero(self):
        recording = Recording(0.25, np.zeros(5), np.zeros(5), start_time=1e9)
        assert len(recording) == 5
        assert recording.duration == 1.0
        np.testing.assert_array_equal(recording.time, [0.0, 0.25, 0.5, 0.75, 1.0])


EPS = np.finfo(float).eps


class TestWaves:
    def test_paper_levels(self):
        """Section 4: 15 % to 75 % of 41.74 to 206.84 kPa, 10.4 s; section 5: the sine."""
        square, triangle, sine = SquareWave(), TriangleWave(), SineWave()
        assert square.low == pytest.approx(41740.0 + 0.15 * 165100.0, rel=1e-15)
        assert square.high == pytest.approx(41740.0 + 0.75 * 165100.0, rel=1e-15)
        assert square.period == 10.4
        assert (triangle.low, triangle.high) == PRESSURE_RANGE == (41740.0, 206840.0)
        assert (sine.low, sine.high, sine.period) == (63950.0, 160440.0, 35.5)

    @pytest.mark.parametrize(
        ("kind", "eighths"),
        [
            (SquareWave, [0, 0, 0, 0, 1, 1, 1, 1]),
            (TriangleWave, [0, 0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25]),
            (
                SineWave,
                [0, 0.5 - 8**-0.5, 0.5, 0.5 + 8**-0.5, 1, 0.5 + 8**-0.5, 0.5, 0.5 - 8**-0.5],
            ),
        ],
    )
    def test_values_over_three_periods(self, kind, eighths):
        wave = kind(low=100.0, high=300.0, period=4.0)
        found = wave.sample(0.5 * np.arange(24))
        expected = 100.0 + 200.0 * np.tile(eighths, 3)
        np.testing.assert_allclose(found, expected, rtol=4 * EPS)

    @pytest.mark.parametrize("kind", WAVES)
    def test_defined_before_the_start(self, kind):
        wave = kind(low=0.0, high=1.0, period=4.0)
        time = np.linspace(0.05, 3.95, 40)
        np.testing.assert_allclose(wave.sample(time - 8.0), wave.sample(time), atol=1e-14)

    @pytest.mark.parametrize("kind", WAVES)
    @pytest.mark.parametrize("low", [2.0, 1.0])
    def test_refuses_levels_without_height(self, kind, low):
        with pytest.raises(ValueError, match=r"^low \(\d\) must be below high \(1\)"):
            kind(low=low, high=1.0)


class TestIsaSteps:
    def test_sequence(self):
        """Section 5: 0.1 % to 50 % about mid-range, each up, back, down and back."""
        steps = IsaSteps()
        middle, span = (41740.0 + 206840.0) / 2, 206840.0 - 41740.0
        percent = np.repeat([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50], 4)
        offsets = percent * np.tile([1, 0, -1, 0], 9)
        expected = np.append(middle, middle + span * offsets / 100)
        assert steps.duration == 370.0
        np.testing.assert_allclose(steps.levels, expected, rtol=4 * EPS)
        assert (steps.levels.min(), steps.levels.max()) == pytest.approx(PRESSURE_RANGE, rel=1e-15)

    def test_each_level_is_held(self):
        steps = IsaSteps(centre=0.0, span=100.0, sizes=(0.1, 0.5), hold=2.0)
        time = np.arange(0.0, 20.0, 0.5)
        expected = np.repeat([0, 10, 0, -10, 0, 50, 0, -50, 0], 4)
        np.testing.assert_array_equal(steps.sample(time[:36]), expected)
        assert steps.duration == 18.0
        np.testing.assert_array_equal(steps.sample(time[36:]), 0.0)  # held beyond the end
        assert steps.sample(-1.0) == 0.0

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"sizes": ()}, r"^sizes must hold at least one step"),
            ({"sizes": (0.1, 0.0)}, r"^step size must be above zero"),
            ({"sizes": (0.1, math.nan)}, r"^step size must be finite"),
        ],
    )
    def test_refusals(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            IsaSteps(**arguments)


class TestSampledPressure:
    def test_linear_between_samples_and_held_outside(self):
        # The clock of the file starts anywhere; the excitation starts at its first sample.
        played = SampledPressure([100.0, 101.0, 103.0], [10.0, 20.0, 0.0])
        found = played.sample([-1.0, 0.0, 0.25, 1.0, 2.0, 3.0, 9.0])
        np.testing.assert_array_equal(found, [10.0, 10.0, 12.5, 20.0, 10.0, 0.0, 0.0])

    def test_keeps_read_only_copies(self):
        times, pressures = np.array([0.0, 1.0]), np.array([1.0, 2.0])
        played = SampledPressure(times, pressures)
        times[1] = pressures[1] = 9.0
        assert played.sample(1.0) == 2.0
        for kept in (played.times, played.pressures):
            with pytest.raises(ValueError, match="read-only"):
                kept[0] = 9.0

    @pytest.mark.parametrize(
        ("times", "pressures", "message"),
        [
            ([], [], r"^times must be a non-empty row of finite numbers"),
            ([0.0, math.nan], [1.0, 2.0], r"^times must be a non-empty row of finite numbers"),
            ([0.0, 1.0], [1.0, math.inf], r"^pressures must be a non-empty row of finite numbers"),
            ([0.0, 1.0], [[1.0, 2.0]], r"^pressures must be a non-empty row of finite numbers"),
            ([0.0, 1.0], [1.0], r"^2 times for 1 pressures"),
            ([0.0, 0.0], [1.0, 2.0], r"^times must increase"),
            ([1.0, 0.0], [1.0, 2.0], r"^times must increase"),
        ],
    )
    def test_refusals(self, times, pressures, message):
        with pytest.raises(ValueError, match=message):
            SampledPressure(times, pressures)


EXCITATIONS = [
    SquareWave(),
    TriangleWave(),
    SineWave(),
    IsaSteps(hold=0.5),
    SampledPressure([0.0, 3.0, 11.0], [1e5, 2e5, 5e4]),
]


@pytest.mark.parametrize("excitation", EXCITATIONS, ids=lambda one: type(one).__name__)
class TestEveryExcitation:
    def test_blocks_equal_one_call(self, excitation):
        time = 1e-3 * np.arange(20000)
        blocks = [excitation.sample(block) for block in np.array_split(time, [1, 777, 5200, 10400])]
        np.testing.assert_array_equal(np.concatenate(blocks), excitation.sample(time))


class TestConverter:
    def test_any_command_as_scipy_steps_it(self):
        period, lag = 0.02, 0.3
        command = np.random.default_rng(0).uniform(4e4, 2e5, 400)
        decay = math.exp(-period / lag)
        system = (decay, 1 - decay, 1.0, 0.0, period)  # held input, exact step
        _, expected, _ = dlsim(system, command, x0=command[0])
        found = converter_response(command, period, lag)
        np.testing.assert_allclose(found, expected[:, 0], rtol=100 * EPS)

    def test_begins_in_steady_state_or_as_told(self):
        np.testing.assert_allclose(converter_response(np.full(50, 7e4), 1e-3), 7e4, rtol=50 * EPS)
        found = converter_response(np.full(3, 7e4), 1.0, 1.0, initial=5e4)
        expected = 7e4 - 2e4 * np.exp([0.0, -1.0, -2.0])
        np.testing.assert_allclose(found, expected, rtol=4 * EPS)

    def test_blocks_equal_one_call(self):
        """A block that begins at the sample where the last one ended goes on from there."""
        command = SquareWave(period=1.0).sample(1e-3 * np.arange(3000))
        whole = converter_response(command, 1e-3)
        head = converter_response(command[:1201], 1e-3)
        tail = converter_response(command[1200:], 1e-3, initial=head[-1])
        np.testing.assert_allclose(np.append(head, tail[1:]), whole, rtol=4 * EPS)

    def test_refusals(self):
        with pytest.raises(ValueError, match=r"^sample_period must be above zero"):
            converter_response(np.ones(3), 0.0)
        with pytest.raises(ValueError, match=r"^lag must not be negative"):
            converter_response(np.ones(3), 1e-3, -1.0)


class TestSensorNoise:
    SIZE = 100_000

    @pytest.fixture
    def clean(self):
        return Recording(1e-3, np.full(self.SIZE, 1e5), np.full(self.SIZE, 0.01), start_time=42.0)

    def test_stated_deviation(self, clean):
        noise = SensorNoise(position=10e-6, pressure=100.0, seed=4)
        noisy = noise.applied_to(clean)
        position, pressure = noisy.position - clean.position, noisy.pressure - clean.pressure
        # Five standard errors: 1/√n of a mean, 1/√(2n) of a deviation, 1/√n of a correlation.
        for found, deviation in ((position, 10e-6), (pressure, 100.0)):
            assert abs(found.mean()) < 5 * deviation / math.sqrt(self.SIZE)
            assert abs(found.std() / deviation - 1) < 5 / math.sqrt(2 * self.SIZE)
        unit = position / 10e-6, pressure / 100.0
        assert abs(np.mean(unit[0] * unit[1])) < 5 / math.sqrt(self.SIZE)
        for one in unit:
            assert abs(np.mean(one[1:] * one[:-1])) < 5 / math.sqrt(self.SIZE)

    def test_reproducible_by_its_seed(self, clean):
        def seen(seed):
            return SensorNoise(1e-5, 100.0, seed).applied_to(clean)

        np.testing.assert_array_equal(seen(1).position, seen(1).position)
        np.testing.assert_array_equal(seen(1).pressure, seen(1).pressure)
        assert not np.array_equal(seen(1).position, seen(2).position)

    def test_a_gap_stays_one(self, clean):
        noise = SensorNoise(1e-5, 100.0)
        assert noise.applied_to(dataclasses.replace(clean, gap="gap of 1 s")).gap == "gap of 1 s"
        assert noise.applied_to(clean).gap == ""

    def test_each_sensor_by_itself(self, clean):
        """The noise of one sensor does not depend on whether the other has any."""
        both = SensorNoise(1e-5, 100.0, 1).applied_to(clean)
        one = SensorNoise(position=1e-5, seed=1).applied_to(clean)
        np.testing.assert_array_equal(one.position, both.position)
        np.testing.assert_array_equal(one.pressure, clean.pressure)
