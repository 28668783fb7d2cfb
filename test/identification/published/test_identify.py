# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The published identification on bench records."""

import dataclasses

import numpy as np
import pytest

from valve_friction_ros.identification import (
    FIXABLE,
    UNITS,
    IdentificationSettings,
    RefusalError,
    published_estimate,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    IsaSteps,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.signals import differentiate

FOUR_COLUMNS = IdentificationSettings(position_bias=1.13e-3)
NOISE = SensorNoise(position=10e-6, pressure=100.0, seed=0)


def assert_identified(estimate, true, tolerances):
    for name, tolerance in tolerances.items():
        value, expected = getattr(estimate, name), getattr(true, name)
        assert value == pytest.approx(expected, rel=tolerance), name


# What is asked of noise-free records. The mass is smoothed by the 31 ms window of the derivatives.
NOISE_FREE = {
    "viscous_friction": 1e-3,
    "coulomb_friction": 1e-3,
    "spring_constant": 1e-3,
    "mass": 0.1,
}


@pytest.mark.parametrize("name", ["low", "high"])
class TestNoiseFree:
    @pytest.mark.parametrize("duration", [20.8, 52.0])
    def test_square_wave_in_the_four_column_form(self, benches, bench_record, name, duration):
        """The paper's experiment: two periods and more, bias from (16)."""
        estimate = published_estimate(
            bench_record(name, SquareWave(), duration), BENCH_VALVE, FOUR_COLUMNS
        )
        assert_identified(estimate, benches[name].parameters, NOISE_FREE)
        assert estimate.spring_preload == estimate.spring_constant * 1.13e-3
        assert estimate.fixed == ()
        assert estimate.warnings == ()

    @pytest.mark.parametrize(
        ("excitation", "duration"), [(SineWave(), 71.0), (IsaSteps(), 370.0)], ids=["sine", "isa"]
    )
    def test_preload_as_a_regressor(self, benches, bench_record, name, excitation, duration):
        estimate = published_estimate(bench_record(name, excitation, duration), BENCH_VALVE)
        tolerances = NOISE_FREE | {"spring_preload": 1e-3}
        assert_identified(estimate, benches[name].parameters, tolerances)
        assert estimate.fixed == ()
        assert estimate.warnings == ()

    def test_square_wave_does_not_tell_the_mass(self, benches, bench_record, name):
        """Two exponentials and a level each way: four equations for five parameters."""
        record = bench_record(name, SquareWave(), 20.8)
        estimate = published_estimate(record, BENCH_VALVE, IdentificationSettings(assumed_mass=1.6))
        assert estimate.mass == 1.6
        assert estimate.fixed == ("mass",)
        assert estimate.settings.fixed == {"mass": 1.6}
        (warning,) = estimate.warnings
        assert warning.startswith("the record does not determine the mass")
        assert warning.endswith("1.6 kg is assumed")
        assert_identified(
            estimate,
            benches[name].parameters,
            {"coulomb_friction": 1e-3, "spring_constant": 1e-3, "viscous_friction": 2e-3},
        )

    def test_static_friction(self, benches, bench_record, name):
        """F_s = F_c here; in a sample the pull grows by 0.0445 m² · 99 kPa/1.3 s: 3.4 N."""
        estimate = published_estimate(
            bench_record(name, SquareWave(), 20.8), BENCH_VALVE, FOUR_COLUMNS
        )
        assert estimate.static_friction >= estimate.coulomb_friction
        assert estimate.static_friction == pytest.approx(
            benches[name].parameters.static_friction, abs=3.4
        )


@pytest.mark.parametrize("seed", range(4))
def test_noise_does_not_pass_for_a_mass(bench_record, seed):
    """Noise in the acceleration gives a positive mass, but another one by another window."""
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=seed)
    settings = dataclasses.replace(FOUR_COLUMNS, assumed_mass=1.6)
    estimate = published_estimate(
        bench_record("high", SquareWave(), 52.0, noise), BENCH_VALVE, settings
    )
    assert estimate.mass == 1.6
    assert estimate.fixed == ("mass",)
    assert any("with half the derivative window" in warning for warning in estimate.warnings)


def test_estimated_model_repeats_the_record(bench_record):
    """Simulated with the estimate, the stem is where it was, to 0.1 % of its stroke."""
    record = bench_record("low", SineWave(), 71.0)
    parameters = published_estimate(record, BENCH_VALVE).parameters()
    found = simulate(BENCH_VALVE, parameters, record.pressure, record.sample_period)
    error = np.abs(found.position - record.position).max()
    assert error < 1e-3 * np.ptp(record.position)


class TestEstimate:
    def test_round_trip_of_the_parameters(self, bench_record):
        estimate = published_estimate(
            bench_record("low", SquareWave(), 20.8), BENCH_VALVE, FOUR_COLUMNS
        )
        assert list(estimate.values) == list(UNITS)
        parameters = estimate.parameters()
        assert isinstance(parameters, KarnoppParameters)
        for name, value in estimate.values.items():
            assert getattr(parameters, name) == value
        assert parameters.limit_velocity == 0.0
        assert KarnoppParameters(**estimate.values) == parameters

    def test_figures_are_those_of_the_chosen_step(self, bench_record):
        estimate = published_estimate(bench_record("high", SquareWave(), 20.8, NOISE), BENCH_VALVE)
        sweep = estimate.sweep
        (chosen,) = np.flatnonzero(sweep.thresholds == estimate.threshold)
        assert estimate.samples == sweep.samples[chosen]
        assert estimate.sigma == sweep.sigma[chosen]
        assert estimate.r_squared == sweep.r_squared[chosen]
        for name in sweep.estimates:
            assert getattr(estimate, name) == sweep.estimates[name][chosen]

    def test_thresholds_of_the_paper(self, bench_record):
        """(8) with S = 330 and Z = 350."""
        record = bench_record("low", SquareWave(), 20.8)
        estimate = published_estimate(record, BENCH_VALVE, FOUR_COLUMNS)
        thresholds = estimate.sweep.thresholds
        assert thresholds.size == 330
        np.testing.assert_allclose(thresholds, thresholds[0] * np.arange(1, 331), rtol=1e-14)
        speed = np.gradient(record.position, record.sample_period)
        assert 350 * thresholds[0] == pytest.approx(np.abs(speed).max(), rel=0.02)


class TestFixed:
    @pytest.mark.parametrize("name", [name for name in FIXABLE if name != "limit_velocity"])
    def test_returned_exactly(self, bench_record, name):
        value = 1.1 * getattr(LOW_FRICTION, name)
        record = bench_record("low", SineWave(), 71.0)
        estimate = published_estimate(
            record, BENCH_VALVE, IdentificationSettings(fixed={name: value})
        )
        assert getattr(estimate, name) == value
        assert name in estimate.fixed
        free = {other for other in UNITS if other not in estimate.fixed}
        assert all(np.isfinite(getattr(estimate, other)) for other in free)

    @pytest.mark.parametrize(
        "name",
        ["mass", "viscous_friction", "coulomb_friction", "spring_constant", "spring_preload"],
    )
    def test_the_others_stay_true(self, bench_record, name):
        fixed = {name: getattr(LOW_FRICTION, name)}
        record = bench_record("low", SineWave(), 71.0)
        estimate = published_estimate(record, BENCH_VALVE, IdentificationSettings(fixed=fixed))
        tolerances = NOISE_FREE | {"spring_preload": 1e-3}
        assert_identified(estimate, LOW_FRICTION, tolerances)
        assert estimate.warnings == ()

    def test_a_fixed_mass_makes_the_square_wave_enough(self, bench_record):
        record = bench_record("low", SquareWave(), 20.8)
        settings = IdentificationSettings(fixed={"mass": LOW_FRICTION.mass})
        estimate = published_estimate(record, BENCH_VALVE, settings)
        assert estimate.warnings == ()
        tolerances = NOISE_FREE | {"spring_preload": 1e-3}
        assert_identified(estimate, LOW_FRICTION, tolerances)

    def test_limit_velocity_sets_the_threshold(self, bench_record):
        record = bench_record("low", SineWave(), 71.0)
        settings = IdentificationSettings(fixed={"limit_velocity": 1e-3})
        estimate = published_estimate(record, BENCH_VALVE, settings)
        assert estimate.threshold == 1e-3
        assert estimate.sweep.thresholds.tolist() == [1e-3]
        assert_identified(estimate, LOW_FRICTION, NOISE_FREE)


class TestRefusals:
    def refused(self, record, settings=None):
        with pytest.raises(RefusalError) as refusal:
            published_estimate(record, BENCH_VALVE, settings)
        return str(refusal.value)

    def test_too_short(self, bench_record):
        record = bench_record("low", SquareWave(), 20.8)
        short = Recording(1e-3, record.pressure[:309], record.position[:309])
        message = self.refused(short)
        assert message.startswith("the record is too short: 309 samples (0.308 s)")
        assert "at least 310" in message

    def test_stem_never_moved(self):
        record = Recording(1e-3, np.linspace(4e4, 2e5, 5000), np.full(5000, 0.01))
        assert self.refused(record).startswith("the stem did not move: its position spans 0 µm")

    def test_only_noise(self):
        still = Recording(1e-3, np.linspace(4e4, 2e5, 20000), np.full(20000, 0.01))
        message = self.refused(NOISE.applied_to(still))
        assert message.startswith("the stem did not move: its position spans")
        assert "µm of noise" in message

    @pytest.mark.parametrize(("levels", "way"), [((6e4, 1.6e5), "up"), ((1.6e5, 6e4), "down")])
    def test_one_direction(self, levels, way):
        pressure = converter_response(np.repeat(levels, [2000, 8000]), 1e-3)
        position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 1e-3).position
        message = self.refused(Recording(1e-3, pressure, position))
        assert message.startswith(f"the stem moved only {way}")
        assert "friction and spring cannot be separated" in message

    @pytest.mark.parametrize(("levels", "way"), [((6e4, 1.6e5), "up"), ((1.6e5, 6e4), "down")])
    def test_one_direction_under_noise(self, levels, way):
        """The noise of the resting stem is no motion the other way."""
        pressure = converter_response(np.repeat(levels, [2000, 8000]), 1e-3)
        position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 1e-3).position
        message = self.refused(NOISE.applied_to(Recording(1e-3, pressure, position)))
        assert message.startswith(f"the stem moved only {way}")

    @pytest.mark.parametrize("left", [4 * 301 - 1, 4 * 301])
    def test_too_few_moving_samples(self, bench_record, left):
        """Less than a window, here of 301 samples, for each of four parameters is not enough."""
        record = bench_record("low", SquareWave(), 20.8)
        speed = np.abs(differentiate(record.position, record.sample_period, 301).velocity)
        limit = np.partition(speed, -left - 1)[-left - 1]  # the speed that `left` are above
        settings = IdentificationSettings(
            derivative_window=301, position_bias=1.13e-3, fixed={"limit_velocity": limit}
        )
        if left < 4 * 301:
            message = self.refused(record, settings)
            assert message.startswith("no threshold leaves enough samples in motion")
            assert "4 parameters" in message
        else:
            assert published_estimate(record, BENCH_VALVE, settings).samples == left


class TestSettings:
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"order": 1}, r"^order must be at least 2"),
            (
                {"derivative_window": 30},
                r"^derivative_window must be odd and at least order \+ 2 = 5, got 30",
            ),
            (
                {"derivative_window": 3},
                r"^derivative_window must be odd and at least order \+ 2 = 5, got 3",
            ),
            ({"steps": 0}, r"^steps \(0\) must be above zero"),
            ({"steps": 350}, r"^steps \(350\) .* below resolution \(350\)"),
            ({"assumed_mass": -1.0}, r"^assumed_mass must be above zero"),
            ({"position_bias": np.nan}, r"^position_bias must be finite"),
            ({"fixed": {"weight": 1.0}}, r"^'weight' is not a parameter .* mass, coulomb_friction"),
            ({"fixed": {"mass": -1.0}}, r"^mass must be above zero"),
            ({"fixed": {"spring_constant": "text"}}, r"^spring_constant must be a number"),
            ({"fixed": {"spring_preload": np.inf}}, r"^spring_preload must be finite"),
            ({"fixed": {"limit_velocity": 0.0}}, r"^limit_velocity must be above zero"),
            (
                {"position_bias": 1e-3, "fixed": {"spring_preload": 200.0}},
                r"^position_bias and a fixed spring_preload exclude each other",
            ),
        ],
    )
    def test_refusals(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            IdentificationSettings(**arguments)

    def test_paper_defaults(self):
        settings = IdentificationSettings()
        assert (settings.published_window, settings.order) == (31, 3)
        assert (settings.steps, settings.resolution) == (330, 350)
        assert settings.fixed == {}
        assert settings.position_bias is None

    def test_fixed_is_a_read_only_copy(self):
        given = {"spring_preload": -5.0}
        settings = IdentificationSettings(fixed=given)
        given["mass"] = 1.0
        assert settings.fixed == {"spring_preload": -5.0}
        with pytest.raises(TypeError):
            settings.fixed["mass"] = 1.0


def test_force_counts_from_the_reference(bench_record, benches):
    """An absolute sensor reads an atmosphere more, and its valve says so: the same numbers."""
    record = bench_record("low", SquareWave(), 20.8)
    shifted = Recording(record.sample_period, record.pressure + 101325.0, record.position)
    valve = Valve(0.0445, pressure_reference=BENCH_VALVE.pressure_reference + 101325.0)
    estimate = published_estimate(shifted, valve, FOUR_COLUMNS)
    assert_identified(estimate, benches["low"].parameters, NOISE_FREE)
