# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Each rule of a value type refuses, and its message names the field."""

import dataclasses
import math

import numpy as np
import pytest

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    HIGH_FRICTION,
    LOW_FRICTION,
    Drive,
    KarnoppParameters,
    Recording,
    SensorNoise,
    StemState,
    Valve,
)
from valve_friction_ros.model.checks import require_finite, require_non_negative, require_positive

NOT_NUMBERS = ["1.0", True, None, [1.0], {}]
NOT_FINITE = [math.nan, math.inf, -math.inf]
NEGATIVE = [-1.0, -5e-324]
REQUIREMENTS = [require_finite, require_non_negative, require_positive]


@pytest.mark.parametrize("require", REQUIREMENTS)
class TestChecks:
    @pytest.mark.parametrize("value", NOT_NUMBERS)
    def test_refuses_what_is_no_number(self, require, value):
        with pytest.raises(ValueError, match=r"^quantity must be a number, got"):
            require("quantity", value)

    @pytest.mark.parametrize("value", NOT_FINITE)
    def test_refuses_what_is_not_finite(self, require, value):
        with pytest.raises(ValueError, match=r"^quantity must be finite, got"):
            require("quantity", value)

    @pytest.mark.parametrize("value", [3, np.float32(3), np.int64(3), np.array(3.0)])
    def test_returns_a_float(self, require, value):
        result = require("quantity", value)
        assert type(result) is float
        assert result == 3.0


def test_signs():
    assert require_finite("quantity", -1) == -1.0
    assert require_non_negative("quantity", 0) == 0.0
    assert require_positive("quantity", 5e-324) == 5e-324
    for value in NEGATIVE:
        with pytest.raises(ValueError, match=r"^quantity must not be negative, got -"):
            require_non_negative("quantity", value)
    for value in [0.0, -0.0, *NEGATIVE]:
        with pytest.raises(ValueError, match=r"^quantity must be above zero, got"):
            require_positive("quantity", value)


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
]


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


@pytest.mark.parametrize(
    "instance",
    [BENCH_VALVE, LOW_FRICTION, StemState(0.0), SensorNoise(), Recording(**RECORDING)],
    ids=lambda instance: type(instance).__name__,
)
def test_frozen(instance):
    for field in dataclasses.fields(instance):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(instance, field.name, 1.0)


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
        with pytest.raises(ValueError, match="holds a force and no pressure"):
            _ = force.pressure
        with pytest.raises(ValueError, match="drive force has 3 samples, position 2"):
            Recording(**RECORDING | {"position": [0.0, 0.1]}, driven_by=Drive.FORCE)

    def test_time_begins_at_zero(self):
        recording = Recording(0.25, np.zeros(5), np.zeros(5), start_time=1e9)
        assert len(recording) == 5
        assert recording.duration == 1.0
        np.testing.assert_array_equal(recording.time, [0.0, 0.25, 0.5, 0.75, 1.0])
